//! A virtual rig with a tap on each of its lines, a service that restarts, and a client that commands it: for the tests that
//! repeat one thing many times.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Program;
use std::str::FromStr as _;
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;
use tactus_bus::{BusError, Client, Endpoint, HeldLease, History, Hold, Published, Subscription};
use tactus_e2e::{DEADLINE, Process, Tap, Way, free_endpoint, small_rig, within};
use tactus_schema::key::Command;
use tactus_schema::pb;
use tempfile::TempDir;
use tokio::runtime::Runtime;
use tokio::task::JoinHandle;

/// Name of the rig.
pub(crate) const RIG: &str = "bench";

/// Time between two questions about a state that nobody announces.
const AGAIN: Duration = Duration::from_millis(20);

/// A machine without time for devices and service lets resets fail, and ends runs.
pub(crate) const TRIES_MAX: usize = 4;

/// How often the tests of this kind repeat each of their trials: `TACTUS_TRIALS`.
pub(crate) fn trials() -> Option<usize> {
    number("TACTUS_TRIALS")
}

/// A number in the environment.
pub(crate) fn number<T: std::str::FromStr>(name: &str) -> Option<T> {
    let text = env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text:?} is no number")))
}

/// What passes on the stage's line.
#[derive(Debug, Clone)]
pub(crate) enum Seen {
    /// A byte that stops the stage: a feed hold, or a reset.
    Stop,
    /// The command to home.
    Home,
    /// A report of the controller.
    Report {
        /// Its first word, such as `Idle`.
        state: String,
        z_mm: f64,
    },
}

/// The tapped line of the stage.
pub(crate) struct StageLine {
    tap: Tap,
    seen: Receiver<(Instant, Seen)>,
}

/// What the virtual sensor has sent so far.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sent {
    pub(crate) frames: u64,
    /// The last frame's time by the sensor's clock, in ms.
    pub(crate) last_ms: u32,
}

/// How a bench differs from the usual one.
pub(crate) struct Options {
    pub(crate) rig: String,
    /// Folder of recordings, if not one of the bench.
    pub(crate) recordings: Option<PathBuf>,
    /// False: the service's sensor does not exist.
    pub(crate) has_sensor: bool,
    /// How the service starts.
    pub(crate) start: fn(&str, &Path, &[&str]) -> Process,
    /// Processes run on the first core only.
    pub(crate) one_core: bool,
}

/// The rig, its lines, the service, and who commands it.
pub(crate) struct Bench {
    pub(crate) mock: Process,
    daemon: Option<Process>,
    pub(crate) stage: StageLine,
    sensor_tap: Tap,
    sent: Arc<Mutex<Sent>>,
    pub(crate) folder: TempDir,
    pub(crate) endpoint: String,
    commander: Option<(Arc<Client>, HeldLease)>,
    options: Options,
    pub(crate) runtime: Runtime,
}

impl Default for Options {
    fn default() -> Self {
        Self { rig: small_rig(), recordings: None, has_sensor: true, start: Process::start, one_core: false }
    }
}

impl Bench {
    /// Starts the devices and the service, and waits until that can be commanded and, if there is a sensor, frames flow.
    pub(crate) fn start(options: Options) -> Self {
        let folder = TempDir::new().unwrap();
        let sensor = if options.has_sensor { "tap/sensor" } else { "tap/none" };
        let rig = options.rig.replace("\"mock/sensor\"", &format!("\"{sensor}\""));
        fs::write(folder.path().join("rig.toml"), rig.replace("\"mock/stage\"", "\"tap/stage\"")).unwrap();
        let endpoint = free_endpoint();
        let recordings = options.recordings.clone().unwrap_or_else(|| "runs".into());
        let config = format!(
            "rig = \"rig.toml\"\nrecordings = \"{}\"\n[bus]\nlisten = [\"{endpoint}\"]\n",
            recordings.display()
        );
        fs::write(folder.path().join("tactusd.toml"), config).unwrap();
        let args = ["rig", "--config", "rig.toml", "--link-dir", "mock"];
        let mut mock = Process::start("tactus-mock", folder.path(), &args);
        mock.wait_for("stage");
        let (stage, (sensor_tap, sent)) = (StageLine::tap(folder.path()), tap_sensor(folder.path()));
        let runtime = Runtime::new().unwrap();
        let mut bench = Self {
            mock,
            daemon: None,
            stage,
            sensor_tap,
            sent,
            folder,
            endpoint,
            commander: None,
            options,
            runtime,
        };
        bench.pin(&bench.mock);
        bench.restart();
        bench
    }

