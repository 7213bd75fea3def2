//! How many rigs one service carries: memory of a rig, processor time of a frame, and whether any frame is lost between the
//! device, a subscriber and the recordings.
//!
//! The devices are virtual ones of this process, each behind a socket of its own on loopback, so that the service under test is
//! the real program with its real drivers. Each rig has its sensor and its stage.

mod collector;
mod devices;
mod sent;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Program, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use prost::Message as _;
use rustix::process::{Pid, Signal, kill_process};
use tactus_bus::{BusError, Client, Credentials, Endpoint, HeldLease, Hold, Lab};
use tactus_record::{Entry, Message};
use tactus_runner::config::RigFiles;
use tactus_runner::embedded::{Truth, simulated_rig};
use tactus_runner::open_files;
use tactus_schema::key::Command;
use tactus_schema::pb;
use tactus_virtual::start_devices;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio::time::{Instant as TokioInstant, sleep, timeout};
use zenoh::Session;

use collector::Collector;
pub use collector::CollectorMeasured;
pub use devices::Devices;
use sent::SentTimes;

/// Rate of every sensor.
const RATE_HZ: f64 = 30.0;
/// Only a hang takes this long.
const PATIENCE: Duration = Duration::from_mins(5);
/// Time until a lease is asked for again.
const AGAIN: Duration = Duration::from_secs(1);
/// Runs that are started at the same time: most of it is the homing of the stage.
const STARTING_MAX: usize = 8;
/// A run waits for this long for each rig that starts after its own. Its dry run computes every frame of it, and so must not be much longer.
const START_S: f64 = 0.5;

/// What is measured.
#[derive(Debug, Clone)]
pub struct RigsTrial {
    /// The program `tactusd`.
    pub daemon: PathBuf,
    /// Number of rigs.
    pub rigs: usize,
    /// Length of the measurement.
    pub time: Duration,
    /// Every rig has a run in progress, and so a recording.
    pub is_recording: bool,
    /// The devices of so many rigs die in the middle. What is counted is the others'.
    pub dying: usize,
    /// Frames that the service keeps of each rig; its own choice without.
    pub frames_kept: Option<usize>,
    /// The program `tactus`, which collects all rigs beside the subscriber.
    pub collector: Option<PathBuf>,
    /// Processors of the service, as `taskset` writes them; all of them without.
    pub cores: Option<String>,
}

/// What one service of so many rigs did and took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigsMeasured {
    /// Number of rigs.
    pub rigs: usize,
    /// Those of them whose devices lived all the time. The frames are theirs.
    pub whole_rigs: usize,
    /// Frames a second that reached the subscriber.
    pub frames_per_s: f64,
    /// Sequence numbers that the subscriber did not see, from the first to the last of each rig.
    pub missed: u64,
    /// Frames that the recordings lack in the same way; `None` without recordings.
    pub unrecorded: Option<u64>,
    /// Processor time of the service for a frame, in microseconds.
    pub frame_us: f64,
    /// Share of one processor that the service took.
    pub cores: f64,
    /// Memory of the service that is its own (`RssAnon`), in KiB.
    pub memory_kib: u64,
    /// Threads of the service.
    pub threads: u64,
    /// From the call that sends a frame to the subscriber's callback, in ms: half of the frames, 99 % and 99.9 % take no longer.
    pub latency_ms: [f64; 3],
    /// What the collector took, if there was one.
    pub collector: Option<CollectorMeasured>,
}

/// Quantiles of the latency.
const QUANTILES: [f64; 3] = [0.5, 0.99, 0.999];

/// The sequence numbers that came from one rig.
#[derive(Debug, Clone, Copy)]
struct Seen {
    first: u64,
    last: u64,
    count: u64,
}

impl Seen {
    /// How many frames from the first to the last are not among so many that are there.
    fn lacks(self, there: u64) -> u64 {
        (self.last + 1 - self.first).saturating_sub(there)
    }
}

/// What the subscriber has heard.
#[derive(Debug, Clone, Default)]
struct Heard {
    of_rigs: HashMap<String, Seen>,
    /// How long each frame was under way.
    took: Vec<Duration>,
}

/// What the subscriber reads of a [`pb::Frame`].
#[derive(Clone, PartialEq, prost::Message)]
struct Numbered {
    #[prost(uint64, tag = "1")]
    seq: u64,
    #[prost(uint64, tag = "3")]
    device_tick_ms: u64,
}

/// The service under test; it ends with this.
struct Service {
    child: Child,
    endpoint: Endpoint,
    /// Rig files, configuration, recordings and log.
    folder: tempfile::TempDir,
}

