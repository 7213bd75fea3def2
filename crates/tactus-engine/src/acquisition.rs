//! The acquisition task. Each frame goes to the safety supervisor, then to the recording, the run and the viewers.

use std::sync::Arc;

use tactus_device::{Sensor, SensorEvent};
use tactus_model::Covering;
use tactus_schema::rig::{OnGap, Service};
use tactus_schema::{Frame, MonoTime, Rig, pb};
use tokio::sync::{mpsc, oneshot};
use tokio::time::MissedTickBehavior;
use tracing::{error, info, warn};

use crate::average::{Average, Window};
use crate::engine::{Pulse, Shared};
use crate::outlet::{Record, RecordFailure};
use crate::run::Ending;
use crate::supervisor::{Supervisor, Violation};

/// Supervisor ticks between two publications of the run's state.
const TICKS_PER_STATE: u64 = 15;

/// State that each frame and stage report passes through, and that the run reads and sets.
pub(crate) struct Live {
    pub(crate) supervisor: Supervisor,
    pub(crate) tally: Tally,
    /// The covering in place. A script can have it changed; the change lasts beyond the run.
    pub(crate) covering: Covering,
    window: Option<Window>,
    recording: Option<Recording>,
    sensor_info: Option<pb::SensorInfo>,
    safety_seq: u64,
    clock_offset_s: Option<[f64; 2]>,
}

/// What the run in progress has received and lost.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tally {
    pub(crate) frames: u64,
    pub(crate) frames_lost: u64,
}

/// The recording of the run in progress.
struct Recording {
    sink: Box<dyn Record>,
    run_id: String,
    event_seq: u64,
    failure: Option<RecordFailure>,
}

/// Acquires until aborted.
pub(crate) async fn acquire(
    shared: Arc<Shared>,
    mut sensor: Box<dyn Sensor>,
    mut reports: mpsc::Receiver<pb::StageState>,
) {
    let mut tick = tokio::time::interval(shared.sample_period());
    tick.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut ticks = 0_u64;
    loop {
        tokio::select! {
            biased;
            event = sensor.next() => shared.on_sensor(event),
            Some(report) = reports.recv() => shared.on_report(&report),
            _ = tick.tick() => {
                shared.on_time();
                ticks += 1;
                if ticks.is_multiple_of(TICKS_PER_STATE) {
                    shared.refresh_state();
                }
            }
        }
    }
}

impl Live {
    pub(crate) fn new(rig: &Rig, service: &Service) -> Self {
        Self {
            supervisor: Supervisor::new(rig, service),
            tally: Tally::default(),
            covering: rig.covering,
            window: None,
            recording: None,
            sensor_info: None,
            safety_seq: 0,
            clock_offset_s: None,
        }
    }

    /// Averages the frames that arrive within `[from, until)`. Replaces an average that is still in progress.
    pub(crate) fn average(&mut self, from: MonoTime, until: MonoTime) -> oneshot::Receiver<Average> {
        let (window, average) = Window::open(from, until);
        self.window = Some(window);
        average
    }

    fn record(&mut self, write: impl FnOnce(&mut dyn Record) -> Result<(), RecordFailure>) -> Option<Ending> {
        let recording = self.recording.as_mut()?;
        if recording.failure.is_some() {
            return None;
        }
        let failure = write(recording.sink.as_mut()).err()?;
        error!(%failure, "the run fails");
        let ending = Ending::RecordFailed(failure.to_string());
        recording.failure = Some(failure);
        Some(ending)
    }
}

impl Shared {
    /// Records everything from now on into `sink`, until [`Shared::close_recording`].
    pub(crate) fn open_recording(&self, sink: Box<dyn Record>, run_id: String) {
        let now = self.clock.now();
        let report = *self.stage.state().borrow();
        let mut live = self.live();
        live.tally = Tally::default();
        live.recording = Some(Recording { sink, run_id, event_seq: 0, failure: None });
        let info = live.sensor_info.clone();
        let ending = live.record(|sink| {
            info.iter().try_for_each(|info| sink.sensor_info(info, now))?;
            sink.stage(&pb::StageState { t_mono_ns: now.mono.ns(), t_wall_ns: now.wall.ns(), ..report })
        });
        drop(live);
        self.end_with(ending);
    }

    /// Closes the recording.
    pub(crate) fn close_recording(&self) -> Result<(), RecordFailure> {
        let recording = self.live().recording.take();
        let Some(recording) = recording else { return Ok(()) };
        let closed = recording.sink.finish();
        recording.failure.map_or(closed, Err)
    }

    /// Records and publishes an event of the run in progress.
    pub(crate) fn emit(&self, event: pb::run_event::Event) {
        let now = self.clock.now();
        let mut live = self.live();
        let Some(recording) = live.recording.as_mut() else { return };
        let event = pb::RunEvent {
            seq: recording.event_seq,
            run_id: recording.run_id.clone(),
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            event: Some(event),
        };
        recording.event_seq += 1;
        let ending = live.record(|sink| sink.event(&event));
        drop(live);
        self.publish.event(&event);
        self.end_with(ending);
    }

    /// Records and publishes what the supervisor did.
    pub(crate) fn emit_safety(&self, verdict: pb::SafetyVerdict, rule: &str, detail: &str) {
        let now = self.clock.now();
        let mut live = self.live();
        let event = pb::SafetyEvent {
            seq: live.safety_seq,
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            verdict: verdict.into(),
            rule: rule.into(),
            detail: detail.into(),
        };
        live.safety_seq += 1;
        let ending = live.record(|sink| sink.safety(&event));
        drop(live);
        self.publish.safety(&event);
        self.end_with(ending);
    }

