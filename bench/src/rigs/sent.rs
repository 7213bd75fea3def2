//! When each frame was sent, and how long it has been under way when it is heard.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::RATE_HZ;

/// Sensors are spread over so many times of sampling in each period, as those of independent rigs would be.
pub(super) const SLOTS: u32 = 32;

/// Frames of each sensor whose times are kept. One that is heard later than so many periods is not timed.
const KEPT: usize = 64;

/// When the latest frames of all sensors were sent.
#[derive(Debug)]
pub(super) struct SentTimes {
    began: Instant,
    /// In ns since the beginning, of each sensor [`KEPT`].
    sent_ns: Vec<AtomicU64>,
}

/// Time between two times of sampling.
pub(super) fn slot() -> Duration {
    Duration::from_secs_f64(1.0 / (RATE_HZ * f64::from(SLOTS)))
}

impl SentTimes {
    pub(super) fn new(sensors: usize) -> Self {
        let mut sent_ns = Vec::new();
        sent_ns.resize_with(sensors * KEPT, AtomicU64::default);
        Self { began: Instant::now(), sent_ns }
    }

    /// The sensor is about to send the frame of this time of sampling.
    pub(super) fn note(&self, sensor: usize, number: u32) {
        if let Some(sent_ns) = self.of(sensor, u64::from(number)) {
            sent_ns.store(self.now_ns(), Ordering::Relaxed);
        }
    }

    /// Time since the sensor sent the frame with this time of its clock, in ms.
    pub(super) fn since(&self, sensor: usize, tick_ms: u64) -> Option<Duration> {
        // The clock shows whole milliseconds, and times of sampling are further apart.
        let number = (u128::from(tick_ms) * 1_000_000).div_ceil(slot().as_nanos());
        let sent_ns = self.of(sensor, u64::try_from(number).ok()?)?.load(Ordering::Relaxed);
        Some(Duration::from_nanos(self.now_ns().saturating_sub(sent_ns)))
    }

    fn of(&self, sensor: usize, number: u64) -> Option<&AtomicU64> {
        let period = usize::try_from(number / u64::from(SLOTS)).ok()?;
        self.sent_ns.get(sensor * KEPT + period % KEPT)
    }

    fn now_ns(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
#[path = "sent_tests.rs"]
mod tests;