/// Serves a sensor and a stage of each rig.
///
/// # Errors
/// If the system provides no sockets, or no thread.
pub fn serve_devices(rigs: usize) -> Result<Devices> {
    open_files::allow_all();
    let RigFiles { rig, codec, .. } = simulated_rig()?;
    let truth = |number| Truth::of_rig(&rig, number);
    let stage = |number| start_devices(truth(number), rig.covering, &codec, TokioInstant::now()).stage;
    Devices::start((0..rigs as u64).map(stage).collect())
}

impl RigsTrial {
    /// Starts devices and service, measures, and ends both.
    ///
    /// # Errors
    /// If the service does not start, or a rig does not get ready.
    pub fn measure(&self) -> Result<RigsMeasured> {
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
        let measured = runtime.block_on(self.run());
        runtime.shutdown_background();
        measured
    }

    async fn run(&self) -> Result<RigsMeasured> {
        let folder = tempfile::tempdir()?;
        let names: Vec<_> = (0..self.rigs).map(|number| format!("r{number:05}")).collect();
        let RigFiles { texts, .. } = simulated_rig()?;
        fs::create_dir(folder.path().join("rigs"))?;
        let devices = serve_devices(self.rigs)?;
        for (name, [sensor, stage]) in names.iter().zip(&devices.addresses) {
            let text = texts.rig_toml.replace("name = \"sim\"", &format!("name = \"{name}\""));
            let text = at(&at(&text, sensor), stage);
            fs::write(folder.path().join("rigs").join(format!("{name}.toml")), text)?;
        }
        let mut service = self.start(folder)?;
        all_ready(&names, &mut service).await?;
        if self.is_recording {
            start_runs(&service.endpoint, &names, &self.script()).await?;
        }
        let (heard, is_counting) = (Arc::<Mutex<Heard>>::default(), Arc::new(AtomicBool::new(false)));
        let session = session(&service.endpoint).await?;
        let _subscriber = session
            .declare_subscriber("tactus/*/sensor/frame$*")
            .callback({
                let (heard, is_counting) = (Arc::clone(&heard), Arc::clone(&is_counting));
                let sent = Arc::clone(&devices.sent);
                move |sample| {
                    if is_counting.load(Ordering::Relaxed) {
                        count(&heard, &sent, sample.key_expr().as_str(), &sample.payload().to_bytes());
                    }
                }
            })
            .await
            .map_err(|error| anyhow::anyhow!("{error}"))?;
        let mut collector = match &self.collector {
            Some(program) => Some(Collector::start(program, &service.endpoint, service.folder.path())?),
            None => None,
        };
        if let Some(collector) = &mut collector {
            collector.has_all(self.rigs).await?;
        }
        // Histories and caches fill up first.
        sleep(self.time / 2).await;
        let collected_before = collector.as_ref().map(Collector::before).transpose()?;
        let pid = service.child.id();
        let (began, before) = (Instant::now(), processor_s(pid)?);
        is_counting.store(true, Ordering::Relaxed);
        sleep(self.time / 2).await;
        devices.kill(self.dying);
        sleep(self.time / 2).await;
        is_counting.store(false, Ordering::Relaxed);
        let (seconds, spent_s) = (began.elapsed().as_secs_f64(), processor_s(pid)? - before);
        let (memory_kib, threads) = (status(pid, "RssAnon:")?, status(pid, "Threads:")?);
        let counted = heard.lock().unwrap_or_else(PoisonError::into_inner).of_rigs.clone();
        let frames: u64 = counted.values().map(|of| of.count).sum();
        let collector = collector.zip(collected_before);
        let collector = collector.map(|(collector, before)| collector.measured(&before, frames, self.rigs));
        let collector = collector.transpose()?;
        service.end()?;
        let Heard { of_rigs: mut seen, took } = heard.lock().unwrap_or_else(PoisonError::into_inner).clone();
        ensure!(seen.len() == self.rigs, "frames of {} of {} rigs came", seen.len(), self.rigs);
        seen.retain(|rig, _| !names.iter().take(self.dying).any(|dying| dying == rig));
        let frames: u64 = seen.values().map(|of| of.count).sum();
        let unrecorded = self.is_recording.then(|| unrecorded(service.folder.path(), &seen)).transpose()?;
        Ok(RigsMeasured {
            rigs: self.rigs,
            whole_rigs: seen.len(),
            frames_per_s: frames as f64 / seconds,
            missed: seen.values().map(|of| of.lacks(of.count)).sum(),
            unrecorded,
            frame_us: spent_s * 1e6 / frames as f64,
            cores: spent_s / seconds,
            memory_kib,
            threads,
            latency_ms: quantiles_ms(took),
            collector,
        })
    }

