//! The safety supervisor. It sees every frame and every stage report first, and can only stop motion.

use tactus_schema::rig::Service;
use tactus_schema::{Frame, MonoTime, Rig, pb};

/// Sample periods without a frame after which a tip near the covering is stopped.
const SILENT_PERIODS_MAX: f64 = 3.0;

/// Checks frames, positions and the clock. It does no I/O: the caller acts on the violations that it returns.
#[derive(Debug)]
pub struct Supervisor {
    limits: Limits,
    reference: Option<Zero>,
    tare: Option<Zero>,
    z_mm: f64,
    last_frame: MonoTime,
    /// By index; as many as the last frame had.
    elements: Vec<Element>,
    tripped: bool,
}

/// Readings without load, in counts; `None` for an element that was not read then.
type Zero = Vec<Option<f64>>;

#[derive(Debug, Clone, Copy)]
struct Element {
    last_read: Option<MonoTime>,
    /// In the last frame.
    is_read: bool,
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
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum Violation {
    /// One element reads too much.
    #[error(
        "element {element} reads {rise_counts:.0} counts above {against}; the limit is {limit_counts} (envelope.element_max_counts)"
    )]
    ElementForce {
        element: usize,
        rise_counts: f64,
        limit_counts: f64,
        /// Above which zero: the current tare or the run's reference.
        against: &'static str,
    },
    /// All elements together read too much.
    #[error(
        "all elements together read {rise_counts:.0} counts above {against}; the limit is {limit_counts} (envelope.sum_max_counts)"
    )]
    SumForce { rise_counts: f64, limit_counts: f64, against: &'static str },
    /// No fresh frame while the tip was near the covering.
    #[error(
        "no frame for {silent_s:.3} s with the tip at z = {z_mm:.3} mm; at most {limit_s:.3} s are allowed"
    )]
    Silence { silent_s: f64, limit_s: f64, z_mm: f64 },
    /// An element that was read for the run's first zero is no longer read, so a load on it would not be seen.
    #[error(
        "element {element} was not read for {silent_s:.3} s with the tip at z = {z_mm:.3} mm; at most {limit_s:.3} s are allowed"
    )]
    ElementSilence { element: usize, silent_s: f64, limit_s: f64, z_mm: f64 },
    /// The stage reports a depth beyond the limit.
    #[error(
        "the stage reports a depth of {depth_mm:.3} mm; the limit is {limit_mm:.3} mm (envelope.depth_share_max)"
    )]
    Depth { depth_mm: f64, limit_mm: f64 },
}

