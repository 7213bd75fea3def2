//! The acquisition task. It alone owns the supervisor and the recording; others ask it through a mailbox. Each frame goes to
//! the safety supervisor, then to the recording, the run and the viewers.

use std::future::poll_fn;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

use futures_util::FutureExt;
use tactus_device::{Sensor, SensorEvent};
use tactus_safety::{Fault, Supervisor, Violation};
use tactus_schema::rig::OnGap;
use tactus_schema::{Frame, MonoTime, pb};
use tokio::sync::{mpsc, oneshot};
use tokio::time::{sleep_until, timeout};
use tracing::{error, info, warn};

use crate::average::{Average, Window};
use crate::clock_watch::ClockWatch;
use crate::engine::{Pulse, Shared};
use crate::outlet::{Record, RecordFailure};
use crate::run::Ending;

/// Longest time between two looks at the clock. The stage's driver stops a stage that is unwatched for 80 ms.
const LOOK_MAX: Duration = Duration::from_millis(35);

/// The same for fast sensors, whose frames are closer together than this.
const LOOK_MIN: Duration = Duration::from_millis(10);

/// Without a frame, the look comes this late in sample periods: frames in time leave none to the timer.
const LOOK_PERIODS: f64 = 1.05;

/// What is done at each look, in words.
const CLOCK_CHECKED: &str = "the clock was checked";

/// Time between two publications of the run's state.
const STATE_PERIOD: Duration = Duration::from_millis(500);

/// Longest time until a question is answered: whoever asks must not hang with the task.
const ANSWER_MAX: Duration = Duration::from_secs(2);

/// Questions that may wait for the task. If there are more, the asking task waits.
const QUESTIONS_MAX: usize = 64;

/// State that each frame and stage report passes through, owned by the acquisition task.
pub(crate) struct Acquisition {
    pub(crate) supervisor: Supervisor,
    pub(crate) tally: Tally,
    shared: Arc<Shared>,
    window: Option<Window>,
    recording: Option<Recording>,
    sensor_info: Option<pb::SensorInfo>,
    safety_seq: u64,
    clock: ClockWatch,
    /// The last frame was too late to be fresh.
    is_late: bool,
    /// Longest time between two looks at the clock.
    look_period: Duration,
    /// When the clock was last looked at, and when the run's state was last published.
    looked: MonoTime,
    stated: MonoTime,
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

/// What a run leaves.
pub(crate) struct Ended {
    pub(crate) finished: pb::RunFinished,
    /// To be closed; and why it failed, if it did.
    pub(crate) recording: Option<(Box<dyn Record>, Option<RecordFailure>)>,
}

/// Something that the task does for somebody else, between two frames.
type Question = Box<dyn FnOnce(&mut Acquisition) + Send>;

/// Asks the acquisition task.
#[derive(Clone)]
pub(crate) struct Mailbox(mpsc::Sender<Question>);

/// The task's end of the mailbox.
pub(crate) struct Questions(mpsc::Receiver<Question>);

/// The acquisition task is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the acquisition task does not answer; this is a defect of Tactus: see the log, and restart the service"
)]
pub(crate) struct Gone;

/// A new mailbox.
pub(crate) fn mailbox() -> (Mailbox, Questions) {
    let (sender, questions) = mpsc::channel(QUESTIONS_MAX);
    (Mailbox(sender), Questions(questions))
}

impl Mailbox {
    /// The answer to a question.
    pub(crate) async fn ask<T: Send + 'static>(
        &self,
        question: impl FnOnce(&mut Acquisition) -> T + Send + 'static,
    ) -> Result<T, Gone> {
        let (answer, answered) = oneshot::channel();
        self.tell(move |acquisition| {
            // Who asked may have been interrupted meanwhile.
            let _unasked = answer.send(question(acquisition));
        })
        .await?;
        timeout(ANSWER_MAX, answered).await.map_err(|_| Gone)?.map_err(|_| Gone)
    }

    /// True if the task is gone for good, not only slow.
    pub(crate) fn is_closed(&self) -> bool {
        self.0.is_closed()
    }

    /// Has something done, in the order of the calls, without waiting for it.
    pub(crate) async fn tell(
        &self,
        what: impl FnOnce(&mut Acquisition) + Send + 'static,
    ) -> Result<(), Gone> {
        self.0.send(Box::new(what)).await.map_err(|_| Gone)
    }
}