    /// The experiment of every run: it reads for as long as the measurement lasts.
    fn script(&self) -> String {
        let seconds = 60.0 + 2.0 * self.time.as_secs_f64() + START_S * self.rigs as f64;
        format!("def run(rig):\n    tare()\n    wait({seconds:.1})\n")
    }

    fn start(&self, folder: tempfile::TempDir) -> Result<Service> {
        let port = std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        let kept = self.frames_kept.map(|frames| format!("frames_kept = {frames}\n")).unwrap_or_default();
        let config = format!(
            "rigs = \"rigs\"\nrecordings = \"runs\"\n[bus]\nlisten = [\"{endpoint}\"]\n{kept}[log]\nfilter = \"error\"\n"
        );
        let path = folder.path().join("tactusd.toml");
        fs::write(&path, config)?;
        let mut program = match &self.cores {
            Some(cores) => {
                let mut pinned = Program::new("taskset");
                pinned.args(["--cpu-list", cores]).arg(&self.daemon);
                pinned
            }
            None => Program::new(&self.daemon),
        };
        let child = program
            .arg("--config")
            .arg(&path)
            .current_dir(folder.path())
            // As its unit does.
            .env("MALLOC_ARENA_MAX", "2")
            .stdin(Stdio::null())
            .stderr(fs::File::create(folder.path().join("log"))?)
            .spawn()
            .with_context(|| format!("{} does not start", self.daemon.display()))?;
        Ok(Service { child, endpoint: endpoint.parse()?, folder })
    }
}

impl RigsMeasured {
    /// True if no frame was lost and the rate was kept.
    pub fn is_whole(&self) -> bool {
        let wanted = RATE_HZ * self.whole_rigs as f64;
        self.missed == 0 && self.unrecorded.is_none_or(|lost| lost == 0) && self.frames_per_s > 0.98 * wanted
    }
}

impl Service {
    /// Asks it to end, and waits for that.
    fn end(&mut self) -> Result<()> {
        end(&self.child, Signal::TERM)?;
        self.child.wait()?;
        Ok(())
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended already.
        if self.child.kill().is_ok() {
            drop(self.child.wait());
        }
    }
}

/// Asks a process to end.
fn end(child: &Child, by: Signal) -> Result<()> {
    let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    Ok(kill_process(pid.context("a process id")?, by)?)
}

/// The rig file with its first embedded device at an address.
fn at(rig: &str, address: &str) -> String {
    rig.replacen("{ kind = \"embedded\" }", &format!("{{ kind = \"tcp\", address = \"{address}\" }}"), 1)
}

/// A plain client of the bus.
async fn session(endpoint: &Endpoint) -> Result<Session> {
    let mut config = zenoh::Config::default();
    for (name, value) in [
        ("mode", "\"client\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("connect/endpoints", format!("[\"{endpoint}\"]")),
        // The service may still start.
        ("connect/timeout_ms", "60000".to_owned()),
        ("connect/exit_on_failure", "false".to_owned()),
    ] {
        config.insert_json5(name, &value).map_err(|error| anyhow::anyhow!("{name}: {error}"))?;
    }
    zenoh::open(config).await.map_err(|error| anyhow::anyhow!("no service at {endpoint}: {error}"))
}

/// Waits until every rig has said that its frames flow. The session is one of its own: a session that knows all rigs' tokens
/// compares each frame's key with every one of them.
async fn all_ready(names: &[String], service: &mut Service) -> Result<()> {
    let session = session(&service.endpoint).await?;
    let tokens = session.liveliness().declare_subscriber("tactus/*/alive").history(true).await;
    let tokens = tokens.map_err(|error| anyhow::anyhow!("{error}"))?;
    let mut ready = std::collections::BTreeSet::new();
    while ready.len() < names.len() {
        let Ok(token) = timeout(PATIENCE, tokens.recv_async()).await else {
            let log = fs::read_to_string(service.folder.path().join("log")).unwrap_or_default();
            bail!(
                "{} of {} rigs are ready after {PATIENCE:?}; the service's log:\n{log}",
                ready.len(),
                names.len()
            );
        };
        ready.insert(token.map_err(|error| anyhow::anyhow!("{error}"))?.key_expr().to_string());
        ensure!(service.child.try_wait()?.is_none(), "the service has ended");
    }
    session.close().await.map_err(|error| anyhow::anyhow!("{error}"))
}

