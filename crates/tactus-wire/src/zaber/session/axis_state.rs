//! State of an axis.

use crate::stage::AxisName;
use crate::zaber::{Axis, Flag, Severity};

/// State of an axis, as last reported.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AxisState {
    pub(super) name: AxisName,
    pub(super) axis: Axis,
    /// Travel in microsteps.
    pub(super) limit_min: i64,
    pub(super) limit_max: i64,
    /// Position in microsteps.
    pub(super) position: i64,
    pub(super) busy: bool,
    /// It has confirmed the present move or homing, and has reported no interruption by others.
    pub(super) is_ours: bool,
    /// The gravest present fault.
    pub(super) fault: Option<Flag>,
    /// Whether it has a reference position.
    pub(super) reference: Reference,
    /// Its last flag may hide others, so the list of its warnings must be requested.
    pub(super) needs_list: bool,
}

/// Whether an axis has a reference position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reference {
    /// It has one.
    Known,
    /// It has none, or a doubtful one.
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

    /// Its travel, in words.
    pub(super) fn travel(&self) -> String {
        let [a, b] = [self.limit_min, self.limit_max].map(|limit| self.axis.position_mm(limit));
        format!("its travel is {:.3} to {:.3} mm", a.min(b), a.max(b))
    }

    /// Takes the flag of a reply, and with `all` the complete list. True if there is a new fault.
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