    /// Publishes the state of the run in progress as of now.
    pub(crate) fn refresh_state(&self) {
        let now = self.clock.now();
        let tally = self.live().tally;
        let fault = self.fault_text();
        self.state.send_if_modified(|state| {
            let active = !matches!(state.phase(), pb::RunPhase::Idle | pb::RunPhase::Finished);
            if active {
                let advanced_s = (now.mono.ns() - state.t_mono_ns) as f64 * 1e-9;
                state.t_mono_ns = now.mono.ns();
                state.elapsed_s += advanced_s;
                if state.remaining_s >= 0.0 && state.phase() == pb::RunPhase::Running {
                    state.remaining_s = (state.remaining_s - advanced_s).max(0.0);
                }
                state.frames = tally.frames;
                state.frames_lost = tally.frames_lost;
            }
            let is_news = state.fault != fault;
            state.fault = fault;
            active || is_news
        });
        self.publish.state(&self.state.borrow());
    }

    fn on_sensor(&self, event: SensorEvent) {
        match event {
            SensorEvent::Frame(frame) => self.on_frame(&frame),
            SensorEvent::Gap(gap) => self.on_gap(gap),
            SensorEvent::Connected(info) => self.on_connected(&info),
            SensorEvent::Lost(error) => {
                warn!(%error, "sensor lost");
                self.pulse.send_modify(|pulse| pulse.sensor_connected = false);
            }
        }
    }

    fn on_frame(&self, frame: &Frame) {
        let mut live = self.live();
        let violation = live.supervisor.on_frame(frame);
        self.stop_for(violation.as_ref());
        live.tally.frames += 1;
        live.tally.frames_lost += u64::from(frame.lost_before);
        let ending = live.record(|sink| sink.frame(frame));
        live.window = live.window.take().and_then(|window| window.take(frame));
        live.watch_clock(frame);
        let clock_offset_s = live.clock_offset_s;
        drop(live);
        self.pulse.send_modify(|pulse| {
            *pulse = Pulse {
                frames: pulse.frames + 1,
                frames_lost: pulse.frames_lost + u64::from(frame.lost_before),
                sensor_connected: true,
                last_frame: frame.received.mono,
                clock_offset_s,
                ..*pulse
            };
        });
        self.trip(violation);
        self.end_with(ending);
        self.publish.frame(frame);
    }

    fn on_gap(&self, gap: pb::Gap) {
        warn!(lost = gap.frames_lost, after = gap.after_seq, reason = gap.reason, "frames lost");
        let frames_lost = gap.frames_lost;
        self.emit(pb::run_event::Event::Gap(gap));
        if self.service.policy.on_gap == OnGap::Fail && self.live().recording.is_some() {
            self.end_with(Some(Ending::FramesLost(frames_lost)));
        }
    }

    fn on_connected(&self, info: &pb::SensorInfo) {
        info!(link = info.link, transport = info.transport, simulated = info.simulated, "sensor connected");
        let now = self.clock.now();
        let mut live = self.live();
        let ending = live.record(|sink| sink.sensor_info(info, now));
        live.sensor_info = Some(info.clone());
        live.clock_offset_s = None;
        drop(live);
        self.pulse.send_modify(|pulse| pulse.sensor_connected = true);
        self.end_with(ending);
        self.publish.sensor_info(info);
    }

    fn on_report(&self, report: &pb::StageState) {
        let mut live = self.live();
        let violation = live.supervisor.on_report(report);
        self.stop_for(violation.as_ref());
        let ending = live.record(|sink| sink.stage(report));
        drop(live);
        self.trip(violation);
        self.end_with(ending);
        self.publish.stage(report);
    }

    fn on_time(&self) {
        let now = self.clock.now().mono;
        let violation = self.live().supervisor.on_time(now);
        self.stop_for(violation.as_ref());
        self.pulse.send_modify(|pulse| pulse.supervised = now);
        self.trip(violation);
    }

    /// Stops motion and ends the run because a rule was broken, before anything else is done.
    fn stop_for(&self, violation: Option<&Violation>) {
        if let Some(violation) = violation {
            self.end(Ending::Safety(violation.clone()));
            self.stage.stop();
        }
    }

    /// Records and publishes a broken rule, after motion was stopped.
    fn trip(&self, violation: Option<Violation>) {
        let Some(violation) = violation else { return };
        error!(%violation, "safety stop");
        self.emit_safety(pb::SafetyVerdict::Stopped, violation.rule(), &violation.to_string());
    }

    fn end_with(&self, ending: Option<Ending>) {
        if let Some(ending) = ending {
            self.end(ending);
            self.stage.stop();
        }
    }
}

impl Live {
    /// Estimates the offset between the device's clock and the host's. A frame never arrives before it is sampled, so
    /// the least difference is the best estimate and the spread is its uncertainty.
    fn watch_clock(&mut self, frame: &Frame) {
        let tick_ns = self.sensor_info.as_ref().map_or(0, |info| info.tick_ns);
        let Some(tick) = frame.device_tick.filter(|_| tick_ns > 0) else { return };
        let offset_s = frame.received.mono.seconds() - tick.0 as f64 * tick_ns as f64 * 1e-9;
        self.clock_offset_s = Some(match self.clock_offset_s {
            Some([least_s, greatest_s]) => [least_s.min(offset_s), greatest_s.max(offset_s)],
            None => [offset_s; 2],
        });
    }
}
