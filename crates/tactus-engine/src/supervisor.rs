//! The safety supervisor: sees every frame and every report first, and may only stop.

use tactus_schema::rig::Service;
use tactus_schema::{Frame, MonoTime, Rig, pb};

/// Sample periods without a frame that the tip may stay near the covering.
const SILENT_PERIODS_MAX: f64 = 3.0;

/// Watches frames, positions and the clock. Sans-IO: who feeds it acts on what it answers.
#[derive(Debug)]
pub struct Supervisor {
    limits: Limits,
    reference_counts: Option<Vec<f64>>,
    tare_counts: Option<Vec<f64>>,
    z_mm: f64,
    last_frame: MonoTime,
    tripped: bool,
}

#[derive(Debug, Clone)]
struct Limits {
    element_max_counts: f64,
    sum_max_counts: f64,
    near_mm: f64,
    depth_max_mm: f64,
    /// Per element, the direction of its reading when it is pressed.
    signs: Vec<f64>,
    slack_mm: f64,
    silence_max_s: f64,
}

/// A rule that was broken; motion must stop and the tip retract.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Violation {
    /// One element reads too much.
    #[error(
        "element {element} reads {rise_counts:.0} counts above {against}; the limit is {limit_counts} (envelope.element_max_counts)"
    )]
    ElementForce {
        /// Index of the element.
        element: usize,
        /// Its rise.
        rise_counts: f64,
        /// The limit.
        limit_counts: f64,
        /// Above which zero: the current tare or the run's reference.
        against: &'static str,
    },
    /// All elements together read too much.
    #[error(
        "all elements together read {rise_counts:.0} counts above {against}; the limit is {limit_counts} (envelope.sum_max_counts)"
    )]
    SumForce {
        /// The sum of the rises.
        rise_counts: f64,
        /// The limit.
        limit_counts: f64,
        /// Above which zero.
        against: &'static str,
    },
    /// No fresh frame while the tip was near the covering.
    #[error(
        "no frame for {silent_s:.3} s with the tip at z = {z_mm:.3} mm; at most {limit_s:.3} s are allowed"
    )]
    Silence {
        /// Since the last frame.
        silent_s: f64,
        /// The limit.
        limit_s: f64,
        /// Height of the tip.
        z_mm: f64,
    },
    /// The stage reports a depth beyond the limit.
    #[error(
        "the stage reports a depth of {depth_mm:.3} mm; the limit is {limit_mm:.3} mm (envelope.depth_share_max)"
    )]
    Depth {
        /// What it reports.
        depth_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
}

impl Violation {
    /// Short name of the rule, for the safety event.
    pub fn rule(&self) -> &'static str {
        match self {
            Self::ElementForce { .. } => "element-force",
            Self::SumForce { .. } => "sum-force",
            Self::Silence { .. } => "silence",
            Self::Depth { .. } => "depth",
        }
    }
}

impl Supervisor {
    /// A supervisor for a rig with the covering that its description names.
    pub fn new(rig: &Rig, service: &Service) -> Self {
        let (envelope, motion) = (&service.envelope, &service.motion);
        Self {
            limits: Limits {
                element_max_counts: envelope.element_max_counts,
                sum_max_counts: envelope.sum_max_counts,
                near_mm: motion.approach_height_mm,
                depth_max_mm: envelope.depth_share_max * rig.covering.thickness_mm,
                signs: rig.sensitivity_counts_per_mm.iter().map(|counts| counts.signum()).collect(),
                slack_mm: motion.tolerance_mm,
                silence_max_s: SILENT_PERIODS_MAX / rig.array.rate_hz(),
            },
            reference_counts: None,
            tare_counts: None,
            z_mm: f64::INFINITY,
            last_frame: MonoTime::default(),
            tripped: false,
        }
    }

    /// A run begins: the zeros of the last one are no longer true.
    pub fn begin(&mut self, depth_max_mm: f64) {
        self.set_depth_max_mm(depth_max_mm);
        self.reference_counts = None;
        self.tare_counts = None;
    }

    /// Another covering is in place.
    pub fn set_depth_max_mm(&mut self, depth_max_mm: f64) {
        self.limits.depth_max_mm = depth_max_mm;
    }

    /// The run's reference zero. Loads are limited against it and against the current tare, so that
    /// repeated taring cannot ratchet the limit up.
    pub fn set_reference(&mut self, counts: Vec<f64>) {
        self.tare_counts = Some(counts.clone());
        self.reference_counts = Some(counts);
    }

    /// The script's new zero.
    pub fn set_tare(&mut self, counts: Vec<f64>) {
        self.tare_counts = Some(counts);
    }

    /// Watches again after a violation was dealt with.
    pub fn rearm(&mut self, now: MonoTime) {
        self.tripped = false;
        self.last_frame = self.last_frame.max(now);
    }

    /// Looks at a frame.
    pub fn on_frame(&mut self, frame: &Frame) -> Option<Violation> {
        self.last_frame = frame.received.mono;
        let violation = [(&self.tare_counts, "the tare"), (&self.reference_counts, "the run's first zero")]
            .into_iter()
            .find_map(|(zero, against)| self.limits.force(frame, zero.as_deref()?, against));
        self.trip(violation)
    }

    /// Looks at a report of the stage. A stage that does not know where it is leaves the last known height.
    pub fn on_report(&mut self, report: &pb::StageState) -> Option<Violation> {
        match report.status() {
            pb::StageStatus::Unspecified
            | pb::StageStatus::Disconnected
            | pb::StageStatus::Unhomed
            | pb::StageStatus::Homing => return None,
            pb::StageStatus::Idle
            | pb::StageStatus::Moving
            | pb::StageStatus::Hold
            | pb::StageStatus::Alarm => {}
        }
        self.z_mm = report.z_mm;
        let depth_mm = -report.z_mm;
        let limit_mm = self.limits.depth_max_mm;
        let violation =
            (depth_mm > limit_mm + self.limits.slack_mm).then_some(Violation::Depth { depth_mm, limit_mm });
        self.trip(violation)
    }

    /// Looks at the clock.
    pub fn on_time(&mut self, now: MonoTime) -> Option<Violation> {
        let silent_s = now.since(self.last_frame).as_secs_f64();
        let limit_s = self.limits.silence_max_s;
        let violation = (self.z_mm < self.limits.near_mm && silent_s > limit_s)
            .then_some(Violation::Silence { silent_s, limit_s, z_mm: self.z_mm });
        self.trip(violation)
    }

    /// A violation is told once: what follows it is its own clean-up.
    fn trip(&mut self, violation: Option<Violation>) -> Option<Violation> {
        let fresh = violation.filter(|_| !self.tripped);
        self.tripped |= fresh.is_some();
        fresh
    }
}

impl Limits {
    fn force(&self, frame: &Frame, zero: &[f64], against: &'static str) -> Option<Violation> {
        let rises = || {
            let pairs = frame.counts.iter().zip(zero).zip(&self.signs);
            pairs.map(|((count, zero), sign)| (f64::from(*count) - zero) * sign)
        };
        if let Some((element, rise_counts)) =
            rises().enumerate().find(|(_, rise)| *rise > self.element_max_counts)
        {
            return Some(Violation::ElementForce {
                element,
                rise_counts,
                limit_counts: self.element_max_counts,
                against,
            });
        }
        let rise_counts: f64 = rises().sum();
        (rise_counts > self.sum_max_counts).then_some(Violation::SumForce {
            rise_counts,
            limit_counts: self.sum_max_counts,
            against,
        })
    }
}

#[cfg(test)]
#[path = "supervisor_tests.rs"]
mod tests;
