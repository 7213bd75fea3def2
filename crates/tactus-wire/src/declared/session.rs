//! The host's side: it only listens, because these devices stream by themselves.

use core::time::Duration;
use std::sync::Arc;

use super::ticks::TickLength;
use super::{DecodedFrame, Decoder, DecoderStats, Format, Framing};
use crate::sensor::{
    self, Action, Cause, Loss, LossEvidence, Memory, NO_FRAME_AFTER, Reading, SILENT_AFTER, StreamFault,
    Watchdog,
};

/// The longest delay of a frame on its way. If the device's clock advances between two frames by more than this beyond
/// the host's, somebody set it forward.
const DELAY_S: f64 = 1.0;

/// Reads one connection to a device whose format is described.
#[derive(Debug)]
pub struct Session {
    decoder: Decoder,
    watchdog: Watchdog,
    ticks: TickLength,
    wrap: Option<u64>,
    previous: Previous,
    /// As of the last fresh frame or the last reported loss.
    last_stats: DecoderStats,
    /// The device repeats frames: its frame count does not count readings.
    repeats: bool,
    memory: Memory,
}

/// The previous frame.
#[derive(Debug, Clone, Copy, Default)]
struct Previous {
    number: Option<u64>,
    /// The tick of the last fresh frame and when that frame came.
    tick: Option<(u64, Duration)>,
}

impl Session {
    /// A session that has not started.
    pub fn new(format: &Arc<Format>) -> Self {
        Self {
            decoder: Decoder::new(Arc::clone(format)),
            watchdog: Watchdog::default(),
            ticks: TickLength::of(format),
            wrap: format.sequence_wrap(),
            previous: Previous::default(),
            last_stats: DecoderStats::default(),
            repeats: false,
            memory: Memory::default(),
        }
    }

    fn describe(&mut self, fault: StreamFault) -> Loss {
        let now = self.decoder.stats();
        let before = core::mem::replace(&mut self.last_stats, now);
        let silent_s = SILENT_AFTER.as_secs();
        match fault {
            StreamFault::Silent => Loss::new(
                Cause::Silent,
                format!("nothing has come for {silent_s} s: is it switched on, and does it send by itself?"),
            ),
            StreamFault::Stale => Loss::new(
                Cause::Silent,
                format!(
                    "frames come, but nothing new in them for {silent_s} s: the device's clock or its count of frames \
                     stands still"
                ),
            ),
            StreamFault::NoFrame => Loss::new(
                Cause::Protocol,
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

impl sensor::Session for Session {
    fn name(&self) -> String {
        format!("declared, {}", self.decoder.format().name())
    }

    fn tick_ns(&self) -> u64 {
        self.ticks.unit_ns
    }

    fn packet_bytes(&self) -> Option<usize> {
        let format = self.decoder.format();
        (format.framing() == Framing::Packet).then(|| format.frame_bytes())
    }

    fn start(&mut self, now: Duration) -> Vec<Action> {
        self.watchdog.start(now);
        Vec::new()
    }

    fn receive_into(&mut self, now: Duration, bytes: &[u8], actions: &mut Vec<Action>) {
        let Self { decoder, watchdog, ticks, wrap, previous, last_stats, repeats, memory } = self;
        watchdog.bytes(now);
        decoder.push(bytes);
        while let Some(frame) = decoder.next_frame() {
            *repeats |= frame.stale;
            let came_twice = frame.sequence.is_some() && frame.sequence == previous.number;
            if frame.stale || came_twice {
                previous.number = frame.sequence;
                watchdog.stale_frame();
                continue;
            }
            let counted = wrap.filter(|_| !*repeats).and_then(|wrap| counted(&frame, previous.number, wrap));
            let new_clock = frame.new_clock || is_set_forward(&frame, previous.tick, *ticks, now);
            *previous = Previous { number: frame.sequence, tick: frame.tick.map(|tick| (tick, now)) };
            let mut reading = Reading {
                tick: frame.tick.map(|tick| ticks.convert(tick)),
                new_clock,
                evidence: LossEvidence::TimesOnly,
                counts: memory.counts(frame.counts.len(), |counts| counts.copy_from_slice(frame.counts)),
                bad: frame.bad.iter().filter_map(|element| u32::try_from(*element).ok()).collect(),
                temperature_c: None,
            };
            let stats_before = core::mem::replace(last_stats, decoder.stats());
            // Bytes that were skipped before the first frame belonged to no frame of this connection.
            let damaged = stats_before.frames > 0 && last_stats.skipped_bytes > stats_before.skipped_bytes;
            if let Some(counted) = counted {
                reading.evidence = counted;
            } else if damaged {
                reading.evidence = LossEvidence::Damage;
            }
            if watchdog.fresh_frame(now) {
                actions.push(Action::Connected { identity: None });
            }
            actions.push(Action::Reading(reading));
        }
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        let fault = self.watchdog.timer(now);
        fault.map(|fault| Action::Lost(self.describe(fault))).into_iter().collect()
    }

    fn deadline(&self) -> Option<Duration> {
        self.watchdog.deadline()
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

/// What the device's frame count shows; `None` where the count itself started again.
fn counted(frame: &DecodedFrame<'_>, previous: Option<u64>, wrap: u64) -> Option<LossEvidence> {
    let lost = frame.lost_before;
    let continues = previous
        .zip(frame.sequence)
        .is_some_and(|(previous, number)| number == previous.saturating_add(lost + 1));
    continues.then_some(LossEvidence::Counted { lost, wrap })
}

/// Whether the device's clock advanced by more than the host's clock allows.
fn is_set_forward(
    frame: &DecodedFrame<'_>,
    previous: Option<(u64, Duration)>,
    ticks: TickLength,
    now: Duration,
) -> bool {
    let Some((tick, (last_tick, last_came))) = frame.tick.zip(previous) else { return false };
    ticks.seconds(tick.saturating_sub(last_tick)) > now.saturating_sub(last_came).as_secs_f64() + DELAY_S
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
