//! A sensor and a stage that exist only here, in virtual time, and a recording that remembers.

use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_device::{Clock, HomingPermit, Permit, Sensor, SensorEvent, Stage, StageError};
use tactus_engine::{CoveringMemory, Devices, Engine, Record, RecordFailure, RunOrder, Unpublished};
use tactus_plan::{Arguments, InThisProcess, RigView, Script, ScriptLimits};
use tactus_schema::{Frame, FrameFlags, MonoTime, Rig, TimeStamp, pb};
use tokio::sync::{mpsc, watch};
use tokio::time::{MissedTickBehavior, interval, sleep};

/// From a command to the stage's first motion: a controller is asked first, and the stage accelerates.
const STARTING: Duration = Duration::from_millis(10);

/// What can go wrong with the sensor, set by a test while it runs.
#[derive(Debug, Default)]
pub(crate) struct Trouble {
    /// Frames that will be lost before the next one.
    pub(crate) lose: u32,
    /// No frame comes.
    pub(crate) silent: bool,
    /// Why there is no stage.
    pub(crate) absent: Option<&'static str>,
    /// The next question to the stage below the surface panics.
    pub(crate) look_panics: bool,
    /// Questions to the stage before one that is answered only by the next stop.
    pub(crate) looks_before_stop: Option<u32>,
    /// Moves down that the stage will break off half-way, because no report came, before the next one.
    pub(crate) unanswered: u32,
    /// Moves up that the stage will refuse.
    pub(crate) refused_rises: u32,
    /// Epoch of the stage's position.
    pub(crate) epoch: u32,
    /// Number of the stage's alarm, if it is in one.
    pub(crate) alarm: Option<u32>,
    /// The driver panics instead of giving a frame.
    pub(crate) panics: bool,
    /// Counts on top of all elements.
    pub(crate) push_counts: f32,
    /// The array goes on to read what it does at this depth.
    pub(crate) stuck_depth_mm: Option<f64>,
}

pub(crate) struct Bench {
    pub(crate) engine: Engine,
    pub(crate) trouble: Arc<Mutex<Trouble>>,
    pub(crate) deepest_mm: Arc<Mutex<f64>>,
    pub(crate) stage: watch::Receiver<pb::StageState>,
    /// Rises with each stop that the stage gets.
    pub(crate) stops: watch::Receiver<u64>,
    hand: Arc<FakeStage>,
}

struct FakeSensor {
    trouble: Arc<Mutex<Trouble>>,
    stage: watch::Receiver<pb::StageState>,
    clock: Clock,
    tick: tokio::time::Interval,
    seq: u64,
    told: bool,
    pending: Option<Frame>,
}

impl Sensor for FakeSensor {
    fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<SensorEvent> {
        if !std::mem::replace(&mut self.told, true) {
            return Poll::Ready(SensorEvent::Connected(Box::new(pb::SensorInfo {
                rows: 6,
                cols: 8,
                ..Default::default()
            })));
        }
        if let Some(frame) = self.pending.take() {
            return Poll::Ready(SensorEvent::Frame(frame));
        }
        loop {
            ready!(self.tick.poll_tick(context));
            let mut trouble = self.trouble.lock().unwrap();
            self.seq += 1;
            if std::mem::take(&mut trouble.panics) {
                drop(trouble);
                panic!("a driver that panics, for a test");
            }
            if trouble.silent {
                trouble.lose += 1;
                continue;
            }
            let lost = std::mem::take(&mut trouble.lose);
            let depth_mm = trouble.stuck_depth_mm.unwrap_or(-self.stage.borrow().z_mm.min(0.0));
            #[expect(clippy::cast_possible_truncation, reason = "a fake reading")]
            let counts = vec![100.0 + 1000.0 * depth_mm as f32 + trouble.push_counts; 48];
            let frame = Frame {
                seq: self.seq,
                epoch: 0,
                device_tick: None,
                received: self.clock.now(),
                counts: counts.into(),
                flags: FrameFlags::default(),
                lost_before: lost,
                simulated: true,
                bad_elements: [].into(),
                temperature_c: None,
            };
            if lost == 0 {
                return Poll::Ready(SensorEvent::Frame(frame));
            }
            let gap = pb::Gap {
                frames_lost: lost.into(),
                after_seq: self.seq - 1 - u64::from(lost),
                next_seq: self.seq,
                reason: "test".into(),
            };
            self.pending = Some(frame);
            return Poll::Ready(SensorEvent::Gap(gap));
        }
    }
}

struct FakeStage {
    state: watch::Sender<pb::StageState>,
    reports: mpsc::Sender<pb::StageState>,
    stops: watch::Sender<u64>,
    deepest_mm: Arc<Mutex<f64>>,
    trouble: Arc<Mutex<Trouble>>,
    clock: Clock,
}