/// Acquires until aborted.
pub(crate) async fn acquire(
    shared: Arc<Shared>,
    supervisor: Supervisor,
    mut questions: Questions,
    mut sensor: Box<dyn Sensor>,
    mut reports: mpsc::Receiver<pb::StageState>,
) {
    let clock = shared.clock;
    let mut acquisition = Acquisition::new(shared, supervisor);
    let mut has_sensor = true;
    let timer = sleep_until(clock.instant(acquisition.looked));
    tokio::pin!(timer);
    let mut handled = acquisition.attempt(CLOCK_CHECKED, Acquisition::on_time);
    loop {
        if let Err(when) = handled {
            acquisition.defect(when);
        }
        acquisition.publish_fault();
        let next_look = clock.instant(acquisition.looked.after(acquisition.look_period));
        if timer.deadline() != next_look {
            // A new one: a timer that is reset to a later time still wakes the runtime at the earlier one.
            timer.set(sleep_until(next_look));
        }
        // A panic of the driver's, or of what handles its frames, must neither end the supervision nor go unnoticed.
        let next = AssertUnwindSafe(poll_fn(|context| sensor.poll_next(context))).catch_unwind();
        handled = tokio::select! {
            biased;
            event = next, if has_sensor => {
                if let Ok(event) = event {
                    acquisition.attempt("a frame was handled", |this| this.on_sensor(event))
                } else {
                    has_sensor = false;
                    acquisition.shared.pulse.send_modify(|pulse| pulse.sensor_connected = false);
                    acquisition.shared.sensor_broke_off.send_replace(true);
                    Err("the sensor was read")
                }
            }
            Some(report) = reports.recv() => {
                acquisition.attempt("a stage report was handled", |this| this.on_report(&report))
            }
            Some(question) = questions.0.recv() => {
                acquisition.attempt("the run was answered", |this| question(this))
            }
            () = &mut timer => acquisition.attempt(CLOCK_CHECKED, Acquisition::on_time),
        };
    }
}

impl Acquisition {
    fn new(shared: Arc<Shared>, supervisor: Supervisor) -> Self {
        let now = shared.clock.now().mono;
        Self {
            supervisor,
            look_period: shared.sample_period().mul_f64(LOOK_PERIODS).clamp(LOOK_MIN, LOOK_MAX),
            looked: now,
            stated: now,
            tally: Tally::default(),
            shared,
            window: None,
            recording: None,
            sensor_info: None,
            safety_seq: 0,
            clock: ClockWatch::default(),
            is_late: false,
        }
    }

