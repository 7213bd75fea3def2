//! How late frames arrive, by the clock of the device.

use tactus_schema::{Frame, MonoTime};

/// Rate at which the clock of a device may run slow against the computer's. A sender that is off by a quarter of a bit in the ten of a
/// byte, 2.5 %, is not understood over an asynchronous serial line; clocks for USB have to be better. A link that is too slow by less is
/// not told from such a clock.
const SLOW_MAX: f64 = 0.025;

/// How much later than the quickest frame of the same connection a frame arrives: it waited so long on the way.
///
/// (arrival - device time) is the offset of the two clocks and the time on the way. Its least value over the connection stands for
/// the offset, since no frame arrives before it is sampled. A slow clock raises the offset, so the least value rises with it,
/// by [`SLOW_MAX`] at most, and as long as frames come in time: a wait is never taken for the clock, however long it lasts.
#[derive(Debug, Default)]
pub(crate) struct Lateness {
    /// Length of a device tick; 0 without a clock, or with one that is too coarse.
    tick_s: f64,
    epoch: u32,
    /// Least offset in seconds, and when it was that.
    least: Option<(f64, MonoTime)>,
}

impl Lateness {
    /// Of a new connection. A clock whose tick is longer than `late_max_s` says nothing.
    pub(crate) fn new(tick_ns: u64, late_max_s: f64) -> Self {
        let tick_s = tick_ns as f64 * 1e-9;
        Self { tick_s: if tick_s <= late_max_s { tick_s } else { 0.0 }, ..Self::default() }
    }

    /// By how many seconds a frame is late, if by more than `late_max_s`.
    pub(crate) fn take(&mut self, frame: &Frame, late_max_s: f64) -> Option<f64> {
        let tick = frame.device_tick.filter(|_| self.tick_s > 0.0)?;
        let at = frame.received.mono;
        let offset_s = at.seconds() - tick.0 as f64 * self.tick_s;
        // The clock of another epoch is another one.
        let least = self.least.filter(|_| frame.epoch == self.epoch);
        self.epoch = frame.epoch;
        let Some((least_s, since)) = least else {
            self.least = Some((offset_s, at));
            return None;
        };
        let drifted_s = least_s + SLOW_MAX * at.since(since).as_secs_f64();
        let late_s = offset_s - drifted_s;
        // A frame is sampled anywhere within a tick.
        if late_s > late_max_s + self.tick_s {
            self.least = Some((least_s, at));
            return Some(late_s);
        }
        self.least = Some((offset_s.min(drifted_s), at));
        None
    }
}

#[cfg(test)]
#[path = "lateness_tests.rs"]
mod tests;
