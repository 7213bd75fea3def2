//! Boards that speak `anyskin`: they stream by themselves, without clock or count.

use std::time::Duration;

use tactus_wire::anyskin::{Decoder, DecoderStats, Frame};

use super::conversation::{Action, Before, Conversation, Loss, Reading};
use super::listening::{Heard, Listening, NO_FRAME_AFTER, SILENT_AFTER};
use crate::ErrorKind;

/// A board that is listened to.
#[derive(Debug, Default)]
pub(super) struct Board {
    decoder: Decoder,
    listening: Listening,
    /// As of the last frame.
    met: DecoderStats,
    any_frame: bool,
}

impl Board {
    fn read(&mut self, frame: &Frame) -> Reading {
        let met = std::mem::replace(&mut self.met, self.decoder.stats());
        let damaged = std::mem::replace(&mut self.any_frame, true) && met != self.met;
        let counts: Vec<f32> =
            frame.magnetometers.iter().flat_map(|magnetometer| magnetometer.field_ut).collect();
        Reading {
            tick: None,
            new_clock: false,
            before: if damaged { Before::Damage } else { Before::Times },
            bad: (0..)
                .zip(&counts)
                .filter(|(_, count)| !count.is_finite())
                .map(|(element, _)| element)
                .collect(),
            counts,
        }
    }

    fn describe(&self, heard: Heard) -> Loss {
        let DecoderStats { skipped_bytes, lost_steps } = self.decoder.stats();
        match heard {
            // No frame of this protocol is stale.
            Heard::Nothing | Heard::NothingNew => Loss::new(
                ErrorKind::Timeout,
                format!(
                    "nothing has come for {} s: is it switched on, and does its firmware stream in binary mode?",
                    SILENT_AFTER.as_secs()
                ),
            ),
            Heard::NoFrame => Loss::new(
                ErrorKind::Protocol,
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

impl Conversation for Board {
    fn start(&mut self, now: Duration) -> Vec<Action> {
        self.listening.start(now);
        Vec::new()
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut actions = Vec::new();
        self.listening.bytes(now);
        self.decoder.push(bytes);
        while let Some(frame) = self.decoder.next_frame() {
            if self.listening.fresh_frame(now) {
                actions.push(Action::Connected);
            }
            actions.push(Action::Reading(self.read(&frame)));
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
        let DecoderStats { skipped_bytes, lost_steps } = self.decoder.stats();
        format!("{skipped_bytes} bytes skipped, out of step {lost_steps} times")
    }
}

#[cfg(test)]
#[path = "anyskin_tests.rs"]
mod tests;