    /// Does something; the error says during what it panicked.
    fn attempt(&mut self, when: &'static str, what: impl FnOnce(&mut Self)) -> Result<(), &'static str> {
        catch_unwind(AssertUnwindSafe(|| what(self))).map_err(|_| when)
    }

    /// After a panic: stops, and lets nothing but the way up follow.
    fn defect(&mut self, when: &str) {
        // Once: the tip must be able to rise although it happens at each frame.
        if !matches!(self.supervisor.fault(), Some(Fault::Defect(_))) {
            self.shared.stop_motion();
        }
        error!("a panic while {when}: the stage is stopped; this is a defect of Tactus");
        let why = format!("a panic while {when}");
        self.shared.end(Ending::Defect(why.clone()));
        self.supervisor.latch(Fault::Defect(why));
    }

    fn publish_fault(&self) {
        let fault = self.supervisor.fault();
        self.shared.fault.send_if_modified(|known| {
            let is_news = *known != fault;
            if is_news {
                *known = fault;
            }
            is_news
        });
    }

    // --- what happens -------------------------------------------------------------------------------------------------

    fn on_sensor(&mut self, event: SensorEvent) {
        match event {
            SensorEvent::Frame(frame) => self.on_frame(&frame),
            SensorEvent::Gap(gap) => self.on_gap(gap),
            SensorEvent::Connected(info) => self.on_connected(&info),
            SensorEvent::Lost(error) => {
                warn!(%error, "sensor lost");
                self.shared.pulse.send_modify(|pulse| pulse.sensor_connected = false);
            }
        }
    }

    fn on_frame(&mut self, frame: &Frame) {
        // First of all: may stop the stage before anything else is done with the frame.
        let violation = self.supervisor.on_frame(frame);
        self.stop_for(violation.as_ref());
        self.tally.frames += 1;
        self.tally.frames_lost += u64::from(frame.lost_before);
        self.record(|sink| sink.frame(frame));
        let late_s = self.supervisor.late_s();
        self.window = self.window.take().and_then(|window| window.take(frame, late_s.is_some()));
        self.tell_late(late_s);
        self.watch_clock(frame);
        let clock_offset_s = self.clock.offset_s();
        self.beat(|pulse| {
            *pulse = Pulse {
                frames: pulse.frames + 1,
                frames_lost: pulse.frames_lost + u64::from(frame.lost_before),
                sensor_connected: true,
                last_frame: frame.received.mono,
                clock_offset_s,
                ..*pulse
            };
        });
        self.tell_violation(violation);
        // Who moves the stage asks this task for each permit, after the claim: while it waits here, nothing can begin.
        if self.recording.is_none() && !self.shared.control.borrow().claimed {
            self.shared.publish.frame_at_rest(frame);
        } else {
            self.shared.publish.frame(frame);
        }
        // The task is awake: it need not wake for the clock. After a late frame, the ones in time may wait behind it.
        if late_s.is_none() && frame.received.mono.since(self.looked) >= self.look_period / 2 {
            self.on_time();
        }
    }

    fn on_gap(&mut self, gap: pb::Gap) {
        warn!(lost = gap.frames_lost, after = gap.after_seq, reason = gap.reason, "frames lost");
        let frames_lost = gap.frames_lost;
        self.emit(pb::run_event::Event::Gap(gap));
        let is_a_failure = self.shared.service.policy.on_gap == OnGap::Fail && self.recording.is_some();
        // Once: the tip must be able to rise although more are lost.
        if is_a_failure && self.shared.end(Ending::FramesLost(frames_lost)) {
            self.shared.stop_motion();
        }
    }

    fn on_connected(&mut self, info: &pb::SensorInfo) {
        info!(link = info.link, transport = info.transport, simulated = info.simulated, "sensor connected");
        let violation = self.supervisor.on_connected();
        self.supervisor.set_tick(info.tick_ns);
        self.stop_for(violation.as_ref());
        self.window.iter_mut().for_each(Window::disturb);
        let now = self.shared.clock.now();
        self.record(|sink| sink.sensor_info(info, now));
        self.sensor_info = Some(info.clone());
        self.clock = ClockWatch::default();
        self.shared.pulse.send_modify(|pulse| pulse.sensor_connected = true);
        self.tell_violation(violation);
        self.shared.publish.sensor_info(info);
    }

    fn on_report(&mut self, report: &pb::StageState) {
        let violation = self.supervisor.on_report(report);
        self.stop_for(violation.as_ref());
        if report.status() != pb::StageStatus::Idle {
            // Who waits for the average is told at once: a dwell may be long.
            self.window = None;
        }
        self.record(|sink| sink.stage(report));
        self.tell_violation(violation);
        self.shared.publish.stage(report);
    }

    fn on_time(&mut self) {
        let now = self.shared.clock.now().mono;
        self.looked = now;
        let violation = self.supervisor.on_time(now);
        self.stop_for(violation.as_ref());
        self.shared.stage.watch();
        let stage_driven = self.shared.stage.driven();
        self.beat(|pulse| {
            pulse.supervised = now;
            pulse.stage_driven = stage_driven;
        });
        self.record(|sink| sink.check(now));
        if let Some(alarm) = self.recording.as_mut().and_then(|recording| recording.sink.alarm()) {
            self.emit(pb::run_event::Event::Log(pb::Log { message: alarm }));
        }
        self.tell_violation(violation);
        if now.since(self.stated) >= STATE_PERIOD {
            self.stated = now;
            self.refresh_state();
        }
    }

    /// Stops motion and ends the run because a rule was broken, before anything else is done.
    fn stop_for(&self, violation: Option<&Violation>) {
        if let Some(violation) = violation {
            self.end_run(Ending::Safety(violation.clone()));
        }
    }

    /// Tells once that frames arrive late, until they are in time again.
    fn tell_late(&mut self, late_s: Option<f64>) {
        if let Some(late_s) = late_s.filter(|_| !self.is_late) {
            warn!(
                late_s,
                "frames arrive late by the sensor's clock, and do not count as fresh: its link, or this computer, is too slow, or the \
                 link file's tick is wrong"
            );
        }
        self.is_late = late_s.is_some();
    }

    /// Records and publishes a broken rule, after motion was stopped.
    fn tell_violation(&mut self, violation: Option<Violation>) {
        let Some(violation) = violation else { return };
        error!(%violation, "safety stop");
        self.emit_safety(pb::SafetyVerdict::Stopped, violation.rule(), &violation.to_string());
    }

    /// Updates the pulse. To wake nobody costs as much as to wake somebody, and there are two of these for each frame. Who begins to
    /// wait at this moment is woken by the next.
    fn beat(&self, update: impl FnOnce(&mut Pulse)) {
        let is_awaited = self.shared.pulse.receiver_count() > 0;
        self.shared.pulse.send_if_modified(|pulse| {
            update(pulse);
            is_awaited
        });
    }

    fn end_run(&self, ending: Ending) {
        self.shared.end(ending);
        self.shared.stop_motion();
    }

    /// Compares the device's clock with the host's.
    fn watch_clock(&mut self, frame: &Frame) {
        let tick_ns = self.sensor_info.as_ref().map_or(0, |info| info.tick_ns);
        let Some(tick) = frame.device_tick.filter(|_| tick_ns > 0) else { return };
        self.clock.take(frame.received.mono, tick.0 as f64 * tick_ns as f64 * 1e-9);
    }

    // --- what is asked ------------------------------------------------------------------------------------------------

    /// Averages the frames that arrive within `[from, until)`. Replaces an average that is still in progress.
    pub(crate) fn average(&mut self, from: MonoTime, until: MonoTime) -> oneshot::Receiver<Average> {
        let (window, average) = Window::open(from, until);
        self.window = Some(window);
        average
    }

    /// Records everything from now on into `sink`, until [`Self::end`].
    pub(crate) fn open_recording(&mut self, sink: Box<dyn Record>, run_id: String) {
        let now = self.shared.clock.now();
        let report = *self.shared.stage.state().borrow();
        self.tally = Tally::default();
        self.recording = Some(Recording { sink, run_id, event_seq: 0, failure: None });
        let info = self.sensor_info.clone();
        self.record(|sink| {
            info.iter().try_for_each(|info| sink.sensor_info(info, now))?;
            sink.stage(&pb::StageState { t_mono_ns: now.mono.ns(), t_wall_ns: now.wall.ns(), ..report })
        });
    }

    /// Ends the run: nothing is permitted to it any more, and `finished` is the last that its recording takes, with the counts
    /// of what it holds. It remains to close the recording, which may take long.
    pub(crate) fn end(&mut self, finished: impl FnOnce(Tally) -> pb::RunFinished) -> Ended {
        self.supervisor.end();
        let finished = finished(self.tally);
        self.emit(pb::run_event::Event::Finished(finished.clone()));
        let recording = self.recording.take().map(|recording| (recording.sink, recording.failure));
        Ended { finished, recording }
    }

    /// Records and publishes an event of the run in progress.
    pub(crate) fn emit(&mut self, event: pb::run_event::Event) {
        let now = self.shared.clock.now();
        let Some(recording) = self.recording.as_mut() else { return };
        let event = pb::RunEvent {
            seq: recording.event_seq,
            run_id: recording.run_id.clone(),
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            event: Some(event),
        };
        recording.event_seq += 1;
        self.record(|sink| sink.event(&event));
        self.shared.publish.event(&event);
    }

    /// Records and publishes what the supervisor did.
    pub(crate) fn emit_safety(&mut self, verdict: pb::SafetyVerdict, rule: &str, detail: &str) {
        let now = self.shared.clock.now();
        let event = pb::SafetyEvent {
            seq: self.safety_seq,
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            verdict: verdict.into(),
            rule: rule.into(),
            detail: detail.into(),
        };
        self.safety_seq += 1;
        self.record(|sink| sink.safety(&event));
        self.shared.publish.safety(&event);
        self.shared.safety.send_replace(Some(event));
    }

    /// Publishes the state of the run in progress as of now.
    pub(crate) fn refresh_state(&mut self) {
        let now = self.shared.clock.now();
        let tally = self.tally;
        let fault = self.supervisor.fault().map_or_else(String::new, |fault| fault.to_string());
        self.shared.state.send_if_modified(|state| {
            let is_active = !matches!(state.phase(), pb::RunPhase::Idle | pb::RunPhase::Finished);
            if is_active {
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
            is_active || is_news
        });
        self.shared.publish.state(&self.shared.state.borrow());
    }

    /// Writes to the recording of the run in progress. The first failure ends the run; what comes after it is still offered,
    /// because the recording counts what it cannot keep.
    fn record(&mut self, write: impl FnOnce(&mut dyn Record) -> Result<(), RecordFailure>) {
        let Some(recording) = self.recording.as_mut() else { return };
        if let Err(failure) = write(recording.sink.as_mut())
            && recording.failure.is_none()
        {
            error!(%failure, "the run fails");
            let ending = Ending::RecordFailed(failure.to_string());
            recording.failure = Some(failure);
            self.end_run(ending);
        }
    }
}
