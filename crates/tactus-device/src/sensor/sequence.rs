//! Numbers frames, and counts the frames that are missing before each.

use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime, pb};
use tactus_wire::sensor::LossEvidence;

/// A frame this many periods late, by the host's clock alone, may follow lost frames.
const BEHIND_PERIODS: f64 = 0.5;

/// The longest delay by buffers on the way. Frames that are later than this were lost.
const BUFFERED_S: f64 = 1.0;

/// A lateness must last for this long, and for half a period, before it is a loss: a busy host delays the frames of fast sensors by
/// many periods.
const LASTS_S: f64 = 0.005;

/// The longest tick, in frame periods, of a clock that can confirm a loss.
const COARSE_PERIODS_MAX: f64 = 2.0;

/// Share of a small lateness that is discarded with each frame, because real rates differ slightly from the rig's.
const FORGOTTEN: f64 = 0.1;

/// Numbers every frame that the sensor took or should have taken. Missing frames are counted by the device's own count;
/// without one by its clock; and by the host's clock if the device has none, a new one, or one whose ticks are about as long as
/// the frames: that one has to confirm them.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    rate_hz: f64,
    /// Length of a device tick; `None` without a clock, or if a tick is too long to resolve frames.
    tick: Option<Duration>,
    /// Length of a tick that is too long to count missing frames, but short enough to confirm them.
    coarse_tick: Option<Duration>,
    /// Number of the present epoch; the first is 0.
    epoch: u32,
    last: Option<PreviousFrame>,
}

#[derive(Debug, Clone, Copy)]
struct PreviousFrame {
    seq: u64,
    tick: Option<DeviceTick>,
    received: MonoTime,
    lateness: Lateness,
}

/// How late a frame was, in frame periods, after the missing ones were counted.
#[derive(Debug, Clone, Copy, Default)]
struct Lateness {
    by_host: f64,
    /// By a coarse clock of the device.
    by_clock: f64,
    /// Since when each frame was late by half a period or more, and the least of their latenesses.
    lasts: Option<(MonoTime, f64)>,
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
        Self { rate_hz, tick: None, coarse_tick: None, epoch: 0, last: None }
    }

    /// Sets the length of the device's tick; zero for a device without a clock.
    pub(super) fn set_tick(&mut self, tick: Duration) {
        // Between frames closer than two ticks, a clock cannot count the missing ones.
        let periods = tick.as_secs_f64() * self.rate_hz;
        let resolves_frames = !tick.is_zero() && 2.0 * periods <= 1.0;
        self.tick = resolves_frames.then_some(tick);
        self.coarse_tick =
            (!resolves_frames && periods > 0.0 && periods <= COARSE_PERIODS_MAX).then_some(tick);
    }

    /// Numbers the next frame.
    pub(super) fn place(&mut self, arrival: ReceivedFrame) -> FramePlacement {
        let ReceivedFrame { tick, received, cause, .. } = arrival;
        let Some(last) = self.last else {
            self.last = Some(PreviousFrame { seq: 0, tick, received, lateness: Lateness::default() });
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
        let (lost_before, lateness) = self.missing(last, &arrival);
        let seq = last.seq + u64::from(lost_before) + 1;
        self.last = Some(PreviousFrame { seq, tick, received, lateness });
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
    /// How many frames are missing, and how late the frame is after those are counted.
    fn missing(&self, last: PreviousFrame, arrival: &ReceivedFrame) -> (u32, Lateness) {
        let periods = arrival.received.since(last.received).as_secs_f64() * self.rate_hz;
        let by_host = (periods - arrival.together as f64).round();
        let periods_by = |tick: Option<Duration>| {
            let (tick, [from, to]) = (tick?, [last.tick?, arrival.tick?]);
            Some(to.0.saturating_sub(from.0) as f64 * tick.as_secs_f64() * self.rate_hz)
        };
        let dropped = arrival.dropped as f64;
        let mut lateness = Lateness::default();
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
            (GapCause::Link | GapCause::HostTooSlow, _) => {
                if let Some(periods) = periods_by(self.tick) {
                    periods.round() - 1.0
                } else {
                    let by_clock = periods_by(self.coarse_tick);
                    let lost;
                    (lost, lateness) = self.late(last.lateness, periods, by_clock, arrival);
                    lost + dropped
                }
            }
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let missing = missing.max(dropped) as u32;
        (missing, lateness)
    }

    /// What is missing by the periods that passed since the last frame by the host's and the device's clock, and how late the frame is
    /// then.
    fn late(
        &self,
        last: Lateness,
        by_host: f64,
        by_clock: Option<f64>,
        arrival: &ReceivedFrame,
    ) -> (f64, Lateness) {
        let late = |last: f64, periods: f64| last + periods - 1.0 - arrival.dropped as f64;
        let by_host = late(last.by_host, by_host);
        let by_clock = by_clock.map(|periods| late(last.by_clock, periods));
        let both = by_clock.map_or(by_host, |by_clock| by_host.min(by_clock));
        let (lost, lasts) = self.missing_by_arrivals(last.lasts, both, arrival);
        let by_clock = settled(by_clock.unwrap_or_default() - lost);
        (lost, Lateness { by_host: settled(by_host - lost), by_clock, lasts })
    }

    /// Missing frames by times of arrival, which a coarse clock of the device may confirm. A late frame may follow lost frames, or may
    /// itself be delayed. Delayed frames arrive close together, and the last of them is in time again. A loss is therefore counted
    /// when the lateness lasts; and at once if bytes were damaged or the silence exceeds any buffer.
    ///
    /// Also returns since when the frames are late, and the least of their latenesses.
    fn missing_by_arrivals(
        &self,
        lasts: Option<(MonoTime, f64)>,
        late: f64,
        arrival: &ReceivedFrame,
    ) -> (f64, Option<(MonoTime, f64)>) {
        let alone = late - (arrival.together.max(1) - 1) as f64;
        if arrival.evidence == LossEvidence::Damage || alone >= BUFFERED_S * self.rate_hz {
            return (alone.round().max(0.0), None);
        }
        if late < BEHIND_PERIODS {
            return (0.0, None);
        }
        let (since, least) =
            lasts.map_or((arrival.received, late), |(since, least)| (since, least.min(late)));
        let lasted_s = arrival.received.since(since).as_secs_f64();
        if lasted_s >= (BEHIND_PERIODS / self.rate_hz).max(LASTS_S) {
            (least.round(), None)
        } else {
            (0.0, Some((since, least)))
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
