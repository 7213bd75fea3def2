//! From the act of stopping to the stop byte on the stage's line, at each surface and under each fault.
//!
//! `TACTUS_TRIALS=200` says how many trials each row has, and makes a row beyond 100 ms a failure; `just stop-trials` does so.
//! Without it there is one trial of each surface under the first three conditions, and no time limit. `TACTUS_ROWS=contact`
//! plays the rows with that text only. `TACTUS_HANG_S=60` says how long a disk that hangs has done so when the stop comes, as
//! `just hung-disk` does; without it, it is up to 0.72 s.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::process::Stdio;
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use tactus_bus::BusError;
use tactus_e2e::{Process, changed, free_endpoint, raw_session, small_rig, within};
use tactus_schema::key::Command;
use tactus_schema::pb;
use tokio::task::JoinHandle;

use crate::bench::{Bench, Options, Seen, number, trials};
use crate::disk::Disk;

/// A run takes its own first zero; another tare would only take time.
const HOLD: &str = "def run(rig):\n    press(0.9, 0.9, depths_mm = [0.1], dwell_s = 60.0)\n";

/// Beyond this a row has failed.
const LIMIT: Duration = Duration::from_millis(100);

/// Half-open connections to the service, and as many to the dashboard.
const CONNECTIONS: usize = 1000;

/// Where a person or a program stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Surface {
    /// `tactus stop`.
    Cli,
    /// The key of all rigs on the bus, from a connected client.
    Bus,
    /// A datagram beside the endpoint.
    Datagram,
    /// `POST /stop` at the dashboard.
    Dashboard,
    Signal(Signal),
}

/// In which state of the rig or the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Condition {
    /// The tip holds 0.1 mm in the covering. So it does in all conditions but the next two.
    Contact,
    /// The sensor does not exist, so the service is not ready.
    NoSensor,
    /// The stage homes.
    Homing,
    /// The service's standard error is a full pipe that nobody reads.
    Unread,
    /// 1,000 connections that ask nothing, to the service and to the dashboard.
    Connections,
    /// A client that answers all commands, and says that it is alive.
    Rogue,
    /// All programs have one core together.
    OneCore,
    /// The file system of the recordings does not answer.
    HungDisk,
}

const SURFACES: [Surface; 7] = [
    Surface::Cli,
    Surface::Bus,
    Surface::Datagram,
    Surface::Dashboard,
    Surface::Signal(Signal::INT),
    Surface::Signal(Signal::TERM),
    Surface::Signal(Signal::HUP),
];

const CONDITIONS: [Condition; 8] = [
    Condition::Contact,
    Condition::NoSensor,
    Condition::Homing,
    Condition::Unread,
    Condition::Connections,
    Condition::Rogue,
    Condition::OneCore,
    Condition::HungDisk,
];

impl Surface {
    fn word(self) -> &'static str {
        match self {
            Self::Cli => "tactus stop",
            Self::Bus => "bus",
            Self::Datagram => "datagram",
            Self::Dashboard => "dashboard",
            Self::Signal(Signal::INT) => "SIGINT",
            Self::Signal(Signal::TERM) => "SIGTERM",
            Self::Signal(_) => "SIGHUP",
        }
    }
}

impl Condition {
    fn words(self) -> &'static str {
        match self {
            Self::Contact => "in contact",
            Self::NoSensor => "no sensor",
            Self::Homing => "in homing",
            Self::Unread => "standard error unread",
            Self::Connections => "1,000 connections",
            Self::Rogue => "rogue client",
            Self::OneCore => "one core",
            Self::HungDisk => "disk hangs",
        }
    }
}

