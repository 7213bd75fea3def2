//! Execution of each step of a script.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tactus_model::Covering;
use tactus_plan::{Call, MeanReading, Position, Press, Reply, Step};
use tactus_safety::Denied;
use tactus_schema::pb::{self, run_event::Event};
use tactus_schema::rig::OnGap;
use tactus_schema::table::Phase;
use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};
use tracing::{Instrument as _, info, info_span, warn};

use super::{Broken, Run};
use crate::average::Average;

/// Repetitions of one press before the run fails.
const REPEATS_MAX: u32 = 3;

/// Sample periods to wait for an average beyond its end.
const LATE_PERIODS_MAX: u32 = 5;

/// Least of that time, for fast sensors: links deliver in batches.
const LATE_MIN: Duration = Duration::from_millis(100);

/// Longest time to store which covering is in place.
const REMEMBER_PATIENCE: Duration = Duration::from_secs(10);

impl Run {
    /// Checks a step against the envelope and performs it.
    pub(super) async fn perform(&mut self, call: &Call) -> Result<Reply, Broken> {
        self.hold_while_paused().await?;
        if let Some(reply) = self.taken_over(call).await? {
            return Ok(reply);
        }
        self.bounds.check(&call.step)?;
        let step = self.steps;
        self.steps += 1;
        self.emit(Event::StepStarted(pb::StepStarted {
            step,
            what: describe(&call.step),
            at: call.at.to_string(),
            step_json: to_json(&call.step),
        }))
        .await;
        let span =
            info_span!("step", number = step.cast_signed(), what = describe(&call.step), at = %call.at);
        let reply = self.act(&call.step).instrument(span).await?;
        let height_mm = if let Reply::Position { height_mm, .. } = &reply { Some(*height_mm) } else { None };
        self.emit(Event::StepDone(pb::StepDone { step, height_mm })).await;
        Ok(reply)
    }

    async fn act(&mut self, step: &Step) -> Result<Reply, Broken> {
        match step {
            Step::Move { to, height_mm, speed_mm_per_s } => {
                self.go_to(*to, *height_mm, *speed_mm_per_s).await
            }
            Step::Press(press) => self.press(press).await.map(Reply::Pressed),
            Step::Dwell { duration_s } => {
                self.wait(self.shared.service.motion.settle_s).await?;
                self.read(*duration_s).await
            }
            Step::Read { duration_s } => self.read(*duration_s).await,
            Step::Tare { duration_s } => self.tare(*duration_s).await,
            Step::Wait { duration_s } => self.wait(*duration_s).await.map(|()| Reply::Done),
            Step::Log { message } => {
                info!(script = self.order.script.name(), "{message}");
                self.emit(Event::Log(pb::Log { message: message.clone() })).await;
                Ok(Reply::Done)
            }
            Step::Covering { thickness_mm } => self.change_covering(*thickness_mm).await,
        }
    }

    /// Waits while the run is paused. Every press ends at the safe height, so a paused run does not press.
    async fn hold_while_paused(&mut self) -> Result<(), Broken> {
        let paused_by = self.shared.control.borrow().paused.clone();
        let Some(by) = paused_by else { return self.shared.check_ended() };
        self.pause(by, "paused: `tactus resume` goes on, `tactus stop` ends the run").await
    }

    /// Waits until the run is resumed.
    async fn pause(&mut self, by: String, message: &str) -> Result<(), Broken> {
        self.set_state(pb::RunPhase::Paused, message).await;
        self.emit(Event::Paused(pb::Paused { by })).await;
        let by = self.resumed().await?;
        self.emit(Event::Resumed(pb::Resumed { by })).await;
        self.set_state(pb::RunPhase::Running, "").await;
        Ok(())
    }

    /// Waits until the run is resumed; returns by whom.
    async fn resumed(&self) -> Result<String, Broken> {
        let mut control = self.shared.control.subscribe();
        let going_on = async { control.wait_for(|control| control.paused.is_none()).await.is_ok() };
        self.shared.unless_ended(going_on).await?;
        self.shared.check_ended()?;
        Ok(self.shared.control.borrow().resumed_by.clone())
    }

