//! The supervisor: it sees every frame and every stage report first, and nothing moves without its permit.

use std::time::Duration;

use tactus_model::Covering;
use tactus_schema::pb::StageStatus;
use tactus_schema::rig::Service;
use tactus_schema::{Frame, MonoTime, Rig, pb};

use crate::contact::Contact;
use crate::force::Elements;
use crate::lateness::Lateness;
use crate::limits::{Limits, REPORT_AGE_MAX_S, STEP_DOWN_MAX_MM};
use crate::{Denied, Fault, HomingPermit, Permit, Revocation, Target, Violation};

/// Watches one rig. The caller stops the stage whenever a method returns a [`Violation`].
#[derive(Debug)]
pub struct Supervisor {
    limits: Limits,
    elements: Elements,
    lateness: Lateness,
    /// By how much the last frame was late, if by too much.
    late_s: Option<f64>,
    /// When it arrived.
    arrived: Option<MonoTime>,
    contact: Contact,
    permits: Revocation,
    /// The last report of the stage.
    report: Option<pb::StageState>,
    /// The last known height of the tip.
    z_mm: Option<f64>,
    /// The last known height when the last frame arrived.
    z_at_frame_mm: Option<f64>,
    /// What a reset must clear; [`Self::fault`] adds the silence and what the stage reports.
    fault: Option<Fault>,
    /// Why the tip was not retracted before the reset under way. Only a finished one ends it.
    not_retracted: Option<Fault>,
    /// A silence of the sensor, which its return may end. It stands beside the fault, so that nothing else ends with it.
    silence: Option<Violation>,
    /// True while somebody may move the stage: loads count then at any height.
    is_active: bool,
    has_sensor: bool,
}

impl Supervisor {
    /// A supervisor for a rig with the covering that its description names. It wants a reset before anything moves.
    pub fn new(rig: &Rig, service: &Service) -> Self {
        let limits = Limits::new(rig, service);
        Self {
            elements: Elements::new(rig, service),
            lateness: Lateness::default(),
            late_s: None,
            arrived: None,
            contact: Contact::new(rig, service),
            limits,
            permits: Revocation::default(),
            report: None,
            z_mm: None,
            z_at_frame_mm: None,
            fault: Some(Fault::Started),
            not_retracted: None,
            silence: None,
            is_active: false,
            has_sensor: true,
        }
    }

    /// A supervisor for a stage alone, as for a check of the stage by hand. It permits no step down below the safe height;
    /// above it x and y are free, because homing may end outside the envelope.
    pub fn without_sensor(rig: &Rig, service: &Service) -> Self {
        let mut supervisor =
            Self { fault: None, is_active: true, has_sensor: false, ..Self::new(rig, service) };
        let envelope = &mut supervisor.limits.envelope;
        (envelope.x_mm, envelope.y_mm) =
            ([f64::NEG_INFINITY, f64::INFINITY], [f64::NEG_INFINITY, f64::INFINITY]);
        supervisor
    }

    /// Voids permits from anywhere, as a stop does.
    pub fn revocation(&self) -> Revocation {
        self.permits.clone()
    }

    /// The fault that forbids motion, other than the way up.
    pub fn fault(&self) -> Option<Fault> {
        let status = self.status();
        if status == StageStatus::Alarm && !matches!(self.fault, Some(Fault::NotRetracted(_))) {
            return Some(Fault::Alarm);
        }
        let latched = match (&self.fault, &self.silence) {
            (Some(fault), _) if fault.rank() > 0 => Some(fault.clone()),
            (_, Some(silence)) => Some(Fault::Tripped(silence.clone())),
            (fault, None) => fault.clone(),
        };
        latched.or((status == StageStatus::Unhomed).then_some(Fault::Unhomed))
    }

    // --- what happens -------------------------------------------------------------------------------------------------

    /// Checks a frame.
    pub fn on_frame(&mut self, frame: &Frame) -> Option<Violation> {
        self.late_s = self.lateness.take(frame, self.limits.silence_max_s());
        self.arrived = Some(frame.received.mono);
        if self.elements.take(frame, self.late_s.is_some()) {
            self.z_at_frame_mm = self.z_mm;
        }
        let position_mm = self.position_mm();
        let is_standing = self.status() == StageStatus::Idle;
        let response = position_mm
            .and_then(|at_mm| self.contact.take(frame, at_mm, is_standing, &self.elements, &self.limits))
            .filter(|_| self.is_active);
        let is_watched = self.is_active || self.is_near();
        let overload = is_watched.then(|| self.elements.overload(&self.limits)).flatten();
        self.trip(overload.or(response))
    }

