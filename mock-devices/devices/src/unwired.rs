//! Sensor and stage without wires: what a dry run moves.
//!
//! They do for the engine what a driver does, in virtual time, and share a world as the virtual devices do. Nothing is encoded and
//! nothing can fail, except that a target outside of the stage's travel is refused. The sensor samples at the array's rate. The stage
//! keeps to its kinematics, and tells of itself as a controller that is asked every 20 ms while it moves.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_device::{ArrayExpectation, Clock, HomingPermit, Permit, Sensor, SensorEvent, Stage, StageError};
use tactus_schema::pb::StageStatus;
use tactus_schema::rig::StageProtocol;
use tactus_schema::{Frame, FrameFlags, MonoTime, Rig, pb};
use tactus_wire::stage::AxisName;
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, Sleep, sleep_until};

use crate::motion::Point;
use crate::truth::Truth;
use crate::world::{SharedWorld, World};

/// Time between two reports of a stage that moves. Its arrival is known from the first after it.
const REPORT_EVERY: Duration = Duration::from_millis(20);

/// Time between two reports of a stage that stands.
const REPORT_STANDING_EVERY: Duration = Duration::from_millis(100);

/// Reports that may wait. The engine reads them before the next frame, between two of which a few come.
const REPORTS_MAX: usize = 64;

/// The stage stands this far below the end of its travel at the start, as after homing.
const BELOW_END_MM: f64 = 1.0;

/// Sensor and stage of a simulated rig, for an engine in virtual time.
#[derive(Debug)]
pub struct UnwiredRig {
    /// The tactile array.
    pub sensor: UnwiredSensor,
    /// The stage. It stands above the middle of the envelope and knows where.
    pub stage: Arc<UnwiredStage>,
    /// Every report of the stage.
    pub reports: mpsc::Receiver<pb::StageState>,
}

/// A tactile array that is read where it is.
#[derive(Debug)]
pub struct UnwiredSensor {
    world: SharedWorld,
    stage: Arc<UnwiredStage>,
    info: pb::SensorInfo,
    clock: Clock,
    started: Instant,
    /// Until the next sampling.
    sampling: Pin<Box<Sleep>>,
    /// Frames so far.
    seq: u64,
    is_connected: bool,
    unread: Arc<[u32]>,
    counts: Vec<u16>,
}

/// A stage that goes where it is told.
#[derive(Debug)]
pub struct UnwiredStage {
    world: SharedWorld,
    clock: Clock,
    travel_mm: [[f64; 2]; 3],
    speed_max_mm_per_s: f64,
    latest: watch::Sender<pb::StageState>,
    reports: mpsc::Sender<pb::StageState>,
    /// How often it was stopped.
    stops: watch::Sender<u64>,
}

impl UnwiredRig {
    /// A rig with this truth, switched on now; `truth` names elements of the rig's array.
    ///
    /// # Panics
    /// Outside of a tokio runtime, and of a truth that was not made by its own constructors.
    pub fn start(rig: &Rig, mut truth: Truth, clock: Clock) -> Self {
        if let StageProtocol::Zaber(axes) = &truth.stage_protocol
            && let Some(accel_mm_per_s2) = axes.accel_mm_per_s2
        {
            truth.stage.acceleration_mm_per_s2 = accel_mm_per_s2;
        }
        let stage = truth.stage;
        let has_axis = std::array::from_fn(|axis| truth.stage_protocol.has_axis(axis));
        let mut world = World::new(Arc::new(truth), rig.covering);
        world.stand_at(start_mm(rig, stage.travel_mm, has_axis));
        let world = SharedWorld::new(world);
        let (sender, reports) = mpsc::channel(REPORTS_MAX);
        let unseen = pb::StageState { simulated: rig.simulated, epoch: 1, ..pb::StageState::default() };
        let stage = Arc::new(UnwiredStage {
            world: world.clone(),
            clock,
            travel_mm: reach_mm(rig, stage.travel_mm, has_axis),
            speed_max_mm_per_s: stage.speed_max_mm_per_s,
            latest: watch::Sender::new(unseen),
            reports: sender,
            stops: watch::Sender::default(),
        });
        stage.report();
        let started = Instant::now();
        let sensor = UnwiredSensor {
            world,
            stage: Arc::clone(&stage),
            info: ArrayExpectation::of(rig).info(0, "none".into(), "simulated, in this process".into()),
            clock,
            started,
            sampling: Box::pin(sleep_until(started)),
            seq: 0,
            is_connected: false,
            unread: Arc::default(),
            counts: Vec::new(),
        };
        Self { sensor, stage, reports }
    }