#[test]
fn a_stop_reaches_the_stage_from_every_surface_and_under_every_fault() {
    let (count, conditions) = match trials() {
        Some(count) => (count, &CONDITIONS[..]),
        None => (1, &CONDITIONS[..3]),
    };
    let rows = std::env::var("TACTUS_ROWS").unwrap_or_default();
    let is_wanted = |condition: Condition, surface: Surface| {
        format!("{} {}", condition.words(), surface.word()).contains(&rows)
    };
    println!("{:<22}{:<28}{:>7}{:>12}{:>13}", "condition", "surface", "trials", "median ms", "greatest ms");
    let mut late = Vec::new();
    for condition in conditions.iter().copied() {
        let surfaces: Vec<_> =
            SURFACES.into_iter().filter(|surface| is_wanted(condition, *surface)).collect();
        if surfaces.is_empty() {
            continue;
        }
        let mut scene = match Scene::set(condition) {
            Ok(scene) => scene,
            Err(why) => {
                println!("{:<22}not measured: {why}", condition.words());
                continue;
            }
        };
        for surface in surfaces {
            let (mut from_act, mut from_datagram) = (Vec::new(), Vec::new());
            for nth in 0..count {
                scene.prepare(nth);
                let (whole, own) = scene.stop(surface);
                from_act.push(whole);
                from_datagram.extend(own);
                scene.settle(surface);
            }
            let mut row = |name: &str, mut times: Vec<Duration>| {
                times.sort();
                let [median, greatest] =
                    [times[times.len() / 2], times[times.len() - 1]].map(|time| time.as_secs_f64() * 1e3);
                println!(
                    "{:<22}{name:<28}{:>7}{median:>12.1}{greatest:>13.1}",
                    condition.words(),
                    times.len()
                );
                if times[times.len() - 1] > LIMIT {
                    late.push(format!("{}, {name}: {greatest:.1} ms", condition.words()));
                }
            };
            if surface == Surface::Cli {
                row("tactus stop, its start", from_act);
                row("tactus stop, its datagram", from_datagram);
            } else {
                row(surface.word(), from_act);
            }
        }
    }
    // Elsewhere than on a quiet machine no time is promised.
    assert!(trials().is_none() || late.is_empty(), "later than {LIMIT:?}: {late:#?}");
}

/// The bench's rig with short and quick ways: eleven thousand trials take their time.
fn quick_rig() -> String {
    let changes = [
        ("safe_height_mm = 2.0", "safe_height_mm = 0.6"),
        ("rate_hz = 10.0", "rate_hz = 30.0"),
        ("z_max_mm = 4.0", "z_max_mm = 2.0"),
        ("[-6.0, 4.0]", "[-6.0, 2.0]"),
        ("travel_speed_mm_per_s = 20.0", "travel_speed_mm_per_s = 50.0"),
        ("load_speed_mm_per_s = 1.0", "load_speed_mm_per_s = 5.0"),
    ];
    changed(small_rig(), &changes)
}

/// A bench in one of the conditions, and who can stop it.
struct Scene {
    condition: Condition,
    bench: Bench,
    dashboard: Dashboard,
    relay: Relay,
    session: zenoh::Session,
    /// A client that claims to be the service; it does so as long as it lives.
    rogue: Option<zenoh::Session>,
    idle: [Vec<TcpStream>; 2],
    disk: Option<Disk>,
    resetting: Option<JoinHandle<Result<pb::CommandReply, BusError>>>,
}

impl Scene {
    /// An error if this machine cannot have the condition.
    fn set(condition: Condition) -> Result<Self, String> {
        let disk = (condition == Condition::HungDisk).then(Disk::mount).transpose()?;
        let bench = Bench::start(Options {
            recordings: disk.as_ref().map(|disk| disk.path.clone()),
            has_sensor: condition != Condition::NoSensor,
            start: if condition == Condition::Unread { Process::start_unread } else { Process::start },
            one_core: condition == Condition::OneCore,
            rig: quick_rig(),
        });
        let dashboard = Dashboard::start(&bench, condition != Condition::NoSensor);
        let relay = Relay::to(&bench.endpoint);
        let session = within(&bench.runtime, raw_session(&bench.endpoint));
        let rogue = (condition == Condition::Rogue).then(|| {
            within(&bench.runtime, async {
                let rogue = raw_session(&bench.endpoint).await;
                for key in ["tactus/stop", "tactus/bench/cmd/stop", "tactus/**"] {
                    rogue.declare_queryable(key).callback(drop).background().await.unwrap();
                }
                for key in ["tactus/x/alive", "tactus/bench/alive"] {
                    std::mem::forget(rogue.liveliness().declare_token(key).await.unwrap());
                }
                rogue
            })
        });
        let mut scene = Self {
            condition,
            bench,
            dashboard,
            relay,
            session,
            rogue,
            idle: [Vec::new(), Vec::new()],
            disk,
            resetting: None,
        };
        scene.make_ready();
        Ok(scene)
    }

