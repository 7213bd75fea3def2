use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};

use futures_util::future::BoxFuture;
use tactus_bus::{BusConfig, Client, Endpoint, History, Hold, Published, Subscription};
use tactus_device::{HomingPermit, Permit, Sensor, SensorEvent, Stage, StageError};
use tactus_engine::Devices;
use tactus_plan::InThisProcess;
use tactus_record::{Completeness, Entry, Message, Reader};
use tactus_runner::devices;
use tactus_schema::{MonoTime, pb::run_event::Event};
use tokio::task::JoinSet;

use crate::service::{answer_stops, keep_all};

use super::*;

/// Longer than any run of the tests.
const READS: &str = "def run(rig):\n    tare()\n    wait(120.0)\n";
/// Frames that are seen before and after the other rig breaks off.
const FRAMES: usize = 30;
/// Only a hang takes this long.
const PATIENCE: Duration = Duration::from_mins(2);

/// What of a rig panics, once, when it is told to.
#[derive(Default)]
struct Defects {
    /// The rig's own task, when it looks at the stage for the health.
    of_rig: AtomicBool,
    /// The sensor's driver.
    of_sensor: AtomicBool,
    task: OnceLock<tokio::task::Id>,
}

struct BreakingSensor(Box<dyn Sensor>, Arc<Defects>);

struct BreakingStage(Arc<dyn Stage>, Arc<Defects>);

impl Sensor for BreakingSensor {
    fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<SensorEvent> {
        assert!(!self.1.of_sensor.swap(false, Ordering::SeqCst), "the sensor's driver breaks off");
        self.0.poll_next(context)
    }
}

impl Stage for BreakingStage {
    fn state(&self) -> watch::Receiver<pb::StageState> {
        let is_rig = tokio::task::try_id() == self.1.task.get().copied();
        assert!(!(is_rig && self.1.of_rig.swap(false, Ordering::SeqCst)), "the rig's task breaks off");
        self.0.state()
    }

    fn home(&self, permit: HomingPermit) -> BoxFuture<'_, Result<(), StageError>> {
        self.0.home(permit)
    }

    fn move_to(&self, permit: Permit) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.0.move_to(permit)
    }

    fn look(&self) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.0.look()
    }

    fn stop(&self) {
        self.0.stop();
    }

    fn watch(&self) {
        self.0.watch();
    }

    fn driven(&self) -> MonoTime {
        self.0.driven()
    }

    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>> {
        self.0.clear_alarm()
    }
}

/// A service of two simulated rigs, of which the left one can break off.
struct Lab {
    folder: tempfile::TempDir,
    endpoint: Endpoint,
    defects: Arc<Defects>,
    end: watch::Sender<Option<&'static str>>,
    keeping: JoinSet<Result<(), RigError>>,
}

impl Lab {
    async fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint: Endpoint = format!("tcp/127.0.0.1:{port}").parse().unwrap();
        let text = include_str!("../../../../config/rigs/sim.toml");
        fs::create_dir(folder.path().join("rigs")).unwrap();
        for name in ["left", "right"] {
            let text = text.replace("name = \"sim\"", &format!("name = \"{name}\""));
            fs::write(folder.path().join("rigs").join(format!("{name}.toml")), text).unwrap();
        }
        let config = folder.path().join("tactusd.toml");
        fs::write(&config, "rigs = \"rigs\"\nrecordings = \"runs\"\n").unwrap();
        let mut config = ServiceConfig::load(&config).unwrap();
        config.recordings = folder.path().join("runs");

        let bus = BusConfig { listen: vec![endpoint.clone()], ..BusConfig::default() };
        let (node, stops) = Node::open(&bus, &["left", "right"].map(Keys::new)).await.unwrap();
        let rigs = all(&node, &mut config).await.unwrap();
        let (end, ending) = watch::channel(None);
        let defects = Arc::new(Defects::default());
        let service = Arc::new(Service {
            config,
            desks: Desks::default(),
            standings: Standings::default(),
            runs: Runs::default(),
            open: opener(Arc::clone(&defects)),
            clock: Clock::real(),
            evaluator: Arc::new(InThisProcess),
            ending,
        });
        answer_stops(&service.desks, stops).unwrap();
        let keeping = keep_all(rigs, &service);
        Self { folder, endpoint, defects, end, keeping }
    }

    /// A client of a rig that is ready.
    async fn client(&self, rig: &str) -> Client {
        let client = Client::connect(&self.endpoint, Some(rig)).await.unwrap();
        let mut alive = client.alive();
        while !alive.now() {
            alive.changed().await.unwrap();
        }
        client
    }

    fn recording(&self, rig: &str) -> PathBuf {
        let runs = fs::read_dir(self.folder.path().join("runs").join(rig)).unwrap();
        runs.map(|run| run.unwrap().path()).find(|run| run.is_dir()).unwrap().join("recording.mcap")
    }
}

/// Opens devices as the service does. Those of the left rig break off when told to.
fn opener(defects: Arc<Defects>) -> OpenDevices {
    Box::new(move |rig, service, codec, truth, clock| {
        let mut opened = devices::open(rig, service, codec, truth, clock);
        if rig.name == "left" {
            // It is the rig's task that opens them.
            defects.task.get_or_init(tokio::task::id);
            let OpenedRig { devices, .. } = opened;
            let sensor = Box::new(BreakingSensor(devices.sensor, Arc::clone(&defects)));
            let stage = Arc::new(BreakingStage(devices.stage, Arc::clone(&defects)));
            opened = OpenedRig { devices: Devices { sensor, stage, ..devices }, control: opened.control };
        }
        opened
    })
}