    pub(super) async fn go_to(
        &mut self,
        to: Position,
        height_mm: Option<f64>,
        speed_mm_per_s: Option<f64>,
    ) -> Result<Reply, Broken> {
        let motion = self.shared.service.motion;
        let to_mm = self.shared.rig.registration.to_robot([to.x_mm, to.y_mm]);
        let z_mm = height_mm.unwrap_or(motion.safe_height_mm);
        self.note_travel(to_mm, z_mm);
        self.shared.travel(to_mm, z_mm, speed_mm_per_s.unwrap_or(motion.travel_speed_mm_per_s)).await?;
        Ok(Reply::Position { x_mm: to.x_mm, y_mm: to.y_mm, height_mm: self.shared.position_mm()[2] })
    }

    /// Presses. Repeats the press if frames were lost and the rig's policy says so.
    async fn press(&mut self, press: &Press) -> Result<Vec<MeanReading>, Broken> {
        let mut repeats = 0;
        loop {
            let index = self.next_press;
            self.next_press += 1;
            let broken = match self.press_once(press, index).await {
                Ok(readings) => {
                    self.presses += 1;
                    self.dwells += u32::try_from(readings.len()).unwrap_or(u32::MAX);
                    self.set_state(pb::RunPhase::Running, "").await;
                    return Ok(readings);
                }
                Err(broken) => broken,
            };
            if !self.may_repeat(&broken) {
                return Err(broken);
            }
            if repeats == REPEATS_MAX {
                return Err(in_vain("the press", broken));
            }
            repeats += 1;
            warn!(press = index, %broken, "press broken off; it will be repeated");
            self.emit(Event::PressRepeated(pb::PressRepeated { press: index, reason: broken.to_string() }))
                .await;
            let told = format!("repeats a press, {repeats} of at most {REPEATS_MAX} times: {broken}");
            self.set_state(pb::RunPhase::Running, &told).await;
            self.recover().await?;
        }
    }

    async fn press_once(&mut self, press: &Press, index: i32) -> Result<Vec<MeanReading>, Broken> {
        let motion = self.shared.service.motion;
        let at_mm = self.shared.rig.registration.to_robot([press.at.x_mm, press.at.y_mm]);
        let speed_mm_per_s = press.speed_mm_per_s.unwrap_or(motion.load_speed_mm_per_s);
        self.note_travel(at_mm, motion.safe_height_mm);
        self.set_phase(Phase::Approach, index).await;
        match press.approach_from_mm {
            Some([dx_mm, dy_mm]) => {
                let aside = [press.at.x_mm + dx_mm, press.at.y_mm + dy_mm];
                let aside_mm = self.shared.rig.registration.to_robot(aside);
                self.note_travel(aside_mm, motion.approach_height_mm);
                self.shared.travel(aside_mm, motion.approach_height_mm, motion.travel_speed_mm_per_s).await?;
                self.shared.slide(at_mm, motion.travel_speed_mm_per_s).await?;
            }
            None => {
                self.shared.travel(at_mm, motion.approach_height_mm, motion.travel_speed_mm_per_s).await?;
            }
        }
        self.shared.descend(at_mm, 0.0, speed_mm_per_s).await?;
        let mut readings = Vec::with_capacity(press.depths_mm.len());
        let mut depth_before_mm = 0.0;
        for (dwell, &depth_mm) in (0_u32..).zip(&press.depths_mm) {
            let deeper = depth_mm >= depth_before_mm;
            self.set_phase(if deeper { Phase::Load } else { Phase::Unload }, index).await;
            self.note_travel(at_mm, -depth_mm);
            self.shared.descend(at_mm, -depth_mm, speed_mm_per_s).await?;
            self.set_phase(Phase::Hold, index).await;
            readings.push(self.hold(press, index, dwell, [at_mm[0], at_mm[1], -depth_mm]).await?);
            depth_before_mm = depth_mm;
        }
        if depth_before_mm > 0.0 {
            self.set_phase(Phase::Unload, index).await;
            self.shared.descend(at_mm, 0.0, speed_mm_per_s).await?;
        }
        self.set_phase(Phase::Retract, index).await;
        self.shared.descend(at_mm, motion.safe_height_mm, motion.travel_speed_mm_per_s).await?;
        self.set_phase(Phase::Idle, -1).await;
        Ok(readings)
    }