    /// Length of a tick of the clock of the sensor that has connected, in ns; 0 if it has none. By it the supervisor sees how long
    /// frames were on their way: one that waited longer than a silence may last does not count as fresh.
    pub fn set_tick(&mut self, tick_ns: u64) {
        self.lateness = Lateness::new(tick_ns, self.limits.silence_max_s());
    }

    /// By how many seconds the last frame arrived too late to be fresh; `None` if it was in time.
    pub fn late_s(&self) -> Option<f64> {
        self.late_s
    }

    /// The sensor connected anew: its zeros do not hold any more, and nothing goes down before new ones are taken.
    pub fn on_connected(&mut self) -> Option<Violation> {
        let had_zero = self.elements.has_zero();
        self.elements.forget_zeros();
        self.permits.revoke();
        self.trip((self.is_active && had_zero).then_some(Violation::Reconnected))
    }

    /// Checks a report of the stage. If the stage does not know its position, the last known height is kept.
    pub fn on_report(&mut self, report: &pb::StageState) -> Option<Violation> {
        let stood_mm = self.standing_mm().ok();
        let is_back =
            self.status() == StageStatus::Disconnected && report.status() != StageStatus::Disconnected;
        self.report = Some(*report);
        if is_back && self.z_mm.is_some() {
            self.latch(Fault::Away);
        }
        if let Some(stood_mm) = stood_mm
            && !self.stands_at(stood_mm)
        {
            // A permit is for the way from where the stage stood. One that is in use is not checked again.
            self.permits.revoke();
        }
        if !is_placed(report) {
            return None;
        }
        self.z_mm = Some(report.z_mm);
        let (depth_mm, limit_mm) = (-report.z_mm, self.limits.depth_max_mm);
        let slack_mm = self.limits.motion.tolerance_mm;
        self.trip((depth_mm > limit_mm + slack_mm).then_some(Violation::Depth { depth_mm, limit_mm }))
    }

    /// Checks the time since the last frame: near the covering, and while the stage is homing, frames must not cease.
    pub fn on_time(&mut self, now: MonoTime) -> Option<Violation> {
        let is_homing = self.status() == StageStatus::Homing;
        if !self.has_sensor || !(self.is_near() || is_homing) {
            return None;
        }
        let (limit_s, z_mm) = (self.limits.silence_max_s(), self.z_mm);
        let silent_s = self.elements.silence_s(now);
        let violation = if silent_s > limit_s {
            Some(Violation::Silence { silent_s, limit_s, z_mm })
        } else {
            let silent = self.elements.silent_element(now, &self.limits);
            silent.map(|(element, silent_s)| Violation::ElementSilence { element, silent_s, limit_s, z_mm })
        };
        self.trip(violation)
    }

    // --- what is asked ------------------------------------------------------------------------------------------------

    /// Permits a move from where the stage stands, for one sample period; a way up for as long as nothing is stopped.
    ///
    /// # Errors
    /// [`Denied`], with the reason.
    pub fn permit(&mut self, to: Target, now: MonoTime) -> Result<Permit, Denied> {
        let from_mm = self.standing_mm()?;
        self.contact.expect_motion();
        if self.limits.goes_up(from_mm, to) {
            self.limits.check_up(from_mm, to)?;
            return Ok(self.permits.permit(to, None));
        }
        self.check_fault()?;
        self.limits.check_way(from_mm, to)?;
        let safe_mm = self.limits.motion.safe_height_mm - self.limits.motion.tolerance_mm;
        self.check_report(now)?;
        if self.has_sensor || to.position_mm[2] < safe_mm {
            self.check_frame(now)?;
        }
        if self.limits.is_near(to.position_mm[2]) {
            if !self.elements.has_zero() {
                return Err(Denied::NoZero);
            }
            self.check_way_since_frame(to.position_mm[2], now)?;
        }
        Ok(self.permits.permit(to, Some(self.expiry(now))))
    }

    /// Permits the stage to be homed. Frames must arrive, so that a load is seen on the way.
    ///
    /// # Errors
    /// [`Denied`], with the reason.
    pub fn permit_homing(&mut self, now: MonoTime) -> Result<HomingPermit, Denied> {
        match self.fault() {
            None | Some(Fault::Unfinished | Fault::Unhomed | Fault::Away) => {}
            Some(fault) => return Err(Denied::Fault(fault)),
        }
        if self.has_sensor {
            self.check_frame(now)?;
        }
        Ok(self.permits.homing_permit(self.expiry(now)))
    }