/// Starts a run on each rig.
async fn start_runs(endpoint: &Endpoint, names: &[String], script: &str) -> Result<()> {
    let lab = Arc::new(Lab::connect(endpoint, &Credentials::default()).await?);
    let (room, mut starting) = (Arc::new(Semaphore::new(STARTING_MAX)), JoinSet::new());
    for name in names {
        let (room, lab) = (Arc::clone(&room), Arc::clone(&lab));
        let (name, script) = (name.clone(), script.to_owned());
        starting.spawn(async move {
            let _place = room.acquire().await?;
            start_run(&lab.client(&name).await?, &script).await.with_context(|| format!("rig {name}"))
        });
    }
    while let Some(started) = starting.join_next().await {
        started??;
    }
    let lab = Arc::into_inner(lab).context("all runs are started")?;
    Ok(lab.close().await?)
}

/// Resets a rig and starts a run on it.
async fn start_run(client: &Client, script: &str) -> Result<()> {
    let held = held(client).await?;
    let (who, lease) = ("bench".to_owned(), held.secret());
    let request = pb::CommandRequest { who: who.clone(), lease: lease.clone(), ..Default::default() };
    let reply = client.command(Command::Reset, &request, PATIENCE).await?;
    ensure!(reply.ok, "{}", reply.error);
    let request = pb::RunRequest {
        experiment: "reads".into(),
        script: script.to_owned(),
        who,
        lease,
        ..Default::default()
    };
    let reply = client.command(Command::Run, &request, PATIENCE).await?;
    ensure!(reply.ok, "{}", reply.error);
    held.release().await?;
    Ok(())
}

/// The lease of a rig. A service that starts hundreds of runs may answer late, and then keeps the lease for nobody until it ends.
async fn held(client: &Client) -> Result<HeldLease> {
    let until = Instant::now() + PATIENCE;
    loop {
        match client.hold("bench", None).await {
            Ok(Hold::Held(held)) => return Ok(held),
            Ok(Hold::Refused(reply)) if until < Instant::now() => bail!(reply.error),
            Ok(Hold::Refused(_)) => sleep(AGAIN).await,
            Err(BusError::NoAnswer { .. }) if Instant::now() < until => {}
            Err(error) => return Err(error.into()),
        }
    }
}

/// Counts a frame that reached the subscriber.
fn count(heard: &Mutex<Heard>, sent: &SentTimes, key: &str, payload: &[u8]) {
    let (Some(rig), Ok(Numbered { seq, device_tick_ms })) =
        (key.split('/').nth(1), Numbered::decode(payload))
    else {
        return;
    };
    let sensor = rig.get(1..).and_then(|number| number.parse().ok());
    let took = sensor.and_then(|sensor| sent.since(sensor, device_tick_ms));
    let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
    heard.took.extend(took);
    if let Some(of) = heard.of_rigs.get_mut(rig) {
        of.last = seq;
        of.count += 1;
    } else {
        heard.of_rigs.insert(rig.to_owned(), Seen { first: seq, last: seq, count: 1 });
    }
}

fn quantiles_ms(mut took: Vec<Duration>) -> [f64; 3] {
    took.sort();
    QUANTILES.map(|share| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a place among those that are there"
        )]
        let place = (share * took.len() as f64) as usize;
        took.get(place).or(took.last()).map_or(f64::NAN, |took| took.as_secs_f64() * 1e3)
    })
}

/// Frames that the subscriber could have seen and that are in no recording.
fn unrecorded(folder: &Path, seen: &HashMap<String, Seen>) -> Result<u64> {
    let mut missing = 0;
    for (rig, of) in seen {
        let runs = fs::read_dir(folder.join("runs").join(rig))?.flatten().map(|run| run.path());
        let recording = runs.map(|run| run.join("recording.mcap")).find(|recording| recording.is_file());
        let mut recorded = 0;
        for entry in tactus_record::read(recording.with_context(|| format!("rig {rig} has no recording"))?)? {
            if let Entry::Message { message: Message::Frame(frame), .. } = entry? {
                recorded += u64::from((of.first..=of.last).contains(&frame.seq));
            }
        }
        missing += of.lacks(recorded);
    }
    Ok(missing)
}

/// Processor time that a process has spent, in s.
fn processor_s(pid: u32) -> Result<f64> {
    /// Of the kernel's clock for processes, on every Linux.
    const TICKS_PER_S: f64 = 100.0;
    let stat = fs::read_to_string(format!("/proc/{pid}/stat"))?;
    let (_, fields) = stat.rsplit_once(')').context("a process's state")?;
    let ticks: u64 =
        fields.split_whitespace().skip(11).take(2).filter_map(|field| field.parse::<u64>().ok()).sum();
    Ok(ticks as f64 / TICKS_PER_S)
}

/// A number of `/proc/PID/status`.
fn status(pid: u32, name: &str) -> Result<u64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status"))?;
    let line = status.lines().find_map(|line| line.strip_prefix(name)).with_context(|| name.to_owned())?;
    Ok(line.split_whitespace().next().context("a number")?.parse()?)
}
