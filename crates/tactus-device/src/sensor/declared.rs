//! Devices whose frames a description tells (`tactus.link/1`): they stream by themselves.

use std::sync::Arc;
use std::time::Duration;

use tactus_schema::DeviceTick;
use tactus_wire::declared::{Decoder, DecoderStats, Format, Frame};

use super::conversation::{Action, Before, Conversation, Loss, Reading};
use super::listening::{Heard, Listening, NO_FRAME_AFTER, SILENT_AFTER};
use crate::ErrorKind;

/// How much more the device's clock may advance than the host's between two frames: what a frame may be delayed
/// on the way. More, and the clock was set forward.
const DELAY_S: f64 = 1.0;

/// Ticks that are no whole number of ns are told in ns below this length, and rounded to whole ns above: that is wrong
/// by less than quartzes are.
const FINE_TICK_NS: f64 = 100_000.0;

/// A device that is listened to.
#[derive(Debug)]
pub(super) struct Listener {
    decoder: Decoder,
    listening: Listening,
    ticks: TickLength,
    wrap: Option<u64>,
    last: Last,
    /// As of the last fresh frame, or of what was told since.
    met: DecoderStats,
    /// The device repeats frames, so that its count of frames is none of readings.
    repeats: bool,
}

/// Of the frame before.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    number: Option<u64>,
    /// The tick of a fresh frame and when that came.
    tick: Option<(u64, Duration)>,
}

/// How a device's ticks are told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TickLength {
    /// Length of a tick as it is told; 0 without a clock.
    pub(super) told_ns: u64,
    /// Ticks told for one of the device's, if not one.
    per_tick: Option<f64>,
}

impl TickLength {
    /// That of a format's clock.
    pub(super) fn of(format: &Format) -> Self {
        let Some(tick_ns) = format.tick_ns() else { return Self { told_ns: 0, per_tick: None } };
        if tick_ns.fract() != 0.0 && tick_ns < FINE_TICK_NS {
            return Self { told_ns: 1, per_tick: Some(tick_ns) };
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive; saturates, as it should"
        )]
        let told_ns = tick_ns.round() as u64;
        Self { told_ns, per_tick: None }
    }

    fn tell(self, tick: u64) -> DeviceTick {
        let Some(per_tick) = self.per_tick else { return DeviceTick(tick) };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive; saturates, as it should"
        )]
        let told = (tick as f64 * per_tick).round() as u64;
        DeviceTick(told)
    }

    fn seconds(self, ticks: u64) -> f64 {
        ticks as f64 * self.per_tick.unwrap_or(1.0) * self.told_ns as f64 * 1e-9
    }
}

impl Listener {
    pub(super) fn new(format: &Arc<Format>) -> Self {
        Self {
            decoder: Decoder::new(Arc::clone(format)),
            listening: Listening::default(),
            ticks: TickLength::of(format),
            wrap: format.sequence_wrap(),
            last: Last::default(),
            met: DecoderStats::default(),
            repeats: false,
        }
    }

    fn describe(&mut self, heard: Heard) -> Loss {
        let now = self.decoder.stats();
        let before = std::mem::replace(&mut self.met, now);
        let silent_s = SILENT_AFTER.as_secs();
        match heard {
            Heard::Nothing => Loss::new(
                ErrorKind::Timeout,
                format!("nothing has come for {silent_s} s: is it switched on, and does it send by itself?"),
            ),
            Heard::NothingNew => Loss::new(
                ErrorKind::Timeout,
                format!(
                    "frames come, but nothing new in them for {silent_s} s: the device's clock or its count of frames \
                     stands still"
                ),
            ),
            Heard::NoFrame => Loss::new(
                ErrorKind::Protocol,
                format!(
                    "bytes come, but no frame of {:?} for {} s ({} bytes skipped, {} bad checksums, {} bad lengths, {} \
                     bad ends): is it the device that the rig file describes, and is the bit rate right? To correct \
                     the description, record some of its bytes and run `tactus link check FORMAT.toml --capture BYTES`",
                    self.decoder.format().name(),
                    NO_FRAME_AFTER.as_secs(),
                    now.skipped_bytes - before.skipped_bytes,
                    now.bad_checksums - before.bad_checksums,
                    now.bad_lengths - before.bad_lengths,
                    now.bad_ends - before.bad_ends,
                ),
            ),
        }
    }
}

impl Conversation for Listener {
    fn start(&mut self, now: Duration) -> Vec<Action> {
        self.listening.start(now);
        Vec::new()
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut actions = Vec::new();
        let Self { decoder, listening, ticks, wrap, last, met, repeats } = self;
        listening.bytes(now);
        decoder.push(bytes);
        while let Some(frame) = decoder.next_frame() {
            *repeats |= frame.stale;
            let came_twice = frame.sequence.is_some() && frame.sequence == last.number;
            if frame.stale || came_twice {
                last.number = frame.sequence;
                listening.stale_frame();
                continue;
            }
            let before = match wrap.filter(|_| !*repeats) {
                Some(wrap) => numbers(&frame, last.number, wrap),
                None => Before::Times,
            };
            let new_clock = frame.new_clock || is_set_forward(&frame, last.tick, *ticks, now);
            *last = Last { number: frame.sequence, tick: frame.tick.map(|tick| (tick, now)) };
            let reading = Reading {
                tick: frame.tick.map(|tick| ticks.tell(tick)),
                new_clock,
                before,
                counts: frame.counts.to_vec(),
                bad: frame.bad.iter().filter_map(|element| u32::try_from(*element).ok()).collect(),
            };
            let met_before = std::mem::replace(met, decoder.stats());
            // What was skipped before the first frame were no frames of this connection.
            let damaged = met_before.frames > 0 && met.skipped_bytes > met_before.skipped_bytes;
            let before = if damaged && before == Before::Times { Before::Damage } else { before };
            if listening.fresh_frame(now) {
                actions.push(Action::Connected);
            }
            actions.push(Action::Reading(Reading { before, ..reading }));
        }
        actions
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        let heard = self.listening.timer(now);
        heard.map(|heard| Action::Lost(self.describe(heard))).into_iter().collect()
    }

    fn deadline(&self) -> Option<Duration> {
        self.listening.deadline()
    }

    fn quality(&self) -> String {
        let stats = self.decoder.stats();
        format!(
            "{} frames, {} bytes skipped, {} bad checksums, {} bad lengths, {} bad ends, {} stale frames",
            stats.frames,
            stats.skipped_bytes,
            stats.bad_checksums,
            stats.bad_lengths,
            stats.bad_ends,
            stats.stale_frames
        )
    }
}

/// How many frames the device's count says are missing; times tell it where the count began anew.
fn numbers(frame: &Frame<'_>, last: Option<u64>, wrap: u64) -> Before {
    let lost = frame.lost_before;
    let goes_on =
        last.zip(frame.sequence).is_some_and(|(last, number)| number == last.saturating_add(lost + 1));
    if goes_on { Before::Numbers { lost, wrap } } else { Before::Times }
}

/// Whether the device's clock went on by more than the host's time allows.
fn is_set_forward(
    frame: &Frame<'_>,
    last: Option<(u64, Duration)>,
    ticks: TickLength,
    now: Duration,
) -> bool {
    let Some((tick, (last_tick, last_came))) = frame.tick.zip(last) else { return false };
    ticks.seconds(tick.saturating_sub(last_tick)) > now.saturating_sub(last_came).as_secs_f64() + DELAY_S
}

#[cfg(test)]
#[path = "declared_tests.rs"]
mod tests;