    /// A run begins: the zeros of the last one are discarded.
    pub fn begin_run(&mut self) {
        self.elements.forget_zeros();
        self.is_active = true;
    }

    /// The run or reset is over, however it ended.
    pub fn end(&mut self) {
        self.is_active = false;
        self.permits.revoke();
        if let Some(fault) = self.not_retracted.take() {
            self.latch(fault);
        }
    }

    /// A reset begins: all faults become one, which permits homing and the way up. If it does not finish, [`Self::end`] tells
    /// again that the tip was not retracted.
    pub fn begin_reset(&mut self, now: MonoTime) {
        if let Some(fault @ Fault::NotRetracted(_)) = self.fault.replace(Fault::Unfinished) {
            self.not_retracted = Some(fault);
        }
        self.silence = None;
        self.is_active = true;
        self.elements.forget_zeros();
        self.elements.excuse_silence(now);
    }

    /// A reset ends: the fault is cleared if the stage stands at a known place and frames arrive.
    ///
    /// # Errors
    /// [`Denied`] if they do not; the fault then remains.
    pub fn finish_reset(&mut self, now: MonoTime) -> Result<(), Denied> {
        match self.fault() {
            None | Some(Fault::Unfinished) => {}
            Some(fault) => return Err(Denied::Fault(fault)),
        }
        self.standing_mm()?;
        self.check_frame(now)?;
        self.fault = None;
        self.not_retracted = None;
        Ok(())
    }

    /// Latches a fault until the next reset. An earlier one is kept, because it is the cause, unless this one is worse.
    pub fn latch(&mut self, fault: Fault) {
        self.permits.revoke();
        // A reset that finds the stage somewhere has not finished, if that was away since.
        let ends_reset = fault == Fault::Away && self.fault == Some(Fault::Unfinished);
        if ends_reset || self.fault.as_ref().is_none_or(|known| known.rank() < fault.rank()) {
            self.fault = Some(fault);
        }
    }

    /// Forgives a silence of the sensor, and nothing else, once the tip is up.
    pub fn forgive_silence(&mut self, now: MonoTime) {
        self.silence = None;
        self.elements.excuse_silence(now);
    }

    /// Sets the run's first zero and the tare. Loads are limited relative to both, so that repeated taring cannot raise the
    /// limit step by step.
    ///
    /// # Errors
    /// [`Violation::Zero`] if an element reads far from its baseline: it may be loaded, or the array may be another one;
    /// [`Violation::Unread`] if one is not read.
    pub fn set_reference(&mut self, counts: &[f64]) -> Result<(), Violation> {
        self.elements.set_reference(counts, &self.limits)
    }

    /// Sets the script's new zero.
    ///
    /// # Errors
    /// As [`Self::set_reference`].
    pub fn set_tare(&mut self, counts: &[f64]) -> Result<(), Violation> {
        self.elements.set_tare(counts, &self.limits)
    }

    /// True if a zero was taken since the sensor connected.
    pub fn has_zero(&self) -> bool {
        self.elements.has_zero()
    }

    /// A person works at the rig with the tip up: loads on the array are theirs, and nothing is permitted. [`Self::begin_run`]
    /// ends it.
    pub fn rest(&mut self) {
        self.is_active = false;
        self.permits.revoke();
    }

    /// Another covering is in place.
    pub fn set_covering(&mut self, covering: Covering) {
        self.limits.depth_max_mm = self.limits.envelope.depth_max_mm(covering);
        self.contact.set_covering(covering);
    }

    // --- how ----------------------------------------------------------------------------------------------------------

    /// Reports a violation only once: later ones occur while the first is handled.
    fn trip(&mut self, violation: Option<Violation>) -> Option<Violation> {
        let violation = violation?;
        let is_worse = self.fault.as_ref().is_some_and(|fault| fault.rank() > 0);
        // What comes while a silence is handled may be worse than it.
        if is_worse || (violation.is_silence() && self.silence.is_some()) {
            return None;
        }
        self.permits.revoke();
        if violation.is_silence() {
            self.silence = Some(violation.clone());
        } else {
            self.fault = Some(Fault::Tripped(violation.clone()));
        }
        Some(violation)
    }