    /// One dwell: waits for the settling time, then averages. The stage must stand idle in its place, at the same epoch, at
    /// the start, at the end and in between.
    async fn hold(
        &self,
        press: &Press,
        index: i32,
        dwell: u32,
        tip_mm: [f64; 3],
    ) -> Result<MeanReading, Broken> {
        let epoch = self.shared.stands_at(tip_mm).await?;
        self.wait(self.shared.service.motion.settle_s).await?;
        let average = self.still_average(tip_mm, epoch, Duration::from_secs_f64(press.dwell_s)).await?;
        self.emit(Event::DwellDone(pb::DwellDone {
            press: index,
            dwell,
            x_mm: press.at.x_mm,
            y_mm: press.at.y_mm,
            depth_mm: -tip_mm[2],
            frames: average.frames,
            mean_counts: as_f32(&average.mean_counts),
            from_mono_ns: average.span[0].ns(),
            to_mono_ns: average.span[1].ns(),
        }))
        .await;
        Ok(self.reading(average))
    }

    fn may_repeat(&self, broken: &Broken) -> bool {
        let lost = matches!(
            broken,
            Broken::FramesLost(_) | Broken::SensorSilent(_) | Broken::Denied(Denied::NoZero)
        );
        let is_silence = matches!(broken, Broken::Ended(ending) if ending.is_silence());
        (lost || is_silence) && self.shared.service.policy.on_gap == OnGap::Repeat
    }

    /// After frames were lost: raises the tip, and goes on once the sensor is back.
    async fn recover(&mut self) -> Result<(), Broken> {
        self.set_phase(Phase::Retract, -1).await;
        self.shared.retract().await?;
        self.set_phase(Phase::Idle, -1).await;
        self.shared.await_the_sensors_return().await?;
        if !self.shared.acquisition.ask(|live| live.supervisor.has_zero()).await? {
            // It connected anew: its zeros may be others now.
            self.take_reference().await?;
        }
        Ok(())
    }

    /// As [`Self::recover`], and goes back to where the tip was.
    async fn recover_in_place(&mut self) -> Result<(), Broken> {
        let motion = self.shared.service.motion;
        let [x_mm, y_mm, z_mm] = self.shared.position_mm();
        if z_mm >= motion.safe_height_mm - motion.tolerance_mm {
            return self.shared.await_the_sensors_return().await;
        }
        // In a box, because it may take an average itself.
        Box::pin(self.recover()).await?;
        self.shared.travel([x_mm, y_mm], z_mm, motion.load_speed_mm_per_s).await
    }

    async fn read(&mut self, duration_s: f64) -> Result<Reply, Broken> {
        let average = self.whole_average(Duration::from_secs_f64(duration_s)).await?;
        self.emit(Event::ReadDone(pb::ReadDone {
            frames: average.frames,
            mean_counts: as_f32(&average.mean_counts),
            from_mono_ns: average.span[0].ns(),
            to_mono_ns: average.span[1].ns(),
        }))
        .await;
        Ok(Reply::Reading(self.reading(average)))
    }

    pub(super) async fn tare(&mut self, duration_s: f64) -> Result<Reply, Broken> {
        let average = self.whole_average(Duration::from_secs_f64(duration_s)).await?;
        self.emit(Event::TareDone(pb::TareDone {
            frames: average.frames,
            baseline_counts: as_f32(&average.mean_counts),
            from_mono_ns: average.span[0].ns(),
            to_mono_ns: average.span[1].ns(),
        }))
        .await;
        let counts = average.mean_counts.clone();
        if let Err(violation) =
            self.shared.acquisition.ask(move |live| live.supervisor.set_tare(&counts)).await?
        {
            self.refused(violation.rule(), violation.to_string()).await?;
        }
        self.zero_counts.clone_from(&average.mean_counts);
        Ok(Reply::Reading(self.reading(average)))
    }

