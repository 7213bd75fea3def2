//! Elements that speak `singletact`: polled one after the other, a frame a round; rounds without one are counted.

use std::time::Duration;

use tactus_schema::DeviceTick;
use tactus_wire::singletact::{self, Config, ConfigError, ReplyError, Request, Session};

use super::conversation::{Action, Before, Conversation, Loss, Reading};
use crate::ErrorKind;

/// Elements that are polled over one interface board.
#[derive(Debug)]
pub(super) struct Poller {
    session: Session,
    first_address: u8,
    beat: Beat,
    round: Round,
    /// By element.
    lost: Vec<bool>,
    flows: bool,
    /// Bytes skipped and replies to no request, as of the last frame.
    met: u64,
}

/// The beat of rounds, as the session keeps it: a round that is late by an interval or more begins a new beat.
#[derive(Debug)]
struct Beat {
    interval: Duration,
    begun: Option<Duration>,
    /// Beats since the last frame, the present one too.
    missed: u64,
}

/// The readings of the round in progress.
#[derive(Debug)]
struct Round {
    counts: Vec<Option<u16>>,
    tick: u64,
    new_clock: bool,
}

impl Poller {
    /// Polls a round as often as the array is to be read.
    ///
    /// # Errors
    /// Addresses that cannot be polled.
    pub(super) fn new(addresses: &[u8], rate_hz: f64) -> Result<Self, ConfigError> {
        let interval = Duration::try_from_secs_f64(rate_hz.recip()).unwrap_or(Duration::ZERO);
        let elements = addresses.len();
        Ok(Self {
            session: Session::new(Config { addresses: addresses.to_vec(), interval })?,
            first_address: addresses.first().copied().unwrap_or_default(),
            beat: Beat { interval, begun: None, missed: 0 },
            round: Round::new(elements),
            lost: vec![false; elements],
            flows: false,
            met: 0,
        })
    }

    fn translate(&mut self, now: Duration, actions: Vec<singletact::Action>) -> Vec<Action> {
        let mut translated = Vec::new();
        for action in actions {
            match action {
                singletact::Action::Send(request) => {
                    if request.address == self.first_address {
                        self.end_round(&mut translated);
                        self.beat.round_begins(now);
                    }
                    translated.push(send(&request));
                }
                singletact::Action::Reading(reading) => {
                    if let Some(lost) = self.lost.get_mut(reading.element) {
                        *lost = false;
                    }
                    self.round.take(&reading);
                    if reading.element + 1 == self.lost.len() {
                        self.end_round(&mut translated);
                    }
                }
                singletact::Action::Lost { element, address, loss } => {
                    self.lose(element, address, loss, &mut translated);
                }
            }
        }
        translated
    }

    /// A frame, if any element was read in this round.
    fn end_round(&mut self, to: &mut Vec<Action>) {
        let round = std::mem::replace(&mut self.round, Round::new(self.lost.len()));
        let missed = self.beat.missed.saturating_sub(1);
        let Some(reading) = round.reading(missed) else { return };
        self.beat.missed = 0;
        if !std::mem::replace(&mut self.flows, true) {
            to.push(Action::Connected);
        }
        self.met = self.met_now();
        to.push(Action::Reading(reading));
    }

    /// The array is lost with its last element; until then the elements that are left are read.
    fn lose(&mut self, element: usize, address: u8, loss: singletact::Loss, to: &mut Vec<Action>) {
        if let Some(lost) = self.lost.get_mut(element) {
            *lost = true;
        }
        if self.lost.iter().all(|lost| *lost) {
            self.flows = false;
            to.push(Action::Lost(self.describe(loss)));
        } else {
            tracing::warn!(element, address, %loss, "an element is not read any more");
        }
    }

    fn describe(&self, loss: singletact::Loss) -> Loss {
        let kind = match loss {
            singletact::Loss::Silent if self.met_now() > self.met => {
                let met = self.quality();
                let what = format!(
                    "bytes come, but no answer to a poll ({met}): is it the board that the rig file describes, and is \
                     the bit rate right?"
                );
                return Loss::new(ErrorKind::Protocol, what);
            }
            singletact::Loss::Silent | singletact::Loss::Stale => ErrorKind::Timeout,
            singletact::Loss::Reply(ReplyError::TimedOut { .. }) => ErrorKind::DeviceFault,
            singletact::Loss::Reply(ReplyError::Length { .. }) => ErrorKind::Protocol,
        };
        Loss::new(kind, loss.to_string())
    }

    fn met_now(&self) -> u64 {
        self.session.decoder_stats().skipped_bytes + self.session.unexpected_replies()
    }
}

impl Conversation for Poller {
    fn start(&mut self, now: Duration) -> Vec<Action> {
        let actions = self.session.start(now);
        self.translate(now, actions)
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let actions = self.session.receive(now, bytes);
        self.translate(now, actions)
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        let actions = self.session.timer(now);
        self.translate(now, actions)
    }

    fn deadline(&self) -> Option<Duration> {
        self.session.deadline()
    }

    fn quality(&self) -> String {
        let (stats, unexpected) = (self.session.decoder_stats(), self.session.unexpected_replies());
        format!("{} bytes skipped, {unexpected} replies to no request", stats.skipped_bytes)
    }
}

impl Beat {
    fn round_begins(&mut self, now: Duration) {
        let Self { interval, begun, missed } = self;
        let due = begun.map_or(now, |begun| begun.saturating_add(*interval));
        let behind = now.saturating_sub(due);
        let skipped = behind.as_nanos().checked_div(interval.as_nanos()).unwrap_or(0);
        *missed = missed.saturating_add(1 + u64::try_from(skipped).unwrap_or(u64::MAX));
        *begun = Some(if skipped > 0 { now } else { due });
    }
}

impl Round {
    fn new(elements: usize) -> Self {
        Self { counts: vec![None; elements], tick: 0, new_clock: false }
    }

    fn take(&mut self, reading: &singletact::Reading) {
        if let Some(counts) = self.counts.get_mut(reading.element) {
            *counts = Some(reading.counts);
        }
        self.tick = reading.tick;
        self.new_clock |= reading.new_clock;
    }

    fn reading(self, lost: u64) -> Option<Reading> {
        let Self { counts, tick, new_clock } = self;
        counts.iter().any(Option::is_some).then(|| Reading {
            tick: Some(DeviceTick(tick)),
            new_clock,
            before: Before::Numbers { lost, wrap: u64::MAX },
            bad: (0..)
                .zip(&counts)
                .filter(|(_, counts)| counts.is_none())
                .map(|(element, _)| element)
                .collect(),
            counts: counts.into_iter().map(|counts| counts.map_or(0.0, f32::from)).collect(),
        })
    }
}

fn send(request: &Request<'_>) -> Action {
    match request.encode() {
        Ok(bytes) => Action::Send(bytes),
        Err(error) => Action::Failed(Loss::new(ErrorKind::Protocol, error.to_string())),
    }
}

#[cfg(test)]
#[path = "singletact_tests.rs"]
mod tests;