    /// Changes the covering: thickness in mm.
    pub fn change_covering(&self) -> impl Fn(f64) + Send + Sync + use<> {
        let world = self.sensor.world.clone();
        move |thickness_mm| world.lock().set_covering_mm(thickness_mm, Instant::now())
    }
}

impl Sensor for UnwiredSensor {
    fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<SensorEvent> {
        if !self.is_connected {
            self.is_connected = true;
            return Poll::Ready(SensorEvent::Connected(Box::new(self.info.clone())));
        }
        ready!(self.sampling.as_mut().poll(context));
        self.seq += 1;
        let next = self.started + Duration::from_secs_f64(self.seq as f64 / self.info.rate_hz);
        self.sampling.as_mut().reset(next);
        self.stage.report_if_due();
        Poll::Ready(SensorEvent::Frame(self.frame()))
    }
}

impl UnwiredSensor {
    fn frame(&mut self) -> Frame {
        let received = self.clock.now();
        self.world.lock().sample(self.clock.instant(received.mono), &mut self.counts);
        let full_scale_counts = self.info.full_scale_counts;
        let is_saturated = self.counts.iter().any(|counts| f64::from(*counts) >= full_scale_counts);
        let mut flags = FrameFlags::default();
        if self.seq == 1 {
            flags = flags.with(FrameFlags::NEW_EPOCH);
        }
        if is_saturated {
            flags = flags.with(FrameFlags::SATURATED);
        }
        Frame {
            seq: self.seq,
            epoch: 1,
            device_tick: None,
            received,
            counts: self.counts.iter().map(|counts| f32::from(*counts)).collect(),
            flags,
            lost_before: 0,
            simulated: self.info.simulated,
            bad_elements: Arc::clone(&self.unread),
            temperature_c: None,
        }
    }
}

impl UnwiredStage {
    /// Tells where it stands or moves now.
    fn report(&self) -> pb::StageState {
        let stamp = self.clock.now();
        let now = self.clock.instant(stamp.mono);
        let (is_moving, [x_mm, y_mm, z_mm]) = {
            let mut world = self.world.lock();
            world.settle(now);
            (world.is_moving(), world.believed_mm(now))
        };
        let before = *self.latest.borrow();
        let status = if is_moving { StageStatus::Moving } else { StageStatus::Idle };
        let state = pb::StageState {
            seq: before.seq + 1,
            t_mono_ns: stamp.mono.ns(),
            t_wall_ns: stamp.wall.ns(),
            x_mm,
            y_mm,
            z_mm,
            status: status.into(),
            ..before
        };
        self.latest.send_replace(state);
        // Without room nobody has read those before it, and without a reader nobody will: the next one tells as much.
        let _unread = self.reports.try_send(state);
        state
    }

    /// Tells it at a sampling of the sensor, which needs no timer of its own, if it moves or has stood for a while.
    fn report_if_due(&self) {
        let latest = *self.latest.borrow();
        let age = self.clock.now().mono.since(MonoTime::from_ns(latest.t_mono_ns));
        if latest.status() == StageStatus::Moving || age >= REPORT_STANDING_EVERY {
            self.report();
        }
    }

    /// Where it stands.
    fn stands(&self) -> Result<Point, StageError> {
        let state = self.report();
        let position_mm = [state.x_mm, state.y_mm, state.z_mm];
        if state.status() == StageStatus::Idle {
            Ok(position_mm)
        } else {
            Err(StageError::NotIdle { position_mm })
        }
    }

