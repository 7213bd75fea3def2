//! The path of a frame, from its bytes to the viewers and the recording, takes no memory for each frame. A test binary of its own,
//! because it counts with an allocator of its own.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeMap;
use std::future::ready;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use allocation_counter::measure;
use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_device::transport::memory::{self, MemoryPort};
use tactus_device::{
    ArrayExpectation, Clock, HomingPermit, Permit, SensorCodec, SensorDriver, Stage, StageError,
};
use tactus_engine::{Devices, Engine, Publish, Pulse, Record, RunOrder, Unrecorded};
use tactus_plan::{Arguments, InThisProcess, Script, ScriptLimits};
use tactus_record::Recording;
use tactus_runner::config::RigFiles;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::order;
use tactus_runner::recorder::{DirectRecorder, ThreadRecorder};
use tactus_schema::{Frame, FrameFlags, MonoTime, TimeStamp, WallTime, pb};
use tactus_wire::weiss::{
    ControllerInfo, Decoder, ErrorCode, HostCommand, MatrixInfo, SensorInfo, acknowledge, encode_frame, id,
};
use tempfile::TempDir;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::sync::{mpsc, watch};
use tokio::time::sleep;

/// 30 frames a second, as the array has.
const PERIOD: Duration = Duration::from_nanos(33_333_333);

const ELEMENTS: usize = 48;

/// The first frames make the memory that the others use again.
const WARM_UP: usize = 300;
const COUNTED: usize = 300;

/// A stage that stands at the safe height.
struct StandingStage {
    state: watch::Sender<pb::StageState>,
    clock: Clock,
}

impl StandingStage {
    fn new(clock: Clock) -> Self {
        let status = pb::StageStatus::Idle.into();
        let state = pb::StageState { z_mm: 2.0, x_mm: 20.0, y_mm: 20.0, status, ..Default::default() };
        Self { state: watch::Sender::new(state), clock }
    }

    fn answer(&self) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        let pb::StageState { x_mm, y_mm, z_mm, .. } = *self.state.borrow();
        ready(Ok([x_mm, y_mm, z_mm])).boxed()
    }
}

impl Stage for StandingStage {
    fn state(&self) -> watch::Receiver<pb::StageState> {
        self.state.subscribe()
    }

    fn home(&self, _: HomingPermit) -> BoxFuture<'_, Result<(), StageError>> {
        ready(Ok(())).boxed()
    }

    fn move_to(&self, _: Permit) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.answer()
    }

    fn look(&self) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.answer()
    }

    fn stop(&self) {}

    fn watch(&self) {}

    fn driven(&self) -> MonoTime {
        self.clock.now().mono
    }

    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>> {
        ready(Ok(())).boxed()
    }
}

/// Encodes as the bus does. The bus encodes into new memory each time, because zenoh keeps it.
#[derive(Default)]
struct Encoded(Mutex<Vec<u8>>);

impl Publish for Encoded {
    fn sensor_info(&self, _: &pb::SensorInfo) {}

    fn frame(&self, frame: &Frame) {
        let mut bytes = self.0.lock().unwrap();
        bytes.clear();
        frame.encode(&mut bytes);
    }

    fn stage(&self, _: &pb::StageState) {}
    fn event(&self, _: &pb::RunEvent) {}
    fn state(&self, _: &pb::RunState) {}
    fn safety(&self, _: &pb::SafetyEvent) {}
}

/// A controller that sends frames, each when it is told to.
struct Controller {
    stream: DuplexStream,
    packets: Vec<Vec<u8>>,
    sent: usize,
}

impl Controller {
    /// Answers the host's queries until it asks for frames.
    async fn connected(mut port: MemoryPort) -> Self {
        let mut stream = port.accept().await;
        let (mut decoder, mut buffer) = (Decoder::new(), [0; 256]);
        loop {
            let count = stream.read(&mut buffer).await.unwrap();
            decoder.push(&buffer[..count]);
            while let Some(packet) = decoder.next_packet() {
                let command = HostCommand::parse(&packet.unwrap()).unwrap();
                let answer = match command {
                    HostCommand::QueryController => ControllerInfo::default().encode(),
                    HostCommand::QuerySensor => SensorInfo { matrices: 1, ..SensorInfo::default() }.encode(),
                    HostCommand::QueryMatrix { .. } => {
                        MatrixInfo { cells_x: 8, cells_y: 6, ..MatrixInfo::default() }.encode()
                    }
                    HostCommand::Acquire { .. } => acknowledge(id::ACQUIRE, ErrorCode::SUCCESS),
                };
                stream.write_all(&answer).await.unwrap();
                if matches!(command, HostCommand::Acquire { run: true, .. }) {
                    let ms = |frame: usize| u32::try_from(frame * 100 / 3).unwrap();
                    let noise = |frame: usize| u16::try_from(100 + frame % 3).unwrap();
                    let packet = |frame| encode_frame(ms(frame), &[noise(frame); ELEMENTS], false);
                    let packets = (0..10 * (WARM_UP + COUNTED)).map(packet).collect();
                    return Self { stream, packets, sent: 0 };
                }
            }
        }
    }

