//! Sequence numbers: how many frames were lost before the one that came.

use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime, pb};

use super::conversation::Before;

/// A frame that comes less than this many periods too late, by the host's clock alone, may just be late.
const LATE_PERIODS: f64 = 1.5;

/// Counts every frame that the sensor took or should have taken: by the device's own count, or by its clock or,
/// where that is another one than before or there is none, by the host's.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    rate_hz: f64,
    /// Length of a device tick, if it is short enough to tell frames apart.
    tick: Option<Duration>,
    /// Number of the present epoch; the first is 0.
    epoch: u32,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    seq: u64,
    tick: Option<DeviceTick>,
    received: MonoTime,
}

/// A frame that has come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// By the device's clock; comparable with the last frame's unless `cause` says otherwise.
    pub(super) tick: Option<DeviceTick>,
    /// What else is known of the way from the last frame.
    pub(super) before: Before,
    pub(super) received: MonoTime,
    /// Frames that came at once, this one and those behind it: by their arrival, they stand for as many periods.
    pub(super) together: usize,
    /// Frames that came between the last one and this, and were not taken.
    pub(super) passed_over: u64,
    pub(super) cause: Cause,
}

/// A frame's place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub(super) seq: u64,
    pub(super) epoch: u32,
    pub(super) flags: FrameFlags,
    pub(super) lost_before: u32,
    /// What to tell before the frame.
    pub(super) gap: Option<pb::Gap>,
}

/// Why frames may be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cause {
    /// They were lost on the way, or never sent.
    Link,
    /// The connection is another one.
    Reconnected,
    /// The device's clock is another one.
    ClockJumped,
    /// They came, and the service did not take them in time.
    HostTooSlow,
}

impl Sequence {
    /// No frames yet. A device without a clock has a tick of zero.
    pub(super) fn new(rate_hz: f64, tick: Duration) -> Self {
        // Of frames closer than two ticks a clock cannot tell how many there were.
        let tells_apart = !tick.is_zero() && 2.0 * tick.as_secs_f64() * rate_hz <= 1.0;
        Self { rate_hz, tick: tells_apart.then_some(tick), epoch: 0, last: None }
    }

    /// Places the next frame.
    pub(super) fn place(&mut self, arrival: Arrival) -> Place {
        let Arrival { tick, received, cause, .. } = arrival;
        let Some(last) = self.last else {
            self.last = Some(Last { seq: 0, tick, received });
            return Place {
                seq: 0,
                epoch: self.epoch,
                flags: FrameFlags::NEW_EPOCH,
                lost_before: 0,
                gap: None,
            };
        };
        let new_epoch = matches!(cause, Cause::Reconnected | Cause::ClockJumped);
        self.epoch += u32::from(new_epoch);
        let lost_before = self.missing(last, &arrival);
        let seq = last.seq + u64::from(lost_before) + 1;
        self.last = Some(Last { seq, tick, received });
        let gap = (lost_before > 0).then(|| pb::Gap {
            frames_lost: lost_before.into(),
            after_seq: last.seq,
            next_seq: seq,
            reason: cause.reason().to_owned(),
        });
        let mut flags = FrameFlags::default();
        if new_epoch {
            flags = flags.with(FrameFlags::NEW_EPOCH);
        }
        if gap.is_some() {
            flags = flags.with(FrameFlags::GAP_BEFORE);
        }
        Place { seq, epoch: self.epoch, flags, lost_before, gap }
    }
}

impl Sequence {
    fn missing(&self, last: Last, arrival: &Arrival) -> u32 {
        let periods = arrival.received.since(last.received).as_secs_f64() * self.rate_hz;
        let too_long = periods - arrival.together as f64;
        let by_host = too_long.round();
        let by_ticks = || {
            let (tick, [from, to]) = (self.tick?, [last.tick?, arrival.tick?]);
            Some((to.0.saturating_sub(from.0) as f64 * tick.as_secs_f64() * self.rate_hz).round() - 1.0)
        };
        let missing = match (arrival.cause, arrival.before) {
            (Cause::Link | Cause::HostTooSlow | Cause::ClockJumped, Before::Numbers { lost, wrap }) => {
                let lost = lost.saturating_add(arrival.passed_over) as f64;
                // Whole rounds of the count, which it cannot tell itself.
                lost + ((by_host - lost) / wrap as f64).round().max(0.0) * wrap as f64
            }
            (Cause::Reconnected | Cause::ClockJumped, _) => by_host,
            (Cause::Link | Cause::HostTooSlow, Before::Times) => {
                by_ticks().unwrap_or(if too_long < LATE_PERIODS { 0.0 } else { by_host })
            }
            (Cause::Link | Cause::HostTooSlow, Before::Damage) => by_ticks().unwrap_or(by_host),
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let missing = missing.max(arrival.passed_over as f64) as u32;
        missing
    }
}

impl Cause {
    fn reason(self) -> &'static str {
        match self {
            Self::Link => "they never came from the device",
            Self::Reconnected => "the device was connected anew",
            Self::ClockJumped => "the device's clock jumped",
            Self::HostTooSlow => "the service was too slow to take them",
        }
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;