    /// Starts the service, whose last process must have ended.
    pub(crate) fn restart(&mut self) {
        self.start_service();
        self.connect();
    }

    /// As [`Self::restart`], but returns as soon as the service knows its stage.
    pub(crate) fn start_service(&mut self) {
        assert!(self.daemon.is_none(), "a service is running");
        self.stage.tap.hang_up().unwrap();
        self.sensor_tap.hang_up().unwrap();
        self.stage.forget();
        let args = ["--config", "tactusd.toml"];
        let daemon = (self.options.start)("tactusd", self.folder.path(), &args);
        // Most boards restart when their port is opened, and the service need not wait for a banner that does not come.
        self.mock.type_line("stage reset");
        self.pin(&daemon);
        self.daemon = Some(daemon);
        self.stage.until("a report", |_, seen| matches!(seen, Seen::Report { .. }).then_some(()));
    }

    /// The service's process.
    pub(crate) fn daemon(&mut self) -> &mut Process {
        self.daemon.as_mut().expect("a running service")
    }

    /// The service's process, to be ended.
    pub(crate) fn take_daemon(&mut self) -> Process {
        self.commander = None;
        self.daemon.take().expect("a running service")
    }

    /// Ends the service, if it runs.
    pub(crate) fn end(&mut self) {
        self.commander = None;
        self.daemon = None;
    }

    /// Connects to the service and takes the lease.
    fn connect(&mut self) {
        let endpoint = Endpoint::from_str(&self.endpoint).unwrap();
        let deadline = Instant::now() + DEADLINE;
        loop {
            let held = within(&self.runtime, async {
                let client = Client::connect(&endpoint, Some(RIG)).await.ok()?;
                match client.hold("trials", Some("the next trial")).await.ok()? {
                    Hold::Held(held) => Some((Arc::new(client), held)),
                    Hold::Refused(_) => None,
                }
            });
            if held.is_some() {
                self.commander = held;
                break;
            }
            assert!(Instant::now() < deadline, "nobody can command the service");
            self.stage.pass(AGAIN);
        }
        // A report may pass before the driver has compared the controller's settings.
        self.until("the stage is known", |reply| {
            reply.health.as_ref().is_some_and(|health| health.stage_connected)
        });
        if self.options.has_sensor {
            self.until("frames flow", |reply| reply.health.as_ref().is_some_and(|health| health.frames > 1));
        }
    }

    /// Sends a command; the answer comes later, unless the service dies.
    pub(crate) fn send(&self, command: Command) -> JoinHandle<Result<pb::CommandReply, BusError>> {
        let (client, held) = self.commander.as_ref().expect("who commands");
        let request = pb::CommandRequest { who: "trials".into(), lease: held.secret(), ..Default::default() };
        let client = Arc::clone(client);
        self.runtime.spawn(async move { client.command(command, &request, DEADLINE).await })
    }

    /// Sends a command, and waits for the answer.
    pub(crate) fn command(&self, command: Command) -> pb::CommandReply {
        within(&self.runtime, self.send(command)).unwrap().unwrap()
    }

    /// Clears the fault and homes, as a person does: on a busy machine not always at once.
    pub(crate) fn reset(&self) {
        let mut said = Vec::new();
        for _ in 0..TRIES_MAX {
            let reply = self.command(Command::Reset);
            if reply.ok {
                return;
            }
            said.push(reply.error);
        }
        panic!("{said:#?}");
    }

    /// Starts a run; returns its recording.
    pub(crate) fn run(&self, script: &str) -> PathBuf {
        let reply = self.try_run(script);
        assert!(reply.ok, "{}", reply.error);
        PathBuf::from(reply.state.unwrap().recording)
    }

    /// Starts a run, and waits until the controller stands idle, deeper than this. A run that ends before is begun again: a
    /// machine without time for the frames makes the supervisor stop it.
    pub(crate) fn run_until_below(&self, script: &str, limit_mm: f64) {
        for _ in 0..TRIES_MAX {
            if !self.try_run(script).ok {
                // A rule that such a machine broke on the way up of the run before.
                self.reset();
                continue;
            }
            let idle_below = |_, seen: &Seen| match seen {
                Seen::Report { state, z_mm } => (state == "Idle" && *z_mm < limit_mm).then_some(()),
                Seen::Stop | Seen::Home => None,
            };
            if self.stage.unless(|| self.is_finished(), idle_below).is_some() {
                return;
            }
            self.reset();
        }
        panic!("no run came below {limit_mm} mm");
    }