impl FakeStage {
    async fn report(&self, [x_mm, y_mm, z_mm]: [f64; 3], status: pb::StageStatus) {
        let now = self.clock.now();
        {
            let mut deepest_mm = self.deepest_mm.lock().unwrap();
            *deepest_mm = deepest_mm.max(-z_mm);
        }
        let state = pb::StageState {
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            x_mm,
            y_mm,
            z_mm,
            status: status.into(),
            epoch: self.trouble.lock().unwrap().epoch,
            simulated: true,
            ..Default::default()
        };
        self.state.send_replace(state);
        self.reports.send(state).await.unwrap();
    }

    /// Like a stage that is asked where it is ten times a second.
    async fn repeat_reports(self: Arc<Self>) {
        loop {
            sleep(Duration::from_millis(100)).await;
            let now = self.clock.now();
            let alarm = self.trouble.lock().unwrap().alarm;
            self.state.send_modify(|state| {
                (state.t_mono_ns, state.t_wall_ns) = (now.mono.ns(), now.wall.ns());
                if alarm.is_some() {
                    state.set_status(pb::StageStatus::Alarm);
                }
            });
            let state = *self.state.borrow();
            if self.reports.send(state).await.is_err() {
                return;
            }
        }
    }

    fn position_mm(&self) -> [f64; 3] {
        let state = self.state.borrow();
        [state.x_mm, state.y_mm, state.z_mm]
    }
}

impl Stage for FakeStage {
    fn state(&self) -> watch::Receiver<pb::StageState> {
        self.state.subscribe()
    }

    fn home(&self, permit: HomingPermit) -> BoxFuture<'_, Result<(), StageError>> {
        async move {
            permit.check(self.clock.now().mono)?;
            self.report([25.0, 20.0, 10.0], pb::StageStatus::Idle).await;
            Ok(())
        }
        .boxed()
    }

    fn move_to(&self, permit: Permit) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        async move {
            permit.check(self.clock.now().mono)?;
            let target = permit.target();
            let from = self.position_mm();
            let way: Vec<_> = from.iter().zip(target.position_mm).map(|(from, to)| to - from).collect();
            if way[2] > 0.0 && take_one(&mut self.trouble.lock().unwrap().refused_rises) {
                return Err(StageError::Refused { command: "G1".into(), reason: "test".into() });
            }
            let distance_mm = way.iter().map(|d| d * d).sum::<f64>().sqrt();
            let mut stops = self.stops.subscribe();
            let lasts = Duration::from_secs_f64(distance_mm / target.speed_mm_per_s);
            let start = self.clock.now().mono;
            self.report(from, pb::StageStatus::Moving).await;
            let stopped = tokio::select! {
                biased;
                _ = stops.changed() => true,
                () = sleep(STARTING + lasts) => false,
            };
            let moved = self.clock.now().mono.since(start).saturating_sub(STARTING);
            let share = if lasts.is_zero() { 1.0 } else { moved.as_secs_f64() / lasts.as_secs_f64() };
            let share = if stopped { share.min(1.0) } else { 1.0 };
            let is_unanswered =
                !stopped && way[2] < 0.0 && take_one(&mut self.trouble.lock().unwrap().unanswered);
            let share = if is_unanswered { 0.5 } else { share };
            let at: Vec<_> = from.iter().zip(&way).map(|(from, way)| from + way * share).collect();
            let at = if share < 1.0 { [at[0], at[1], at[2]] } else { target.position_mm };
            self.report(at, pb::StageStatus::Idle).await;
            if is_unanswered {
                return Err(StageError::Unanswered { command: "G1".into(), waited_s: 0.3 });
            }
            if stopped { Err(StageError::Stopped { position_mm: at }) } else { Ok(at) }
        }
        .boxed()
    }

    fn look(&self) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        async {
            if let Some(why) = self.trouble.lock().unwrap().absent {
                return Err(StageError::Refused { command: "?".into(), reason: why.into() });
            }
            if let Some(code) = self.trouble.lock().unwrap().alarm {
                return Err(StageError::Alarm { code, name: code.to_string(), meaning: "hard limit".into() });
            }
            let left = self.trouble.lock().unwrap().looks_before_stop;
            self.trouble.lock().unwrap().looks_before_stop = left.and_then(|left| left.checked_sub(1));
            let at_mm = self.position_mm();
            if left == Some(0) {
                self.stops.subscribe().changed().await.unwrap();
                return Err(StageError::Stopped { position_mm: at_mm });
            }
            let panics = at_mm[2] < 0.0 && std::mem::take(&mut self.trouble.lock().unwrap().look_panics);
            assert!(!panics, "a stage that panics, for a test");
            self.report(at_mm, pb::StageStatus::Idle).await;
            Ok(at_mm)
        }
        .boxed()
    }

    fn stop(&self) {
        self.stops.send_modify(|stops| *stops += 1);
    }

    fn watch(&self) {}

    fn driven(&self) -> MonoTime {
        self.clock.now().mono
    }

    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>> {
        async { Ok(()) }.boxed()
    }
}