    /// After each start of the service.
    fn make_ready(&mut self) {
        if !matches!(self.condition, Condition::NoSensor | Condition::Homing) {
            self.bench.reset();
        }
    }

    /// Brings the rig into the state in which it is stopped.
    fn prepare(&mut self, nth: usize) {
        match self.condition {
            Condition::NoSensor => {}
            Condition::Homing => {
                self.resetting = Some(self.bench.send(Command::Reset));
                self.bench.stage.until("homing", |_, seen| matches!(seen, Seen::Home).then_some(()));
                self.bench.stage.pass(Duration::from_millis(nth as u64 % 10 * 10));
            }
            Condition::Contact
            | Condition::Unread
            | Condition::Connections
            | Condition::Rogue
            | Condition::OneCore
            | Condition::HungDisk => {
                self.bench.run_until_below(HOLD, -0.09);
            }
        }
        if self.condition == Condition::Connections {
            let service = self.bench.endpoint.trim_start_matches("tcp/").to_owned();
            let [of_service, of_dashboard] = &mut self.idle;
            fill(of_service, &service, b"");
            fill(of_dashboard, &self.dashboard.address, b"POST /stop HTTP/1.1\r\nHost: ");
        }
        if let Some(disk) = &mut self.disk {
            disk.hang();
            // A run fails when its disk has been silent for a second: then the stop finds the tip up.
            let hung = number("TACTUS_HANG_S").map(Duration::from_secs_f64);
            self.bench.stage.pass(hung.unwrap_or(Duration::from_millis(nth as u64 % 10 * 80)));
        }
        self.bench.stage.forget();
    }

    /// Stops; how long it took from the act, and for the command line also from its datagram.
    fn stop(&mut self, surface: Surface) -> (Duration, Option<Duration>) {
        let mut cli = self.bench.program("tactus");
        cli.args(["--endpoint", &self.relay.endpoint, "stop", "--reason", "trial"]);
        cli.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut started = None;
        let act = Instant::now();
        match surface {
            Surface::Cli => started = Some(cli.spawn().unwrap()),
            Surface::Bus => {
                let replies = self.session.get("tactus/stop").payload(Vec::new()).express(true);
                // The answer is not waited for.
                drop(within(&self.bench.runtime, async { replies.await }).unwrap());
            }
            Surface::Datagram => {
                let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
                let service = self.bench.endpoint.trim_start_matches("tcp/");
                socket.send_to(b"tactus stop \n", service).unwrap();
            }
            Surface::Dashboard => self.dashboard.stop(),
            Surface::Signal(signal) => self.bench.daemon().signal(signal),
        }
        let stopped = self
            .bench
            .stage
            .until("a stop byte", |at, seen| (matches!(seen, Seen::Stop) && at >= act).then_some(at));
        if let Some(disk) = &mut self.disk {
            disk.go_on();
        }
        let sent = started.map(|mut cli| {
            assert!(cli.wait().unwrap().success(), "`tactus stop` failed");
            self.relay.sent.try_iter().find(|at| *at >= act).expect("the datagram of `tactus stop`")
        });
        (stopped - act, sent.map(|sent| stopped.saturating_duration_since(sent)))
    }

