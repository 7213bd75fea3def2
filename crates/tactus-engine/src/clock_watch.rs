//! The offset between the device's clock and the host's over the recent frames.

use std::time::Duration;

use tactus_schema::MonoTime;

/// Offsets of one to two of these count. A clock of 100 ppm drifts by 12 ms in that time.
const SPAN: Duration = Duration::from_mins(1);

/// Least and greatest of (arrival of a frame - its device time), in seconds. A frame never arrives before it is sampled, so the
/// least is the best estimate of the offset, and the spread is its uncertainty.
#[derive(Debug, Default)]
pub(crate) struct ClockWatch {
    since: MonoTime,
    present_s: Option<[f64; 2]>,
    before_s: Option<[f64; 2]>,
}

impl ClockWatch {
    /// Takes a frame's arrival and its device time.
    pub(crate) fn take(&mut self, received: MonoTime, device_s: f64) {
        if self.present_s.is_some() && received.since(self.since) >= SPAN {
            self.before_s = self.present_s.take();
        }
        if self.present_s.is_none() {
            self.since = received;
        }
        let offset_s = received.seconds() - device_s;
        self.present_s = join(self.present_s, Some([offset_s; 2]));
    }

    /// Over the recent frames; `None` before the first.
    pub(crate) fn offset_s(&self) -> Option<[f64; 2]> {
        join(self.before_s, self.present_s)
    }
}

fn join(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> Option<[f64; 2]> {
    match (a, b) {
        (Some([least_a, greatest_a]), Some([least_b, greatest_b])) => {
            Some([least_a.min(least_b), greatest_a.max(greatest_b)])
        }
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
#[path = "clock_watch_tests.rs"]
mod tests;
