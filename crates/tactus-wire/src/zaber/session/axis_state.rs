//! What is known of one axis.

use crate::stage::AxisName;
use crate::zaber::{Axis, Flag, Severity};

/// What is known of one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AxisState {
    pub(super) name: AxisName,
    pub(super) axis: Axis,
    /// Travel in microsteps.
    pub(super) limit_min: i64,
    pub(super) limit_max: i64,
    /// As last reported, microsteps.
    pub(super) position: i64,
    pub(super) busy: bool,
    /// It has confirmed the move or homing in hand, and said nothing of anyone else's.
    pub(super) is_ours: bool,
    /// The gravest fault that stands.
    pub(super) fault: Option<Flag>,
    /// Whether it knows where it is, as it last let see.
    pub(super) reference: Reference,
    /// What it said last may hide something: the list of its warnings is to be asked for.
    pub(super) needs_list: bool,
}

/// Whether an axis knows where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reference {
    /// It does.
    Known,
    /// It does not, or not well.
    Lost,
}

impl AxisState {
    pub(super) fn new(name: AxisName, axis: Axis) -> Self {
        Self {
            name,
            axis,
            limit_min: i64::MIN,
            limit_max: i64::MAX,
            position: 0,
            busy: false,
            is_ours: false,
            fault: None,
            reference: Reference::Lost,
            needs_list: true,
        }
    }

    /// True if a position is within its travel.
    pub(super) fn allows(&self, microsteps: i64) -> bool {
        (self.limit_min..=self.limit_max).contains(&microsteps)
    }

    /// Its travel in words.
    pub(super) fn travel(&self) -> String {
        let [a, b] = [self.limit_min, self.limit_max].map(|limit| self.axis.position_mm(limit));
        format!("its travel is {:.3} to {:.3} mm", a.min(b), a.max(b))
    }

    /// Takes over the flag of a reply, or with `all` the list of flags; true if a fault is new.
    pub(super) fn take_flags(&mut self, flag: Flag, all: Option<&[Flag]>) -> bool {
        let flags = || all.unwrap_or_default().iter().copied().chain([flag]);
        let is_complete = all.is_some() || !flag.hides_reference();
        let fault = flags().find(|flag| flag.severity() == Severity::Fault);
        let is_new = fault.is_some() && self.fault.is_none();
        if fault.is_some() || is_complete {
            self.fault = fault;
        }
        if flags().any(|flag| flag.severity() == Severity::Suspect) {
            self.reference = Reference::Lost;
        } else if is_complete {
            self.reference = Reference::Known;
        }
        self.needs_list = !is_complete;
        is_new
    }
}