    /// True if the last run has ended.
    pub(crate) fn is_finished(&self) -> bool {
        let state = self.command(Command::Status).state;
        state.is_some_and(|state| state.phase() == pb::RunPhase::Finished)
    }

    /// Starts a run, if the service lets it.
    pub(crate) fn try_run(&self, script: &str) -> pb::CommandReply {
        let (client, held) = self.commander.as_ref().expect("who commands");
        let request = pb::RunRequest {
            experiment: "trial".into(),
            script: script.into(),
            parameters_json: "{}".into(),
            seed: None,
            who: "trials".into(),
            lease: held.secret(),
            continue_run: String::new(),
        };
        within(&self.runtime, client.command(Command::Run, &request, DEADLINE)).unwrap()
    }

    /// Follows what the service publishes of one kind.
    pub(crate) fn subscribe<M: Published>(&self) -> Subscription<M> {
        let (client, _) = self.commander.as_ref().expect("who commands");
        within(&self.runtime, client.subscribe(History::None)).unwrap()
    }

    /// Asks for the status until `is_it`.
    pub(crate) fn until(&self, what: &str, is_it: impl Fn(&pb::CommandReply) -> bool) -> pb::CommandReply {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let reply = self.command(Command::Status);
            if is_it(&reply) {
                return reply;
            }
            assert!(Instant::now() < deadline, "never: {what}; at last {reply:?}");
            self.stage.pass(AGAIN);
        }
    }

    /// Waits until the run has ended and the stage stands idle.
    pub(crate) fn until_finished(&self) {
        self.until("the run has ended", |reply| {
            let phase = reply.state.as_ref().map(pb::RunState::phase);
            let stage = reply.stage.as_ref().map(pb::StageState::status);
            phase == Some(pb::RunPhase::Finished) && stage == Some(pb::StageStatus::Idle)
        });
    }

    /// What is true of the virtual rig now.
    pub(crate) fn truth(&mut self) -> Value {
        self.mock.type_line("truth");
        let line = self.mock.wait_until(|line| line.starts_with('{'));
        serde_json::from_str(&line).unwrap()
    }

    /// The true rig, once nothing moves any more.
    pub(crate) fn truth_at_rest(&mut self) -> Value {
        loop {
            let truth = self.truth();
            if truth["moving"] == false {
                return truth;
            }
            self.stage.pass(AGAIN);
        }
    }

    /// What the sensor has sent so far.
    pub(crate) fn sent(&self) -> Sent {
        *self.sent.lock().unwrap()
    }

    /// Puts a process on the first core, if all of them are to be there.
    pub(crate) fn pin(&self, process: &Process) {
        if self.options.one_core {
            let pid = process.id().to_string();
            let done =
                Program::new("taskset").args(["--all-tasks", "--cpu-list", "--pid", "0", &pid]).output();
            assert!(done.unwrap().status.success());
        }
    }

    /// A program of ours with its arguments, on the first core if all of them are to be there.
    pub(crate) fn program(&self, name: &str) -> Program {
        let path = tactus_e2e::binary(name);
        if !self.options.one_core {
            return Program::new(path);
        }
        let mut program = Program::new("taskset");
        program.args(["--cpu-list", "0"]).arg(path);
        program
    }
}

impl StageLine {
    fn tap(folder: &Path) -> Self {
        let (told, seen) = mpsc::channel();
        let (mut commands, mut answers) = (Lines::default(), Lines::default());
        let tap = Tap::open(&folder.join("mock/stage"), &folder.join("tap/stage"), move |way, at, bytes| {
            // Nobody may look any more.
            let tell = |seen| drop(told.send((at, seen)));
            match way {
                Way::ToDevice => {
                    // `!` and Ctrl-X are read out of turn.
                    if bytes.iter().any(|byte| matches!(byte, b'!' | 0x18)) {
                        tell(Seen::Stop);
                    }
                    commands.push(bytes, |line| {
                        if line.ends_with("$H") {
                            tell(Seen::Home);
                        }
                    });
                }
                Way::ToService => answers.push(bytes, |line| {
                    if let Some(report) = report(line) {
                        tell(report);
                    }
                }),
            }
        });
        Self { tap: tap.unwrap(), seen }
    }

