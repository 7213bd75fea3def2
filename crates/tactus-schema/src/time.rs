//! Times of three clocks, each a type of its own: the device's clock, the host's monotonic clock and its wall clock.

use std::time::Duration;

/// A reading of the device's own clock, in device ticks, unwrapped; comparable within one epoch only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DeviceTick(pub u64);

/// Nanoseconds on the host's monotonic clock since the service (or the embedded rig) started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct MonoTime(i64);

/// Nanoseconds since 1970-01-01 UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct WallTime(i64);

/// One instant on both host clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimeStamp {
    /// On the monotonic clock.
    pub mono: MonoTime,
    /// On the wall clock.
    pub wall: WallTime,
}

impl MonoTime {
    /// From nanoseconds since the start of the service.
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Nanoseconds since the start of the service.
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// Seconds since the start of the service.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Time since `earlier`; zero if that is later.
    pub fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(u64::try_from(self.0.saturating_sub(earlier.0)).unwrap_or(0))
    }

    /// The instant `duration` later; saturates at the end of the range.
    #[must_use]
    pub fn after(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)))
    }
}

impl WallTime {
    /// From nanoseconds since 1970-01-01 UTC.
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Nanoseconds since 1970-01-01 UTC.
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// The instant `duration` later; saturates at the end of the range.
    #[must_use]
    pub fn after(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)))
    }
}