    fn is_near(&self) -> bool {
        self.z_mm.is_some_and(|z_mm| self.limits.is_near(z_mm))
    }

    fn check_fault(&self) -> Result<(), Denied> {
        self.fault().map_or(Ok(()), |fault| Err(Denied::Fault(fault)))
    }

    fn check_frame(&self, now: MonoTime) -> Result<(), Denied> {
        let (age_s, limit_s) =
            (Limits::silence_s(now, self.elements.last_frame()), self.limits.silence_max_s());
        if age_s <= limit_s { Ok(()) } else { Err(self.no_fresh_frame(now, age_s, limit_s)) }
    }

    fn no_fresh_frame(&self, now: MonoTime, age_s: f64, limit_s: f64) -> Denied {
        let arrive = Limits::silence_s(now, self.arrived) <= self.limits.silence_max_s();
        match self.late_s.filter(|_| arrive) {
            Some(late_s) => Denied::LateFrames { late_s },
            None => Denied::NoFreshFrame { age_s, limit_s },
        }
    }

    fn check_report(&self, now: MonoTime) -> Result<(), Denied> {
        let reported = self.report.map(|report| MonoTime::from_ns(report.t_mono_ns));
        let (age_s, limit_s) = (Limits::silence_s(now, reported), REPORT_AGE_MAX_S);
        if age_s <= limit_s { Ok(()) } else { Err(Denied::NoFreshReport { age_s, limit_s }) }
    }

    /// Near the covering the tip goes at most two steps beyond what the last frame has shown, however slow the sensor is.
    fn check_way_since_frame(&self, to_z_mm: f64, now: MonoTime) -> Result<(), Denied> {
        let from_z_mm =
            self.z_at_frame_mm.map_or(f64::INFINITY, |z_mm| z_mm.min(self.limits.motion.approach_height_mm));
        if from_z_mm - to_z_mm <= 2.0 * STEP_DOWN_MAX_MM + self.limits.motion.tolerance_mm {
            return Ok(());
        }
        let age_s = Limits::silence_s(now, self.elements.last_frame());
        Err(self.no_fresh_frame(now, age_s, 0.0))
    }

    fn expiry(&self, now: MonoTime) -> MonoTime {
        now.after(Duration::from_secs_f64(self.limits.permit_s()))
    }

    fn status(&self) -> StageStatus {
        self.report.map_or(StageStatus::Unspecified, |report| report.status())
    }

    /// Where the stage stands idle.
    fn standing_mm(&self) -> Result<[f64; 3], Denied> {
        let Some(report) = self.report else { return Err(Denied::NoStage) };
        let status = report.status();
        match status {
            StageStatus::Idle if is_placed(&report) => Ok([report.x_mm, report.y_mm, report.z_mm]),
            StageStatus::Idle => Err(Denied::NoPlace),
            StageStatus::Unspecified | StageStatus::Disconnected => Err(Denied::NoStage),
            StageStatus::Alarm => Err(Denied::Fault(Fault::Alarm)),
            StageStatus::Unhomed => Err(Denied::Fault(Fault::Unhomed)),
            StageStatus::Moving | StageStatus::Hold | StageStatus::Homing => {
                Err(Denied::NotStanding { status: status.as_str_name() })
            }
        }
    }

    /// True if the stage stands within tolerance of a place.
    fn stands_at(&self, [x_mm, y_mm, z_mm]: [f64; 3]) -> bool {
        self.standing_mm().is_ok_and(|[here_x_mm, here_y_mm, here_z_mm]| {
            let away_mm = (here_x_mm - x_mm).hypot(here_y_mm - y_mm).hypot(here_z_mm - z_mm);
            away_mm <= self.limits.motion.tolerance_mm
        })
    }

    fn position_mm(&self) -> Option<[f64; 3]> {
        let report = self.report.filter(is_placed)?;
        Some([report.x_mm, report.y_mm, report.z_mm])
    }
}

/// True if a report tells the position.
fn is_placed(report: &pb::StageState) -> bool {
    let is_known = match report.status() {
        StageStatus::Unspecified | StageStatus::Disconnected | StageStatus::Unhomed | StageStatus::Homing => {
            false
        }
        StageStatus::Idle | StageStatus::Moving | StageStatus::Hold | StageStatus::Alarm => true,
    };
    is_known && [report.x_mm, report.y_mm, report.z_mm].iter().all(|mm| mm.is_finite())
}

#[cfg(test)]
#[path = "supervisor_tests.rs"]
mod tests;