    async fn wait(&self, duration_s: f64) -> Result<(), Broken> {
        self.shared.unless_ended(sleep(Duration::from_secs_f64(duration_s))).await
    }

    /// Has another covering put in place. A person confirms it by its value; the confirmed one outlives the run. A thinner one
    /// is the limit from when it is asked for: it may be in place although nobody confirms it.
    pub(super) async fn change_covering(&mut self, thickness_mm: f64) -> Result<Reply, Broken> {
        let covering = Covering { thickness_mm };
        let before = *self.shared.covering.borrow();
        if covering == before && !self.shared.is_covering_asked.load(Ordering::SeqCst) {
            return Ok(Reply::Done);
        }
        self.shared.retract().await?;
        let is_thinner = thickness_mm <= before.thickness_mm;
        if is_thinner {
            self.shared.is_covering_asked.store(true, Ordering::SeqCst);
            // First the limit: it holds although the disk fails.
            self.limit_depth(covering).await?;
            self.remember_covering(thickness_mm).await?;
        }
        if let Some(change) = &self.shared.change_covering {
            change(thickness_mm);
        } else {
            let ask = format!(
                "put the {thickness_mm} mm covering in place, set its surface to z = 0, then `tactus resume \
                 --covering-mm {thickness_mm}`"
            );
            self.shared.control.send_modify(|control| {
                control.paused = Some("the script".into());
                control.wanted_covering_mm = Some(thickness_mm);
            });
            self.shared.acquisition.ask(|live| live.supervisor.rest()).await?;
            self.pause("the script".into(), &ask).await?;
            // Under another covering the array reads otherwise without a load.
            self.shared.acquisition.ask(|live| live.supervisor.begin_run()).await?;
            self.take_reference().await?;
        }
        if !is_thinner {
            self.remember_covering(thickness_mm).await?;
            self.limit_depth(covering).await?;
        }
        self.shared.is_covering_asked.store(false, Ordering::SeqCst);
        self.emit(Event::CoveringChanged(pb::CoveringChanged { covering_mm: thickness_mm })).await;
        Ok(Reply::Done)
    }

    /// Limits the depth as a covering allows, from now on.
    async fn limit_depth(&mut self, covering: Covering) -> Result<(), Broken> {
        self.bounds = self.bounds.clone().under(covering);
        self.shared.covering.send_replace(covering);
        Ok(self.shared.acquisition.ask(move |live| live.supervisor.set_covering(covering)).await?)
    }

    /// Has the covering in place remembered. The disk is waited for on a thread of its own.
    async fn remember_covering(&self, thickness_mm: f64) -> Result<(), Broken> {
        let Some(memory) = self.shared.covering_memory.clone() else { return Ok(()) };
        let storing = spawn_blocking(move || memory.remember(thickness_mm));
        let stored = match timeout(REMEMBER_PATIENCE, storing).await {
            Ok(Ok(stored)) => stored,
            Ok(Err(panic)) => Err(panic.into()),
            Err(late) => Err(late.into()),
        };
        stored.map_err(|error| {
            Broken::Refused(format!("the covering in place cannot be stored: {error}; see the disk"))
        })
    }

    /// An average outside a press. Repeated if frames were lost and the rig's policy says so: below the safe height the tip is
    /// raised first, and goes back to its place for the repetition.
    pub(super) async fn whole_average(&mut self, duration: Duration) -> Result<Average, Broken> {
        let mut repeats = 0;
        loop {
            let broken = match self.average_in_place(duration).await {
                Ok(average) => return Ok(average),
                Err(broken) => broken,
            };
            if !self.may_repeat(&broken) {
                return Err(broken);
            }
            if repeats == REPEATS_MAX {
                return Err(in_vain("the reading", broken));
            }
            repeats += 1;
            warn!(%broken, "average broken off; it will be repeated");
            self.recover_in_place().await?;
        }
    }

