//! Sequence numbers: how many frames were lost before the one that came.

use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime, pb};
use tactus_wire::sensor::LossEvidence;

/// By the host's clock alone, a frame this many periods behind its time may be one behind a loss.
const BEHIND_PERIODS: f64 = 0.5;

/// What is buffered on the way comes within this; what is later than that was lost.
const BUFFERED_S: f64 = 1.0;

/// How much of a small lateness is forgotten with each frame: rates are not quite what the rig says.
const FORGOTTEN: f64 = 0.1;

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
    /// Behind its time, by the host's clock.
    late_periods: f64,
}

/// A frame that has come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// By the device's clock; comparable with the last frame's unless `cause` says otherwise.
    pub(super) tick: Option<DeviceTick>,
    /// What else is known of the way from the last frame.
    pub(super) evidence: LossEvidence,
    pub(super) received: MonoTime,
    /// Frames that came at once, this one and those behind it: by their arrival, they stand for as many periods.
    pub(super) together: usize,
    /// Frames that came between the last one and this, and were not taken.
    pub(super) passed_over: u64,
    pub(super) cause: GapCause,
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
pub(super) enum GapCause {
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

    /// Places the next frame.
    pub(super) fn place(&mut self, arrival: Arrival) -> Place {
        let Arrival { tick, received, cause, .. } = arrival;
        let Some(last) = self.last else {
            self.last = Some(Last { seq: 0, tick, received, late_periods: 0.0 });
            return Place {
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
        self.last = Some(Last { seq, tick, received, late_periods });
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
    /// How many frames are missing, and by how many periods the arrival is late if so many are.
    fn missing(&self, last: Last, arrival: &Arrival) -> (u32, f64) {
        let periods = arrival.received.since(last.received).as_secs_f64() * self.rate_hz;
        let by_host = (periods - arrival.together as f64).round();
        let by_ticks = || {
            let (tick, [from, to]) = (self.tick?, [last.tick?, arrival.tick?]);
            Some((to.0.saturating_sub(from.0) as f64 * tick.as_secs_f64() * self.rate_hz).round() - 1.0)
        };
        let passed_over = arrival.passed_over as f64;
        let mut late_periods = 0.0;
        let missing = match (arrival.cause, arrival.evidence) {
            (
                GapCause::Link | GapCause::HostTooSlow | GapCause::ClockJumped,
                LossEvidence::Counted { lost, wrap },
            ) => {
                let lost = lost as f64 + passed_over;
                // Whole rounds of the count, which it cannot tell itself.
                lost + ((by_host - lost) / wrap as f64).round().max(0.0) * wrap as f64
            }
            (GapCause::Reconnected | GapCause::ClockJumped, _) => by_host,
            (GapCause::Link | GapCause::HostTooSlow, evidence) => by_ticks().unwrap_or_else(|| {
                let late = last.late_periods + periods - 1.0 - passed_over;
                let lost =
                    self.missing_by_arrivals(last.late_periods, late, periods, evidence, arrival.together);
                late_periods = settled(late - lost);
                lost + passed_over
            }),
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let missing = missing.max(passed_over) as u32;
        (missing, late_periods)
    }

    /// A frame that is late and stands alone may have been lost ones' follower or just slow: those that were held up
    /// come close behind each other, and then the last of them is in time. So a loss is told when the frame after
    /// it, a period later, is as late; at once if bytes were damaged or the silence was longer than any buffer.
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

/// The lateness to go on with: none of a frame that came early, less of one that was hardly late.
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
