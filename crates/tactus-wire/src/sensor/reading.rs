//! One reading of an array, and how many readings are missing before it.

use std::sync::Arc;

/// One reading of all elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The device's clock at the sampling, unwrapped, in units of [`Session::tick_ns`](super::Session::tick_ns);
    /// `None` if it has no clock.
    pub tick: Option<u64>,
    /// True if `tick` cannot be compared with earlier ones: this is the first reading, or the clock has jumped.
    pub new_clock: bool,
    /// What shows whether readings are missing before this one.
    pub evidence: LossEvidence,
    /// One for each element, row-major. The counts of [`bad`](Self::bad) elements have no meaning.
    pub counts: Arc<[f32]>,
    /// Indices of the elements that were not read, ascending.
    pub bad: Vec<u32>,
    /// Temperature of the sensor in degrees Celsius, the mean where it has several; finite. `None` if it tells none.
    pub temperature_c: Option<f32>,
}

/// What the bytes since the previous reading show about missing readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LossEvidence {
    /// Nothing: only the device's clock or the time of arrival shows it.
    TimesOnly,
    /// Some bytes belonged to no frame. If the times leave room for missing readings, they were lost.
    Damage,
    /// The device counts its frames.
    Counted {
        /// Readings that its count says are missing, modulo `wrap`.
        lost: u64,
        /// The count starts again at 0 after this many frames.
        wrap: u64,
    },
}

impl LossEvidence {
    /// Readings that are missing by the device's own count; 0 if it has none.
    pub fn counted(self) -> u64 {
        match self {
            Self::Counted { lost, .. } => lost,
            Self::TimesOnly | Self::Damage => 0,
        }
    }
}
