//! Unwraps the controller's clock, and detects jumps.

use core::time::Duration;

/// A frame whose tick is up to this much earlier came late. If it is earlier than that, the clock was set back.
const LATE_MS: u32 = 1000;

/// The longest delay of a frame on its way. If the controller's clock advances between two frames by more than this beyond
/// the host's, it was set forward.
const DELAY_MS: u128 = 1000;

/// Converts the wrapping 32-bit ticks of successive frames to 64 bits.
#[derive(Debug, Clone, Default)]
pub(super) struct TickUnwrapper {
    last: Option<PreviousTick>,
    /// Tick of a frame that seemed late. If the next frame continues from it, the clock was set back.
    late: Option<u32>,
}

#[derive(Debug, Clone, Copy)]
struct PreviousTick {
    raw_ms: u32,
    tick_ms: u64,
    received: Duration,
}

/// How a frame's tick compares with the previous one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TickOrder {
    /// Later than the previous frame, on the same clock.
    Next { tick_ms: u64 },
    /// The first frame, or the first after a jump of the controller's clock.
    NewClock { tick_ms: u64 },
    /// A repeated or late frame.
    Stale,
}

impl TickUnwrapper {
    /// Compares a frame that was received at `now` with the previous one.
    pub(super) fn place(&mut self, now: Duration, raw_ms: u32) -> TickOrder {
        let Some(last) = self.last else { return self.new_clock(now, raw_ms) };
        let (ahead_ms, behind_ms) = (raw_ms.wrapping_sub(last.raw_ms), last.raw_ms.wrapping_sub(raw_ms));
        if ahead_ms == 0 {
            return TickOrder::Stale;
        }
        if ahead_ms < behind_ms {
            let elapsed_ms = now.saturating_sub(last.received).as_millis();
            if u128::from(ahead_ms) > elapsed_ms + DELAY_MS {
                return self.new_clock(now, raw_ms);
            }
            let tick_ms = last.tick_ms + u64::from(ahead_ms);
            self.last = Some(PreviousTick { raw_ms, tick_ms, received: now });
            self.late = None;
            return TickOrder::Next { tick_ms };
        }
        let goes_on = self.late.is_some_and(|late| (1..LATE_MS).contains(&raw_ms.wrapping_sub(late)));
        if behind_ms > LATE_MS || goes_on {
            return self.new_clock(now, raw_ms);
        }
        self.late = Some(raw_ms);
        TickOrder::Stale
    }

    fn new_clock(&mut self, now: Duration, raw_ms: u32) -> TickOrder {
        let tick_ms = u64::from(raw_ms);
        self.last = Some(PreviousTick { raw_ms, tick_ms, received: now });
        self.late = None;
        TickOrder::NewClock { tick_ms }
    }
}

#[cfg(test)]
#[path = "ticks_tests.rs"]
mod tests;