/// Asks for a run that only reads.
async fn run(client: &Client, lease: Vec<u8>) -> pb::CommandReply {
    let (experiment, script, who) = ("reads".to_owned(), READS.to_owned(), "test".to_owned());
    let request = pb::RunRequest { experiment, script, who, lease, ..pb::RunRequest::default() };
    client.command(Command::Run, &request, PATIENCE).await.unwrap()
}

/// Resets a rig and starts a run on it.
async fn start_run(client: &Client) {
    let Hold::Held(held) = client.hold("test", None).await.unwrap() else { panic!("nobody holds the rig") };
    let lease = held.secret();
    let request = pb::CommandRequest { who: "test".into(), lease: lease.clone(), ..Default::default() };
    let reply = client.command(Command::Reset, &request, PATIENCE).await.unwrap();
    assert!(reply.ok, "{}", reply.error);
    let reply = run(client, lease).await;
    assert!(reply.ok, "{}", reply.error);
    held.release().await.unwrap();
}

async fn frames(subscription: &mut Subscription<pb::Frame>) -> Vec<u64> {
    let mut seqs = Vec::new();
    while seqs.len() < FRAMES {
        seqs.push(subscription.recv().await.unwrap().seq);
    }
    seqs
}

async fn until<M: Published>(subscription: &mut Subscription<M>, is_it: impl Fn(&M) -> bool) -> M {
    loop {
        let message = subscription.recv().await.unwrap();
        if is_it(&message) {
            return message;
        }
    }
}

/// The frames of a recording, how its run ended, and how much of it is there.
fn recorded(path: &Path) -> (Vec<u64>, Option<pb::RunFinished>, Completeness) {
    let mut reader = Reader::new(fs::File::open(path).unwrap());
    let (mut seqs, mut finished) = (Vec::new(), None);
    for entry in reader.by_ref() {
        let Entry::Message { message, .. } = entry.unwrap() else { continue };
        if let Message::Frame(frame) = &message {
            seqs.push(frame.seq);
        }
        if let Message::Event(event) = message
            && let Some(Event::Finished(end)) = event.event
        {
            finished = Some(end);
        }
    }
    (seqs, finished, reader.completeness().unwrap().clone())
}

fn assert_unbroken(seqs: &[u64]) {
    assert!(seqs.windows(2).all(|pair| pair[1] == pair[0] + 1), "{seqs:?}");
}

/// The left rig breaks off in a run; the right one must not notice.
async fn one_of_two_breaks_off(part: fn(&Defects) -> &AtomicBool) {
    let mut lab = Lab::start().await;
    let (left, right) = (lab.client("left").await, lab.client("right").await);
    start_run(&left).await;
    start_run(&right).await;
    let mut right_frames = right.subscribe::<pb::Frame>(History::None).await.unwrap();
    let mut left_health = left.subscribe::<pb::Health>(History::None).await.unwrap();
    let mut seen = frames(&mut right_frames).await;

    part(&lab.defects).store(true, Ordering::SeqCst);
    until(&mut left_health, |health| health.problem.contains("this is a defect of Tactus")).await;
    seen.extend(frames(&mut right_frames).await);
    assert_unbroken(&seen);
    // Its own run is closed, and says that it did not end by itself.
    let (seqs, finished, completeness) = recorded(&lab.recording("left"));
    let finished = finished.expect("the recording says how the run ended");
    assert_ne!(finished.exit_status(), pb::ExitStatus::Done, "{finished:?}");
    assert_eq!(completeness, Completeness::Complete);
    assert_unbroken(&seqs);

    // It comes up again by itself, and moves nothing before a reset.
    until(&mut left_health, |health| health.problem.is_empty()).await;
    let Hold::Held(held) = left.hold("test", None).await.unwrap() else { panic!("nobody holds the rig") };
    let refused = run(&left, held.secret()).await;
    assert!(!refused.ok && refused.error.contains("tactus reset"), "{refused:?}");

    let mut right_run = right.subscribe::<pb::RunState>(History::None).await.unwrap();
    let stop = pb::CommandRequest { who: "test".into(), ..Default::default() };
    assert!(right.stop(&stop, PATIENCE).await.unwrap().ok);
    until(&mut right_run, |state| state.phase() == pb::RunPhase::Finished).await;
    let (seqs, finished, completeness) = recorded(&lab.recording("right"));
    assert_eq!(finished.unwrap().exit_status(), pb::ExitStatus::Stopped);
    assert_eq!(completeness, Completeness::Complete);
    assert_unbroken(&seqs);
    assert!(seen.iter().all(|seq| seqs.contains(seq)), "{seen:?} are not all in {seqs:?}");

    lab.end.send_replace(Some("the test"));
    while let Some(kept) = lab.keeping.join_next().await {
        kept.unwrap().unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_of_a_rigs_task_ends_its_run_and_no_frame_of_the_other_is_lost() {
    one_of_two_breaks_off(|defects| &defects.of_rig).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_of_a_sensors_driver_ends_its_run_and_no_frame_of_the_other_rig_is_lost() {
    one_of_two_breaks_off(|defects| &defects.of_sensor).await;
}
