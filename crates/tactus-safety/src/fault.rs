//! What forbids motion: broken rules, and states that only a reset ends.

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
        /// Above which zero: the current tare, the run's reference, or the rig's baseline.
        against: &'static str,
    },
    /// All elements together read too much.
    #[error(
        "all elements together read {rise_counts:.0} counts above {against}; the limit is {limit_counts} (envelope.sum_max_counts)"
    )]
    SumForce { rise_counts: f64, limit_counts: f64, against: &'static str },
    /// No fresh frame while the tip was near the covering.
    #[error(
        "no frame for {silent_s:.3} s with the tip at {}; at most {limit_s:.3} s are allowed", height(*z_mm)
    )]
    Silence {
        silent_s: f64,
        limit_s: f64,
        /// `None` while the stage is homing for the first time.
        z_mm: Option<f64>,
    },
    /// The sensor connected anew in a run.
    #[error("the sensor connected anew: the zeros that were taken before do not hold any more")]
    Reconnected,
    /// An element that was read for the run's first zero is no longer read, so a load on it would not be seen.
    #[error(
        "element {element} was not read for {silent_s:.3} s with the tip at {}; at most {limit_s:.3} s are allowed",
        height(*z_mm)
    )]
    ElementSilence { element: usize, silent_s: f64, limit_s: f64, z_mm: Option<f64> },
    /// The stage reports a depth beyond the limit.
    #[error(
        "the stage reports a depth of {depth_mm:.3} mm; the limit is {limit_mm:.3} mm (envelope.depth_share_max)"
    )]
    Depth { depth_mm: f64, limit_mm: f64 },
    /// The same frame comes again and again although the tip moves.
    #[error(
        "the sensor still sends the same counts, {frames} frames after the tip has moved by {way_mm:.3} mm in the covering: it is frozen"
    )]
    Frozen { frames: u32, way_mm: f64 },
    /// The tip is deep in the covering and no element responds.
    #[error(
        "no element rose by more than {rise_counts:.0} counts with the tip {depth_mm:.3} mm deep over the array; at least \
         {least_counts:.0} are expected: is the covering in place, and its surface at z = 0? (envelope.expects_response)"
    )]
    NoResponse { rise_counts: f64, least_counts: f64, depth_mm: f64 },
    /// A reading without load lies far from the rig's baseline.
    #[error(
        "element {element} reads {counts:.0} counts without load; the rig file says {baseline_counts:.0} +- {band_counts:.0} \
         (envelope.baseline_band_counts): is something on the sensor? If the element is faulty, list it in \
         envelope.unwatched_elements"
    )]
    Zero { element: usize, counts: f64, baseline_counts: f64, band_counts: f64 },
    /// An element is not read, so it has no zero, and a load on it would not be seen.
    #[error(
        "element {element} is not read: see to it; if it is faulty, list it in envelope.unwatched_elements"
    )]
    Unread { element: usize },
}

impl Violation {
    /// True for a silence of the sensor, which its return may end.
    pub fn is_silence(&self) -> bool {
        matches!(self, Self::Silence { .. } | Self::Reconnected)
    }

    /// Short name of the rule, for the safety event.
    pub fn rule(&self) -> &'static str {
        match self {
            Self::ElementForce { .. } => "element-force",
            Self::SumForce { .. } => "sum-force",
            Self::Silence { .. } => "silence",
            Self::Reconnected => "reconnected",
            Self::ElementSilence { .. } => "element-silence",
            Self::Depth { .. } => "depth",
            Self::Frozen { .. } => "frozen",
            Self::NoResponse { .. } => "no-response",
            Self::Zero { .. } => "zero",
            Self::Unread { .. } => "unread",
        }
    }
}

fn height(z_mm: Option<f64>) -> String {
    z_mm.map_or_else(|| "an unknown height".into(), |z_mm| format!("z = {z_mm:.3} mm"))
}

/// Why nothing but the way up is permitted before a reset.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The supervisor is new, and nobody has allowed motion yet.
    #[error("nothing has been reset since the service started")]
    Started,
    /// A reset is under way, or the last one failed.
    #[error("the last reset was not finished")]
    Unfinished,
    /// The stage's controller is in alarm.
    #[error("the stage is in alarm")]
    Alarm,
    /// The stage does not know its position, as after a reset of its controller.
    #[error("the stage does not know where it is")]
    Unhomed,
    /// The stage was lost and is back. That its position is known is good enough for the way up alone.
    #[error("the stage did not answer for a while")]
    Away,
    /// A rule was broken.
    #[error("a safety rule was broken: {0}")]
    Tripped(Violation),
    /// The tip could not be raised.
    #[error("THE TIP IS NOT RETRACTED: {0}")]
    NotRetracted(String),
    /// A task of the service failed while it was responsible for the tip.
    #[error("a task of the service failed: {0}")]
    Defect(String),
}

impl Fault {
    /// Which of two faults is told: the one of the higher rank, else the earlier one.
    pub(crate) fn rank(&self) -> u8 {
        match self {
            Self::Started | Self::Unfinished | Self::Alarm | Self::Unhomed | Self::Away => 0,
            Self::Tripped(_) => 1,
            Self::Defect(_) => 2,
            Self::NotRetracted(_) => 3,
        }
    }
}
