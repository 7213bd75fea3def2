//! The host's side: it only listens, because the board streams by itself.

use core::time::Duration;
use std::sync::Arc;

use super::{DecodedFrame, Decoder, DecoderStats};
use crate::sensor::{
    self, Action, Cause, Loss, LossEvidence, NO_FRAME_AFTER, Reading, SILENT_AFTER, StreamFault, Watchdog,
};

/// Reads one connection to a board. Counts are microteslas, by magnetometer and axis.
#[derive(Debug, Default)]
pub struct Session {
    decoder: Decoder,
    watchdog: Watchdog,
    /// As of the last frame.
    last_stats: DecoderStats,
    any_frame: bool,
}

impl Session {
    /// A session that has not started.
    pub fn new() -> Self {
        Self::default()
    }

    fn read(&mut self, frame: &DecodedFrame) -> Reading {
        let last_stats = core::mem::replace(&mut self.last_stats, self.decoder.stats());
        let damaged = core::mem::replace(&mut self.any_frame, true) && last_stats != self.last_stats;
        let counts: Arc<[f32]> =
            frame.magnetometers.iter().flat_map(|magnetometer| magnetometer.field_ut).collect();
        let is_bad = |(_, count): &(u32, &f32)| !count.is_finite();
        Reading {
            tick: None,
            new_clock: false,
            evidence: if damaged { LossEvidence::Damage } else { LossEvidence::TimesOnly },
            bad: (0..).zip(counts.iter()).filter(is_bad).map(|(element, _)| element).collect(),
            counts,
            temperature_c: frame.temperature_c(),
        }
    }

    fn describe(&self, fault: StreamFault) -> Loss {
        let DecoderStats { skipped_bytes, lost_steps } = self.decoder.stats();
        match fault {
            // Every frame of this protocol counts as fresh.
            StreamFault::Silent | StreamFault::Stale => Loss::new(
                Cause::Silent,
                format!(
                    "nothing has come for {} s: is it switched on, and does its firmware stream in binary mode?",
                    SILENT_AFTER.as_secs()
                ),
            ),
            StreamFault::NoFrame => Loss::new(
                Cause::Protocol,
                format!(
                    "bytes come, but no AnySkin frame for {} s ({skipped_bytes} bytes skipped, out of step {lost_steps} \
                     times): is it the board that the rig file describes, in binary mode, and is the bit rate right? \
                     For a board that sends other frames, describe them (`protocol = \"declared\"`) and try the \
                     description with `tactus link check`",
                    NO_FRAME_AFTER.as_secs()
                ),
            ),
        }
    }
}

impl sensor::Session for Session {
    fn name(&self) -> String {
        "anyskin".to_owned()
    }

    fn tick_ns(&self) -> u64 {
        0
    }

    fn start(&mut self, now: Duration) -> Vec<Action> {
        self.watchdog.start(now);
        Vec::new()
    }

    fn receive_into(&mut self, now: Duration, bytes: &[u8], actions: &mut Vec<Action>) {
        self.watchdog.bytes(now);
        self.decoder.push(bytes);
        while let Some(frame) = self.decoder.next_frame() {
            if self.watchdog.fresh_frame(now) {
                actions.push(Action::Connected { identity: None });
            }
            actions.push(Action::Reading(self.read(&frame)));
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
        let DecoderStats { skipped_bytes, lost_steps } = self.decoder.stats();
        format!("{skipped_bytes} bytes skipped, out of step {lost_steps} times")
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