    /// Waits until the next trial can begin.
    fn settle(&mut self, surface: Surface) {
        if matches!(surface, Surface::Signal(_)) {
            let (code, said) = self.bench.take_daemon().wait();
            assert_eq!(code, Some(0), "{said}");
            self.resetting = None;
            self.bench.restart();
            self.session = within(&self.bench.runtime, raw_session(&self.bench.endpoint));
            self.make_ready();
            return;
        }
        match (self.resetting.take(), self.condition) {
            (Some(reset), _) => {
                let reply = within(&self.bench.runtime, reset).unwrap().unwrap();
                assert!(!reply.ok, "homing was stopped");
            }
            // The first report may be older than the controller's restart.
            (None, Condition::NoSensor) => {
                for _ in 0..2 {
                    self.bench
                        .stage
                        .until("a report", |_, seen| matches!(seen, Seen::Report { .. }).then_some(()));
                }
            }
            (None, _) => self.bench.until_finished(),
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // Before its folder of recordings is unmounted.
        self.bench.end();
        let sessions = [Some(self.session.clone()), self.rogue.take()];
        for session in sessions.into_iter().flatten() {
            drop(within(&self.bench.runtime, async { session.close().await }));
        }
    }
}

/// Opens connections that ask nothing, as many as are wanted and still missing.
fn fill(idle: &mut Vec<TcpStream>, address: &str, beginning: &[u8]) {
    idle.retain(|socket| {
        socket.set_nonblocking(true).unwrap();
        socket.peek(&mut [0]).is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock)
    });
    for _ in idle.len()..CONNECTIONS {
        // The service may have no room: then that is the condition.
        let Ok(mut socket) =
            TcpStream::connect_timeout(&address.parse().unwrap(), Duration::from_millis(100))
        else {
            return;
        };
        if socket.write_all(beginning).is_ok() {
            idle.push(socket);
        }
    }
}

/// The dashboard's process.
struct Dashboard {
    _process: Process,
    address: String,
}

impl Dashboard {
    fn start(bench: &Bench, is_ready: bool) -> Self {
        let args = ["--endpoint", &bench.endpoint, "--listen", "127.0.0.1:0"];
        let mut process = Process::start("tactus-web", bench.folder.path(), &args);
        bench.pin(&process);
        let line = process.wait_for("http://");
        let address = line.split("http://").nth(1).and_then(|rest| rest.split('/').next()).unwrap();
        let address = address.to_owned();
        if is_ready {
            process.wait_for("connected");
        }
        Self { _process: process, address }
    }

    fn stop(&self) {
        let mut socket = TcpStream::connect(&self.address).unwrap();
        let request = format!("POST /stop HTTP/1.0\r\nHost: {}\r\nContent-Length: 0\r\n\r\n", self.address);
        socket.write_all(request.as_bytes()).unwrap();
        // It answers when the service has.
        thread::spawn(move || socket.read_to_end(&mut Vec::new()));
    }
}

/// Stands between `tactus stop` and the service, and says when the datagram was sent. Its threads end with the test.
struct Relay {
    endpoint: String,
    sent: Receiver<Instant>,
}

impl Relay {
    fn to(endpoint: &str) -> Self {
        let service = endpoint.trim_start_matches("tcp/").to_owned();
        let own = free_endpoint();
        let address = own.trim_start_matches("tcp/").to_owned();
        let (told, sent) = mpsc::channel();
        let (client_side, service_side) =
            (UdpSocket::bind(&address).unwrap(), UdpSocket::bind("127.0.0.1:0").unwrap());
        service_side.connect(&service).unwrap();
        let (answers, back) = (service_side.try_clone().unwrap(), client_side.try_clone().unwrap());
        let (to_client, clients) = mpsc::channel();
        thread::spawn(move || {
            let mut bytes = vec![0; 65536];
            while let Ok((count, client)) = client_side.recv_from(&mut bytes) {
                if told.send(Instant::now()).is_err() || to_client.send(client).is_err() {
                    return;
                }
                // Nobody listens while the service restarts.
                drop(service_side.send(&bytes[..count]));
            }
        });
        thread::spawn(move || {
            let mut bytes = vec![0; 65536];
            let mut client = None;
            loop {
                let received = answers.recv(&mut bytes);
                client = clients.try_iter().last().or(client);
                if let (Ok(count), Some(client)) = (received, client) {
                    drop(back.send_to(&bytes[..count], client));
                }
            }
        });
        let listener = TcpListener::bind(&address).unwrap();
        thread::spawn(move || {
            for socket in listener.incoming().map_while(Result::ok) {
                let Ok(there) = TcpStream::connect(&service) else { continue };
                let (mut from, mut to) = (socket.try_clone().unwrap(), there.try_clone().unwrap());
                thread::spawn(move || std::io::copy(&mut from, &mut to));
                let (mut from, mut to) = (there, socket);
                thread::spawn(move || std::io::copy(&mut from, &mut to));
            }
        });
        Self { endpoint: own, sent }
    }
}
