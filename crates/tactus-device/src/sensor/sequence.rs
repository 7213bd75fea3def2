//! Sequence numbers: how many frames were lost before the one that came.

use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime, pb};

/// Counts every frame that the sensor took or should have taken, by its clock or, where that is another one
/// than before, by the host's.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    rate_hz: f64,
    /// Length of a device tick.
    tick: Duration,
    /// Number of the present epoch; the first is 0.
    epoch: u32,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    seq: u64,
    tick: DeviceTick,
    received: MonoTime,
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
    /// No frames yet.
    pub(super) fn new(rate_hz: f64, tick: Duration) -> Self {
        Self { rate_hz, tick, epoch: 0, last: None }
    }

    /// Places the next frame. Its tick is comparable with the last one's unless `cause` says otherwise.
    pub(super) fn place(&mut self, tick: DeviceTick, received: MonoTime, cause: Cause) -> Place {
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
        let since_last_s = if new_epoch {
            self.epoch += 1;
            received.since(last.received).as_secs_f64()
        } else {
            tick.0.saturating_sub(last.tick.0) as f64 * self.tick.as_secs_f64()
        };
        let periods = (since_last_s * self.rate_hz).round();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let lost_before = (periods - 1.0).max(0.0) as u32;
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

impl Cause {
    fn reason(self) -> &'static str {
        match self {
            Self::Link => "the device's clock says that frames are missing",
            Self::Reconnected => "the device was connected anew",
            Self::ClockJumped => "the device's clock jumped",
            Self::HostTooSlow => "the service was too slow to take them",
        }
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;
