//! Numbers frames, and counts the frames that are missing before each.

use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime, pb};
use tactus_wire::sensor::LossEvidence;

/// A frame this many periods late, by the host's clock alone, may follow lost frames.
const BEHIND_PERIODS: f64 = 0.5;

/// The longest delay by buffers on the way. Frames that are later than this were lost.
const BUFFERED_S: f64 = 1.0;

/// Share of a small lateness that is discarded with each frame, because real rates differ slightly from the rig's.
const FORGOTTEN: f64 = 0.1;

/// Numbers every frame that the sensor took or should have taken. Missing frames are counted by the device's own count;
/// without one by its clock; and by the host's clock if the device has none, or a new one.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    rate_hz: f64,
    /// Length of a device tick; `None` without a clock, or if a tick is too long to resolve frames.
    tick: Option<Duration>,
    /// Number of the present epoch; the first is 0.
    epoch: u32,
    last: Option<PreviousFrame>,
}

#[derive(Debug, Clone, Copy)]
struct PreviousFrame {
    seq: u64,
    tick: Option<DeviceTick>,
    received: MonoTime,
    /// How late it was by the host's clock, in frame periods.
    late_periods: f64,
}

/// A frame as it arrived, before it has a number.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReceivedFrame {
    /// By the device's clock; comparable with the previous frame's unless `cause` says otherwise.
    pub(super) tick: Option<DeviceTick>,
    pub(super) evidence: LossEvidence,
    pub(super) received: MonoTime,
    /// This frame and those behind it that arrived at the same time; together they stand for as many periods.
    pub(super) together: usize,
    /// Frames that arrived since the previous one, and were dropped by the service.
    pub(super) dropped: u64,
    pub(super) cause: GapCause,
}

/// The number of a frame, and what is missing before it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FramePlacement {
    pub(super) seq: u64,
    pub(super) epoch: u32,
    pub(super) flags: FrameFlags,
    pub(super) lost_before: u32,
    /// To be reported before the frame.
    pub(super) gap: Option<pb::Gap>,
}

/// Why frames are missing, if any are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GapCause {
    /// They were lost on the link, or never sent.
    Link,
    /// The device was connected again.
    Reconnected,
    /// The device's clock jumped.
    ClockJumped,
    /// They arrived, but the service was too slow to take them.
    HostTooSlow,
}

impl Sequence {
    /// No frames yet, and no device's clock.
    pub(super) fn new(rate_hz: f64) -> Self {
        Self { rate_hz, tick: None, epoch: 0, last: None }
    }

    /// Sets the length of the device's tick; zero for a device without a clock.
    pub(super) fn set_tick(&mut self, tick: Duration) {
        // Between frames closer than two ticks, a clock cannot count the missing ones.
        let resolves_frames = !tick.is_zero() && 2.0 * tick.as_secs_f64() * self.rate_hz <= 1.0;
        self.tick = resolves_frames.then_some(tick);
    }

    /// Numbers the next frame.
    pub(super) fn place(&mut self, arrival: ReceivedFrame) -> FramePlacement {
        let ReceivedFrame { tick, received, cause, .. } = arrival;
        let Some(last) = self.last else {
            self.last = Some(PreviousFrame { seq: 0, tick, received, late_periods: 0.0 });
            return FramePlacement {
                seq: 0,
                epoch: self.epoch,
                flags: FrameFlags::NEW_EPOCH,
                lost_before: 0,
                gap: None,
            };
        };
        let new_epoch = matches!(cause, GapCause::Reconnected | GapCause::ClockJumped);
        self.epoch += u32::from(new_epoch);
        let (lost_before, late_periods) = self.missing(last, &arrival);
        let seq = last.seq + u64::from(lost_before) + 1;
        self.last = Some(PreviousFrame { seq, tick, received, late_periods });
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
        FramePlacement { seq, epoch: self.epoch, flags, lost_before, gap }
    }
}

impl Sequence {
    /// How many frames are missing, and how many periods late the frame is after those are counted.
    fn missing(&self, last: PreviousFrame, arrival: &ReceivedFrame) -> (u32, f64) {
        let periods = arrival.received.since(last.received).as_secs_f64() * self.rate_hz;
        let by_host = (periods - arrival.together as f64).round();
        let by_ticks = || {
            let (tick, [from, to]) = (self.tick?, [last.tick?, arrival.tick?]);
            Some((to.0.saturating_sub(from.0) as f64 * tick.as_secs_f64() * self.rate_hz).round() - 1.0)
        };
        let dropped = arrival.dropped as f64;
        let mut late_periods = 0.0;
        let missing = match (arrival.cause, arrival.evidence) {
            (
                GapCause::Link | GapCause::HostTooSlow | GapCause::ClockJumped,
                LossEvidence::Counted { lost, wrap },
            ) => {
                let lost = lost as f64 + dropped;
                // Whole rounds of the count, which only the host's clock shows.
                lost + ((by_host - lost) / wrap as f64).round().max(0.0) * wrap as f64
            }
            (GapCause::Reconnected | GapCause::ClockJumped, _) => by_host,
            (GapCause::Link | GapCause::HostTooSlow, evidence) => by_ticks().unwrap_or_else(|| {
                let late = last.late_periods + periods - 1.0 - dropped;
                let lost =
                    self.missing_by_arrivals(last.late_periods, late, periods, evidence, arrival.together);
                late_periods = settled(late - lost);
                lost + dropped
            }),
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let missing = missing.max(dropped) as u32;
        (missing, late_periods)
    }

    /// Missing frames by times of arrival alone. A single late frame may follow lost frames, or may itself be delayed.
    /// Delayed frames arrive close together, and the last of them is in time again. A loss is therefore counted when the
    /// next frame, a period later, is as late; and at once if bytes were damaged or the silence exceeds any buffer.
    fn missing_by_arrivals(
        &self,
        was_late: f64,
        late: f64,
        periods: f64,
        evidence: LossEvidence,
        together: usize,
    ) -> f64 {
        let alone = late - (together.max(1) - 1) as f64;
        if evidence == LossEvidence::Damage || alone >= BUFFERED_S * self.rate_hz {
            alone.round().max(0.0)
        } else if periods >= BEHIND_PERIODS && was_late >= BEHIND_PERIODS && late >= BEHIND_PERIODS {
            was_late.min(late).round()
        } else {
            0.0
        }
    }
}

/// The lateness to carry to the next frame: 0 after an early frame, a reduced one after a slightly late frame.
fn settled(late_periods: f64) -> f64 {
    if late_periods < BEHIND_PERIODS { late_periods.max(0.0) * (1.0 - FORGOTTEN) } else { late_periods }
}

impl GapCause {
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