    /// Waits for something on the line.
    pub(crate) fn until<T>(&self, what: &str, pick: impl FnMut(Instant, &Seen) -> Option<T>) -> T {
        self.unless(|| false, pick).unwrap_or_else(|| panic!("never on the line: {what}"))
    }

    /// As [`Self::until`]; `None` if it `is_over`, which is asked once a second, or if only a hang takes so long.
    pub(crate) fn unless<T>(
        &self,
        is_over: impl Fn() -> bool,
        mut pick: impl FnMut(Instant, &Seen) -> Option<T>,
    ) -> Option<T> {
        let deadline = Instant::now() + DEADLINE;
        while Instant::now() < deadline {
            let look = Instant::now() + Duration::from_secs(1);
            while let Ok((at, seen)) = self.seen.recv_timeout(look.saturating_duration_since(Instant::now()))
            {
                let picked = pick(at, &seen);
                if picked.is_some() {
                    return picked;
                }
            }
            if is_over() {
                return None;
            }
        }
        None
    }

    /// Looks at the line for so long.
    pub(crate) fn pass(&self, time: Duration) {
        self.watch(Instant::now() + time, |_, _| {});
    }

    /// Looks at the line until then.
    pub(crate) fn watch(&self, until: Instant, mut see: impl FnMut(Instant, &Seen)) {
        while let Ok((at, seen)) = self.seen.recv_timeout(until.saturating_duration_since(Instant::now())) {
            see(at, &seen);
        }
    }

    /// Forgets what has passed.
    pub(crate) fn forget(&self) {
        while self.seen.try_recv().is_ok() {}
    }
}

/// A controller's report, `<Idle|MPos:1.000,2.000,-0.300|...>`.
fn report(line: &str) -> Option<Seen> {
    let (state, rest) = line.strip_prefix('<')?.split_once('|')?;
    let position = rest.split_once("Pos:")?.1;
    let z_mm = position.split(['|', '>']).next()?.split(',').nth(2)?.parse().ok()?;
    Some(Seen::Report { state: state.split(':').next().unwrap_or(state).to_owned(), z_mm })
}

fn tap_sensor(folder: &Path) -> (Tap, Arc<Mutex<Sent>>) {
    let sent = Arc::new(Mutex::new(Sent::default()));
    let (counted, mut packets) = (Arc::clone(&sent), Packets::default());
    let (device, link) = (folder.join("mock/sensor"), folder.join("tap/sensor"));
    let tap = Tap::open(&device, &link, move |way, _, bytes| {
        if way == Way::ToService {
            packets.push(bytes, |time_ms| {
                let mut sent = counted.lock().unwrap();
                *sent = Sent { frames: sent.frames + 1, last_ms: time_ms };
            });
        }
    });
    (tap.unwrap(), sent)
}

/// Cuts bytes into lines.
#[derive(Default)]
struct Lines(Vec<u8>);

impl Lines {
    fn push(&mut self, bytes: &[u8], mut line: impl FnMut(&str)) {
        for byte in bytes {
            if matches!(byte, b'\n' | b'\r') {
                line(&String::from_utf8_lossy(&std::mem::take(&mut self.0)));
            } else {
                self.0.push(*byte);
            }
        }
    }
}

/// Cuts bytes into packets: AA AA AA, a kind, the length of the content, the content, two bytes of checksum unless it is empty.
#[derive(Default)]
struct Packets(Vec<u8>);

impl Packets {
    /// Calls `frame` with the time of each frame, in ms.
    fn push(&mut self, bytes: &[u8], mut frame: impl FnMut(u32)) {
        self.0.extend(bytes);
        loop {
            let begin = self.0.iter().position(|byte| *byte == 0xAA).unwrap_or(self.0.len());
            self.0.drain(..begin);
            if self.0.len() >= 3 && self.0[..3] != [0xAA; 3] {
                self.0.drain(..1);
                continue;
            }
            let [0xAA, 0xAA, 0xAA, kind, low, high, ..] = self.0[..] else { return };
            let length = usize::from(u16::from_le_bytes([low, high]));
            let end = 6 + length + if length > 0 { 2 } else { 0 };
            if self.0.len() < end {
                return;
            }
            if kind == 0
                && let Some(time) = self.0[6..end].first_chunk()
            {
                frame(u32::from_le_bytes(*time));
            }
            self.0.drain(..end);
        }
    }
}