    /// As [`Self::still_average`], where the stage stands now.
    async fn average_in_place(&self, duration: Duration) -> Result<Average, Broken> {
        let tip_mm = self.shared.position_mm();
        let epoch = self.shared.stands_at(tip_mm).await?;
        self.still_average(tip_mm, epoch, duration).await
    }

    /// An average without lost frames. The stage must stand idle in its place, at the same epoch, until its end.
    async fn still_average(
        &self,
        tip_mm: [f64; 3],
        epoch: u32,
        duration: Duration,
    ) -> Result<Average, Broken> {
        let averaged = self.average(duration).await;
        if let Err(broken) = &averaged
            && !matches!(broken, Broken::Disturbed)
        {
            return averaged;
        }
        // Asked also after a disturbance: the stage's answer, such as an alarm, says more.
        let is_same = self.shared.stands_at(tip_mm).await? == epoch;
        let average = averaged?;
        if average.lost > 0 {
            return Err(Broken::FramesLost(average.lost));
        }
        if average.is_disturbed || !is_same {
            return Err(Broken::Disturbed);
        }
        Ok(average)
    }

    /// The mean over the frames that arrive within the next `duration`. It ends at once if the stage does not stand idle.
    pub(super) async fn average(&self, duration: Duration) -> Result<Average, Broken> {
        let now = self.shared.clock.now().mono;
        let until = now.after(duration);
        let average = self.shared.acquisition.ask(move |live| live.average(now, until)).await?;
        let patience = duration + (self.shared.sample_period() * LATE_PERIODS_MAX).max(LATE_MIN);
        match self.shared.unless_ended(timeout(patience, average)).await? {
            Ok(Ok(average)) => Ok(average),
            Ok(Err(_)) => Err(Broken::Disturbed),
            Err(_) => Err(Broken::SensorSilent(patience.as_secs_f64())),
        }
    }

    fn reading(&self, average: Average) -> MeanReading {
        let signal =
            average.mean_counts.iter().zip(&self.zero_counts).map(|(count, zero)| count - zero).collect();
        MeanReading {
            mean_counts: average.mean_counts,
            signal,
            rms: average.rms_counts,
            frames: average.frames,
        }
    }

    fn note_travel(&mut self, [x_mm, y_mm]: [f64; 2], z_mm: f64) {
        for (range, value) in self.travel_mm.iter_mut().zip([x_mm, y_mm, z_mm]) {
            *range = [range[0].min(value), range[1].max(value)];
        }
    }
}

/// Why a step fails after its last repetition.
fn in_vain(what: &'static str, last: Broken) -> Broken {
    Broken::RepeatedInVain { what, times: REPEATS_MAX, last: Box::new(last) }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "messages carry single precision, far finer than a count"
)]
pub(super) fn as_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}

/// The step as a run that goes on with this one reads it.
pub(super) fn to_json(step: &Step) -> String {
    // It cannot fail: all keys are texts.
    serde_json::to_string(step).unwrap_or_default()
}

pub(super) fn describe(step: &Step) -> String {
    match step {
        Step::Move { to, height_mm, .. } => match height_mm {
            Some(height_mm) => format!("move to ({:.3}, {:.3}) mm at {height_mm:.3} mm", to.x_mm, to.y_mm),
            None => format!("move to ({:.3}, {:.3}) mm", to.x_mm, to.y_mm),
        },
        Step::Press(press) => {
            let depths: Vec<_> = press.depths_mm.iter().map(|depth| format!("{depth:.3}")).collect();
            format!(
                "press at ({:.3}, {:.3}) mm, depths {} mm",
                press.at.x_mm,
                press.at.y_mm,
                depths.join(", ")
            )
        }
        Step::Dwell { duration_s } => format!("dwell {duration_s} s"),
        Step::Read { duration_s } => format!("read {duration_s} s"),
        Step::Tare { duration_s } => format!("tare over {duration_s} s"),
        Step::Wait { duration_s } => format!("wait {duration_s} s"),
        Step::Log { .. } => "log".to_owned(),
        Step::Covering { thickness_mm } => format!("covering of {thickness_mm} mm"),
    }
}