    /// Sends the next frame in its time, and waits until the engine has it.
    async fn send(&mut self, pulse: &mut watch::Receiver<Pulse>) {
        sleep(PERIOD).await;
        self.stream.write_all(&self.packets[self.sent]).await.unwrap();
        self.sent += 1;
        let sent = self.sent as u64;
        pulse.wait_for(|pulse| pulse.frames == sent).await.unwrap();
    }
}

/// How often each of [`COUNTED`] frames takes memory, in a run that waits: in the driver, the supervisor, the engine, for the viewers
/// and in the recording.
fn taken_by_each_frame(record: impl FnOnce(Recording) -> Box<dyn Record>) -> Vec<u64> {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap();
    let (folder, order) = (TempDir::new().unwrap(), waiting());
    let record = record(recording(&order, folder.path()));
    let rig = RigFiles::of(SIMULATED_RIG, Path::new("sim.toml")).unwrap().rig;
    let (mut controller, engine, _reports) = runtime.block_on(async {
        let clock = Clock::paused();
        let (connector, port) = memory::pair("sensor");
        let expect = ArrayExpectation::of(&rig);
        let sensor = SensorDriver::start(SensorCodec::default(), Box::new(connector), expect, clock);
        let stage = StandingStage::new(clock);
        let (reports, stage_reports) = mpsc::channel(1);
        reports.try_send(*stage.state.borrow()).unwrap();
        let devices = Devices {
            sensor: Box::new(sensor),
            stage: Arc::new(stage),
            stage_reports,
            change_covering: None,
            covering_memory: None,
        };
        let controller = Controller::connected(port).await;
        let engine = Engine::start(rig, devices, clock, Arc::new(Encoded::default())).unwrap();
        (controller, engine, reports)
    });
    let (running, mut pulse, state) = (engine.clone(), engine.pulse(), engine.state());
    runtime.spawn(async move { running.run(order, record).await });
    while state.borrow().phase() != pb::RunPhase::Running {
        assert_ne!(state.borrow().phase(), pb::RunPhase::Finished, "{:?}", state.borrow());
        runtime.block_on(controller.send(&mut pulse));
    }
    for _ in 0..WARM_UP {
        runtime.block_on(controller.send(&mut pulse));
    }
    let mut sent = || measure(|| runtime.block_on(controller.send(&mut pulse))).count_total;
    let taken = (0..COUNTED).map(|_| sent()).collect();
    assert_eq!(state.borrow().phase(), pb::RunPhase::Running);
    taken
}

fn waiting() -> RunOrder {
    RunOrder {
        run_id: "allocations".into(),
        script: Script::parse("waits", "def run(rig):\n    wait(600)\n").unwrap(),
        arguments: Arguments::default(),
        seed: 1,
        who: "test".into(),
        limits: ScriptLimits::default(),
        evaluator: Arc::new(InThisProcess),
        earlier: None,
        planned: None,
        versions: BTreeMap::new(),
        recording: String::new(),
        resets: true,
    }
}

fn recording(order: &RunOrder, folder: &Path) -> Recording {
    let RigFiles { rig, texts, .. } = RigFiles::of(SIMULATED_RIG, Path::new("sim.toml")).unwrap();
    order::recording(order, &rig, texts.all(), folder, WallTime::default()).unwrap().0
}

#[test]
fn a_frame_takes_no_memory_on_its_way_to_the_viewers() {
    let taken = taken_by_each_frame(|_| Box::new(Unrecorded));
    assert_eq!(taken, [0; COUNTED]);
}

/// The writer of MCAP files makes each chunk, which is half a second of frames, in new memory.
#[test]
fn a_recording_takes_memory_for_chunks_only() {
    let taken = taken_by_each_frame(|recording| Box::new(DirectRecorder(recording)));
    let chunks = COUNTED as u64 / 15;
    let total: u64 = taken.iter().sum();
    assert!(total <= 40 * chunks, "{total} in {chunks} chunks: {taken:?}");
    assert!(taken.iter().filter(|taken| **taken == 0).count() >= COUNTED / 2, "{taken:?}");
}

/// The queue of the standard library takes memory for 31 messages at once.
#[test]
fn a_frame_takes_no_memory_of_its_own_in_the_queue_to_the_disk() {
    let (folder, order) = (TempDir::new().unwrap(), waiting());
    let mut recorder = ThreadRecorder::start(recording(&order, folder.path())).unwrap();
    let frame = Frame {
        seq: 1,
        epoch: 0,
        device_tick: None,
        received: TimeStamp { mono: MonoTime::default(), wall: WallTime::default() },
        counts: [100.0; ELEMENTS].into(),
        flags: FrameFlags::default(),
        lost_before: 0,
        simulated: true,
        bad_elements: Arc::default(),
        temperature_c: None,
    };
    let mut queue = |frames: usize| {
        for _ in 0..frames {
            recorder.frame(&frame).unwrap();
        }
    };
    // Room for the times of what waits.
    queue(WARM_UP);
    let taken = measure(|| queue(COUNTED)).count_total;
    assert!(taken <= 2 + COUNTED as u64 / 31, "{taken}");
}