/// True if there was one.
fn take_one(left: &mut u32) -> bool {
    std::mem::replace(left, left.saturating_sub(1)) > 0
}

impl Bench {
    pub(crate) fn start(change: impl Fn(String) -> String) -> Self {
        Self::with_covering_memory(change, None)
    }

    /// With who remembers the covering.
    pub(crate) fn with_covering_memory(
        change: impl Fn(String) -> String,
        covering_memory: Option<Arc<dyn CoveringMemory>>,
    ) -> Self {
        let rig = change(include_str!("../../../../config/rigs/sim.toml").to_owned());
        let rig = Rig::from_toml(&rig).unwrap();
        let clock = Clock::paused();
        let unhomed =
            pb::StageState { z_mm: 10.0, status: pb::StageStatus::Unhomed.into(), ..Default::default() };
        let (reports, stage_reports) = mpsc::channel(256);
        let deepest_mm = Arc::new(Mutex::new(f64::NEG_INFINITY));
        let trouble = Arc::new(Mutex::new(Trouble::default()));
        let stage = Arc::new(FakeStage {
            trouble: Arc::clone(&trouble),
            state: watch::Sender::new(unhomed),
            reports,
            stops: watch::Sender::default(),
            deepest_mm: Arc::clone(&deepest_mm),
            clock,
        });
        let mut tick = interval(Duration::from_secs_f64(1.0 / 30.0));
        tick.set_missed_tick_behavior(MissedTickBehavior::Burst);
        let sensor = FakeSensor {
            trouble: Arc::clone(&trouble),
            stage: stage.state(),
            clock,
            tick,
            seq: 0,
            told: false,
            pending: None,
        };
        let (state, stops) = (stage.state(), stage.stops.subscribe());
        tokio::spawn(Arc::clone(&stage).repeat_reports());
        let hand = Arc::clone(&stage);
        let devices = Devices {
            sensor: Box::new(sensor),
            stage,
            stage_reports,
            change_covering: None,
            covering_memory,
        };
        let engine = Engine::start(rig, devices, clock, Arc::new(Unpublished)).unwrap();
        Self { engine, trouble, deepest_mm, stage: state, stops, hand }
    }

    /// The stage is gone, and its driver says why.
    pub(crate) async fn lose_stage(&self, why: &'static str) {
        self.trouble.lock().unwrap().absent = Some(why);
        self.hand.report([0.0; 3], pb::StageStatus::Disconnected).await;
    }

    /// Puts the tip somewhere by hand.
    pub(crate) async fn place(&self, at_mm: [f64; 3]) {
        self.hand.report(at_mm, pb::StageStatus::Idle).await;
    }

    pub(crate) fn order(&self, source: &str) -> RunOrder {
        let script = Script::parse("test", source).unwrap();
        let arguments = Arguments::default().resolve(&script, &RigView::of(&self.engine.rig())).unwrap();
        RunOrder {
            run_id: "run".into(),
            script,
            arguments,
            seed: 1,
            who: "test".into(),
            limits: ScriptLimits::default(),
            evaluator: Arc::new(InThisProcess),
            earlier: None,
            planned: None,
            versions: std::collections::BTreeMap::new(),
            recording: String::new(),
            resets: true,
        }
    }
}

/// Everything that was recorded, in order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory {
    pub(crate) frames: Arc<Mutex<Vec<Frame>>>,
    pub(crate) events: Arc<Mutex<Vec<pb::RunEvent>>>,
    pub(crate) safety: Arc<Mutex<Vec<pb::SafetyEvent>>>,
    pub(crate) finished: Arc<Mutex<bool>>,
    /// The disk is full after this many frames.
    pub(crate) fails_after: Option<usize>,
}

impl Memory {
    pub(crate) fn sink(&self) -> Box<dyn Record> {
        Box::new(self.clone())
    }

    pub(crate) fn kinds(&self) -> Vec<pb::run_event::Event> {
        self.events.lock().unwrap().iter().filter_map(|event| event.event.clone()).collect()
    }
}

impl Record for Memory {
    fn sensor_info(&mut self, _: &pb::SensorInfo, _: TimeStamp) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), RecordFailure> {
        let mut frames = self.frames.lock().unwrap();
        frames.push(frame.clone());
        if self.fails_after.is_some_and(|limit| frames.len() > limit) {
            return Err(RecordFailure("no space left on device".into()));
        }
        Ok(())
    }

    fn stage(&mut self, _: &pb::StageState) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn event(&mut self, event: &pb::RunEvent) -> Result<(), RecordFailure> {
        self.events.lock().unwrap().push(event.clone());
        Ok(())
    }

    fn safety(&mut self, event: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        self.safety.lock().unwrap().push(event.clone());
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        *self.finished.lock().unwrap() = true;
        Ok(())
    }
}