impl Violation {
    /// Short name of the rule, for the safety event.
    pub fn rule(&self) -> &'static str {
        match self {
            Self::ElementForce { .. } => "element-force",
            Self::SumForce { .. } => "sum-force",
            Self::Silence { .. } => "silence",
            Self::ElementSilence { .. } => "element-silence",
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
            reference: None,
            tare: None,
            z_mm: f64::INFINITY,
            last_frame: MonoTime::default(),
            elements: Vec::new(),
            tripped: false,
        }
    }

    /// Begins a run: discards the zeros of the last one.
    pub fn begin(&mut self, depth_max_mm: f64) {
        self.set_depth_max_mm(depth_max_mm);
        self.reference = None;
        self.tare = None;
    }

    /// Another covering is in place.
    pub fn set_depth_max_mm(&mut self, depth_max_mm: f64) {
        self.limits.depth_max_mm = depth_max_mm;
    }

    /// Sets the run's reference zero. Loads are limited relative to it and to the current tare, so that repeated taring
    /// cannot raise the limit step by step. An element that has been silent for longer than the limit is known not to
    /// be read: it has no zero and no limit, and its silence does not stop motion.
    pub fn set_reference(&mut self, counts: Vec<f64>) {
        let zero = self.zero(counts);
        self.tare = Some(zero.clone());
        self.reference = Some(zero);
    }

    /// The script's new zero.
    pub fn set_tare(&mut self, counts: Vec<f64>) {
        self.tare = Some(self.zero(counts));
    }

    fn zero(&self, counts: Vec<f64>) -> Zero {
        let was_read = |element: usize| {
            self.elements.get(element).is_none_or(|element| {
                let silent = element.last_read.map(|read| self.last_frame.since(read).as_secs_f64());
                silent.is_some_and(|silent_s| silent_s <= self.limits.silence_max_s)
            })
        };
        let zero =
            |(element, count): (usize, f64)| Some(count).filter(|_| count.is_finite() && was_read(element));
        counts.into_iter().enumerate().map(zero).collect()
    }

    /// Resumes checking after a violation was handled.
    pub fn rearm(&mut self, now: MonoTime) {
        self.tripped = false;
        self.last_frame = self.last_frame.max(now);
        for element in &mut self.elements {
            element.last_read = element.last_read.map(|read| read.max(now));
        }
    }

    /// Checks a frame.
    pub fn on_frame(&mut self, frame: &Frame) -> Option<Violation> {
        self.last_frame = frame.received.mono;
        self.look_at_elements(frame);
        let violation = [(&self.tare, "the tare"), (&self.reference, "the run's first zero")]
            .into_iter()
            .find_map(|(zero, against)| self.limits.force(frame, &self.elements, zero.as_deref()?, against));
        self.trip(violation)
    }

    /// Ignores elements that were not read: their value in the frame is an earlier one and does not show the present
    /// load.
    fn look_at_elements(&mut self, frame: &Frame) {
        let at = frame.received.mono;
        self.elements.resize(frame.counts.len(), Element { last_read: None, is_read: false });
        for (element, count) in self.elements.iter_mut().zip(frame.counts.iter()) {
            element.is_read = count.is_finite();
        }
        for element in frame.bad_elements.iter() {
            let element = usize::try_from(*element).ok().and_then(|element| self.elements.get_mut(element));
            if let Some(element) = element {
                element.is_read = false;
            }
        }
        for element in self.elements.iter_mut().filter(|element| element.is_read) {
            element.last_read = Some(at);
        }
    }

    /// Checks a report of the stage. If the stage does not know its position, the last known height is kept.
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

    /// Checks the time since the last frame.
    pub fn on_time(&mut self, now: MonoTime) -> Option<Violation> {
        if self.z_mm >= self.limits.near_mm {
            return None;
        }
        let (limit_s, z_mm) = (self.limits.silence_max_s, self.z_mm);
        let silent_s = now.since(self.last_frame).as_secs_f64();
        let violation = if silent_s > limit_s {
            Some(Violation::Silence { silent_s, limit_s, z_mm })
        } else {
            self.silent_element(now)
        };
        self.trip(violation)
    }

    /// An element that has a zero and is not read.
    fn silent_element(&self, now: MonoTime) -> Option<Violation> {
        let zeros = self.reference.as_ref()?.iter();
        zeros.zip(&self.elements).enumerate().find_map(|(element, (zero, state))| {
            let silent_s = now.since(state.last_read.unwrap_or_default()).as_secs_f64();
            let is_silent = zero.is_some() && !state.is_read && silent_s > self.limits.silence_max_s;
            is_silent.then_some(Violation::ElementSilence {
                element,
                silent_s,
                limit_s: self.limits.silence_max_s,
                z_mm: self.z_mm,
            })
        })
    }

    /// Reports a violation only once: later ones occur while the first is handled.
    fn trip(&mut self, violation: Option<Violation>) -> Option<Violation> {
        let fresh = violation.filter(|_| !self.tripped);
        self.tripped |= fresh.is_some();
        fresh
    }
}

impl Limits {
    fn force(
        &self,
        frame: &Frame,
        elements: &[Element],
        zero: &[Option<f64>],
        against: &'static str,
    ) -> Option<Violation> {
        // Only elements that were read both now and for the zero: the rise of any other is NaN.
        let rises = || {
            let pairs = frame.counts.iter().zip(elements).zip(zero).zip(&self.signs).enumerate();
            pairs.filter_map(|(element, (((count, state), zero), sign))| {
                let zero = zero.filter(|_| state.is_read)?;
                Some((element, (f64::from(*count) - zero) * sign))
            })
        };
        if let Some((element, rise_counts)) = rises().find(|(_, rise)| *rise > self.element_max_counts) {
            return Some(Violation::ElementForce {
                element,
                rise_counts,
                limit_counts: self.element_max_counts,
                against,
            });
        }
        let rise_counts: f64 = rises().map(|(_, rise)| rise).sum();
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