    fn check_travel(&self, to_mm: Point) -> Result<(), StageError> {
        for (axis, (mm, [least_mm, greatest_mm])) in
            AxisName::ALL.into_iter().zip(to_mm.into_iter().zip(self.travel_mm))
        {
            // NaN is outside all bounds.
            if !(mm >= least_mm && mm <= greatest_mm) {
                let command = format!("a move to {axis} = {mm:.3} mm");
                let reason = format!("its travel is {least_mm} to {greatest_mm} mm");
                return Err(StageError::Refused { command, reason });
            }
        }
        Ok(())
    }

    async fn go(&self, permit: Permit) -> Result<Point, StageError> {
        permit.check(self.clock.now().mono)?;
        let target = permit.target();
        self.check_travel(target.position_mm)?;
        let mut stops = self.stops.subscribe();
        let begun = Instant::now();
        let end = {
            let mut world = self.world.lock();
            world.settle(begun);
            let speed_mm_per_s = target.speed_mm_per_s.min(self.speed_max_mm_per_s);
            world.motion.push(target.position_mm, speed_mm_per_s, begun);
            world.motion.last_end()
        };
        let Some(end) = end else { return self.stands() };
        self.report();
        let reports = (end - begun).as_nanos().div_ceil(REPORT_EVERY.as_nanos());
        let known = begun + REPORT_EVERY * u32::try_from(reports).unwrap_or(u32::MAX);
        tokio::select! {
            biased;
            _stopped = stops.changed() => {
                self.world.lock().motion.freeze(Instant::now());
                let state = self.report();
                Err(StageError::Stopped { position_mm: [state.x_mm, state.y_mm, state.z_mm] })
            }
            () = sleep_until(known) => self.stands(),
        }
    }
}

impl Stage for UnwiredStage {
    fn state(&self) -> watch::Receiver<pb::StageState> {
        self.latest.subscribe()
    }

    fn home(&self, _: HomingPermit) -> BoxFuture<'_, Result<(), StageError>> {
        // It knows where it is.
        async { self.stands().map(drop) }.boxed()
    }

    fn move_to(&self, permit: Permit) -> BoxFuture<'_, Result<Point, StageError>> {
        self.go(permit).boxed()
    }

    fn look(&self) -> BoxFuture<'_, Result<Point, StageError>> {
        async { self.stands() }.boxed()
    }

    fn stop(&self) {
        self.stops.send_modify(|stops| *stops += 1);
    }

    fn watch(&self) {}

    fn driven(&self) -> MonoTime {
        self.clock.now().mono
    }

    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>> {
        // It has none.
        async { Ok(()) }.boxed()
    }
}

/// Where a stage with these axes can go. One that is missing always stands at 0.
fn reach_mm(rig: &Rig, travel_mm: [[f64; 2]; 3], has_axis: [bool; 3]) -> [[f64; 2]; 3] {
    let tolerance_mm = rig.service.as_ref().map_or(0.0, |service| service.motion.tolerance_mm);
    std::array::from_fn(|axis| if has_axis[axis] { travel_mm[axis] } else { [-tolerance_mm, tolerance_mm] })
}

/// Above the middle of the envelope, at the end of the travel or of the envelope.
fn start_mm(rig: &Rig, travel_mm: [[f64; 2]; 3], has_axis: [bool; 3]) -> Point {
    let [x_mm, y_mm, z_mm] = travel_mm;
    let [over_x_mm, over_y_mm, under_mm] = rig.service.as_ref().map_or([x_mm, y_mm, z_mm], |service| {
        let envelope = &service.envelope;
        [envelope.x_mm, envelope.y_mm, [z_mm[0], envelope.z_max_mm]]
    });
    let middle = |[least, greatest]: [f64; 2]| f64::midpoint(least, greatest);
    let start_mm = [middle(over_x_mm), middle(over_y_mm), under_mm[1].min(z_mm[1] - BELOW_END_MM)];
    std::array::from_fn(|axis| {
        let [least, greatest] = travel_mm[axis];
        if has_axis[axis] { start_mm[axis].max(least).min(greatest) } else { 0.0 }
    })
}
