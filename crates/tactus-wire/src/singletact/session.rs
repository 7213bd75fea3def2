//! The host's side: polls the elements one after another. Each round gives one reading of all elements.

use core::time::Duration;

use super::{Decoder, Reply, ReplyError, Request};
use crate::sensor::{self, Action, Cause, Loss, LossEvidence, Reading};
use crate::unwrapper::{Advance, Unwrapper};

/// Length of a tick of the board's clock.
pub const TICK: Duration = Duration::from_micros(100);

/// An unanswered request is given up after this. The board itself waits up to 100 ms for the element.
pub const ANSWER_TIMEOUT: Duration = Duration::from_millis(250);

/// An element is lost after this many polls in a row without an answer.
pub const SILENT_POLLS: u32 = 3;

/// An element is lost when it answers, but has sent no fresh reading for this long.
pub const STALE_AFTER: Duration = Duration::from_secs(1);

/// Polls the elements over one connection, a round in every interval.
///
/// At most one request is on the way. A round that takes longer than the interval is followed by the next at once.
/// A round gives one reading, if any element answered with a fresh value. A lost element is still polled, and is found
/// again when it answers; the array is lost with its last element.
#[derive(Debug)]
pub struct Session {
    interval: Duration,
    elements: Vec<Element>,
    decoder: Decoder,
    clock: Unwrapper,
    state: State,
    next_id: u8,
    round_begun: Duration,
    round: Round,
    /// Intervals since the last reading, the present round included.
    intervals: u64,
    flows: bool,
    /// Replies that came too late, or to no request of this session.
    unexpected_replies: u64,
    /// Skipped bytes and unexpected replies, as of the last reading.
    strays_before: u64,
}

/// What is polled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// I2C addresses in the order of the elements, each below 128 and unique. Every element also answers at 4, so 4 can
    /// be used only for a single element.
    pub addresses: Vec<u8>,
    /// Time between the beginnings of two rounds; zero to poll as fast as the elements answer.
    pub interval: Duration,
}

/// Why these elements cannot be polled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ConfigError {
    /// The list of addresses is empty.
    #[error("there is no address to poll: name at least one, 4 if the element was given none of its own")]
    NoAddress,
    /// The I2C bus has no such address.
    #[error("address {address} is not below 128")]
    Address { address: u8 },
    /// An address is listed twice.
    #[error("address {address} is there twice: give each element its own")]
    Twice { address: u8 },
}

/// Why an element gives no more readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
enum ElementLoss {
    /// The interface board leaves requests unanswered.
    #[error("the interface board did not answer {SILENT_POLLS} times: check the cable and the port")]
    Silent,
    /// The answers hold no reading.
    #[error("{0}")]
    Reply(#[from] ReplyError),
    /// The element's counter does not advance.
    #[error("no fresh reading for {} s: the element's counter stands still", STALE_AFTER.as_secs())]
    Stale,
}

/// The values of the round in progress.
#[derive(Debug)]
struct Round {
    /// By element; `None` for one that has not answered with a fresh value.
    counts: Vec<Option<u16>>,
    tick: u64,
    new_clock: bool,
}

#[derive(Debug)]
struct Element {
    address: u8,
    /// The element's own count of its readings.
    counter: Unwrapper,
    /// When its counter last advanced.
    fresh: Option<Duration>,
    /// Polls in a row without a valid answer.
    failed: u32,
    lost: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Unstarted,
    Waiting { element: usize, id: u8, deadline: Duration },
    Resting { until: Duration },
}

impl Session {
    /// A session that has not started.
    ///
    /// # Errors
    /// If there is no address, an invalid one, or the same one twice.
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        let Config { addresses, interval } = config;
        if addresses.is_empty() {
            return Err(ConfigError::NoAddress);
        }
        for (place, address) in addresses.iter().copied().enumerate() {
            if address >= 0x80 {
                return Err(ConfigError::Address { address });
            }
            if addresses.iter().take(place).any(|earlier| *earlier == address) {
                return Err(ConfigError::Twice { address });
            }
        }
        let round = Round { counts: vec![None; addresses.len()], tick: 0, new_clock: false };
        Ok(Self {
            interval,
            elements: addresses.into_iter().map(Element::new).collect(),
            decoder: Decoder::new(),
            clock: Unwrapper::new(1 << 32),
            state: State::Unstarted,
            next_id: 0,
            round_begun: Duration::ZERO,
            round,
            intervals: 0,
            flows: false,
            unexpected_replies: 0,
            strays_before: 0,
        })
    }

    fn handle(&mut self, now: Duration, reply: &Reply<'_>, actions: &mut Vec<Action>) {
        let asked = match self.state {
            State::Waiting { element, id, .. } if id == reply.id => {
                self.elements.get_mut(element).map(|asked| (element, asked))
            }
            State::Unstarted | State::Waiting { .. } | State::Resting { .. } => None,
        };
        let Some((place, element)) = asked.filter(|(_, element)| element.address == reply.address) else {
            self.unexpected_replies += 1;
            return;
        };
        match reply.reading() {
            Ok(reading) => {
                let clock = self.clock.advance(reply.timestamp_ticks.into());
                element.failed = 0;
                if element.is_fresh(now, reading.counter) {
                    self.round.take(place, reading.counts, clock);
                    if place + 1 == self.elements.len() {
                        self.end_round(actions);
                    }
                } else if element.is_stale(now) {
                    self.lose(place, ElementLoss::Stale, actions);
                }
            }
            Err(error) => self.fail(place, ElementLoss::Reply(error), actions),
        }
        self.go_on(now, place, actions);
    }

    fn fail(&mut self, place: usize, loss: ElementLoss, actions: &mut Vec<Action>) {
        let Some(element) = self.elements.get_mut(place) else { return };
        element.failed = element.failed.saturating_add(1);
        if element.failed >= SILENT_POLLS {
            self.lose(place, loss, actions);
        }
    }

    /// An element is lost; reported once, until it answers again.
    fn lose(&mut self, place: usize, loss: ElementLoss, actions: &mut Vec<Action>) {
        let Some(element) = self.elements.get_mut(place) else { return };
        if core::mem::replace(&mut element.lost, true) {
            return;
        }
        let address = element.address;
        if self.elements.iter().all(|element| element.lost) {
            self.flows = false;
            actions.push(Action::Lost(self.describe(loss)));
        } else {
            actions.push(Action::Warning(format!(
                "element {place} at address {address} is no longer read: {loss}"
            )));
        }
    }

    fn describe(&self, loss: ElementLoss) -> Loss {
        let cause = match loss {
            ElementLoss::Silent if self.strays() > self.strays_before => {
                let quality = sensor::Session::quality(self);
                let what = format!(
                    "bytes come, but no answer to a poll ({quality}): is it the board that the rig file describes, and is \
                     the bit rate right?"
                );
                return Loss::new(Cause::Protocol, what);
            }
            ElementLoss::Silent | ElementLoss::Stale => Cause::Silent,
            ElementLoss::Reply(ReplyError::TimedOut { .. }) => Cause::DeviceFault,
            ElementLoss::Reply(ReplyError::Length { .. }) => Cause::Protocol,
        };
        Loss::new(cause, loss.to_string())
    }

    /// Skipped bytes and unexpected replies since the start.
    fn strays(&self) -> u64 {
        self.decoder.stats().skipped_bytes + self.unexpected_replies
    }

    /// The next element of the round, or a rest until the next round.
    fn go_on(&mut self, now: Duration, asked: usize, actions: &mut Vec<Action>) {
        let until = self.round_begun.saturating_add(self.interval);
        if asked + 1 < self.elements.len() {
            actions.push(self.ask(now, asked + 1));
        } else if now < until {
            self.state = State::Resting { until };
        } else {
            self.begin_round(now, actions);
        }
    }

    fn begin_round(&mut self, now: Duration, actions: &mut Vec<Action>) {
        // The last element of the round before may not have answered.
        self.end_round(actions);
        // Rounds begin at multiples of the interval. A round that is late by an interval or more begins a new series.
        let due = self.round_begun.saturating_add(self.interval);
        let late = now.saturating_sub(due).as_nanos();
        let skipped = late.checked_div(self.interval.as_nanos()).unwrap_or(0);
        self.intervals = self.intervals.saturating_add(1 + u64::try_from(skipped).unwrap_or(u64::MAX));
        self.round_begun = if skipped > 0 { now } else { due };
        actions.push(self.ask(now, 0));
    }

    /// Gives the round's reading, if any element was read.
    fn end_round(&mut self, actions: &mut Vec<Action>) {
        let lost = self.intervals.saturating_sub(1);
        let Some(reading) = self.round.finish(lost) else { return };
        self.intervals = 0;
        if !core::mem::replace(&mut self.flows, true) {
            actions.push(Action::Connected { identity: None });
        }
        actions.push(Action::Reading(reading));
    }

    fn ask(&mut self, now: Duration, element: usize) -> Action {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        self.state = State::Waiting { element, id, deadline: now.saturating_add(ANSWER_TIMEOUT) };
        let address = self.elements.get(element).map_or(super::DEFAULT_ADDRESS, |element| element.address);
        match Request::reading(address, id).encode() {
            Ok(bytes) => Action::Send(bytes),
            Err(error) => Action::Failed(Loss::new(Cause::Protocol, error.to_string())),
        }
    }

    /// Remembers how many strays came up to the reading that is among `actions`.
    fn note_strays(&mut self, actions: &[Action]) {
        if actions.iter().any(|action| matches!(action, Action::Reading(_))) {
            self.strays_before = self.strays();
        }
    }
}

impl sensor::Session for Session {
    fn name(&self) -> String {
        "singletact".to_owned()
    }

    fn tick_ns(&self) -> u64 {
        sensor::whole_ns(TICK)
    }

    fn start(&mut self, now: Duration) -> Vec<Action> {
        self.round_begun = now;
        self.intervals = 1;
        vec![self.ask(now, 0)]
    }

    fn receive_into(&mut self, now: Duration, bytes: &[u8], actions: &mut Vec<Action>) {
        self.decoder.push(bytes);
        // The decoder is moved out of `self`, because its replies borrow from it.
        let mut decoder = core::mem::take(&mut self.decoder);
        while let Some(reply) = decoder.next_reply() {
            self.handle(now, &reply, actions);
        }
        self.decoder = decoder;
        self.note_strays(actions);
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        let mut actions = Vec::new();
        match self.state {
            State::Waiting { element, deadline, .. } if now >= deadline => {
                self.fail(element, ElementLoss::Silent, &mut actions);
                self.go_on(now, element, &mut actions);
            }
            State::Resting { until } if now >= until => self.begin_round(now, &mut actions),
            State::Unstarted | State::Waiting { .. } | State::Resting { .. } => {}
        }
        self.note_strays(&actions);
        actions
    }

    fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Unstarted => None,
            State::Waiting { deadline, .. } => Some(deadline),
            State::Resting { until } => Some(until),
        }
    }

    fn quality(&self) -> String {
        let (stats, unexpected) = (self.decoder.stats(), self.unexpected_replies);
        format!("{} bytes skipped, {unexpected} replies to no request", stats.skipped_bytes)
    }
}

impl Round {
    fn take(&mut self, place: usize, counts: u16, clock: Advance) {
        if let Some(to) = self.counts.get_mut(place) {
            *to = Some(counts);
        }
        self.tick = clock.total();
        self.new_clock |= matches!(clock, Advance::Anew { .. });
    }

    /// The reading, if any element was read, with `lost` readings missing before it; empties the round.
    fn finish(&mut self, lost: u64) -> Option<Reading> {
        if self.counts.iter().all(Option::is_none) {
            return None;
        }
        let unread = (0..).zip(&self.counts).filter(|(_, counts)| counts.is_none());
        let bad = unread.map(|(element, _)| element).collect();
        let counts = self.counts.iter_mut().map(|counts| counts.take().map_or(0.0, f32::from)).collect();
        Some(Reading {
            tick: Some(self.tick),
            new_clock: core::mem::take(&mut self.new_clock),
            evidence: LossEvidence::Counted { lost, wrap: u64::MAX },
            counts,
            bad,
            temperature_c: None,
        })
    }
}

impl Element {
    fn new(address: u8) -> Self {
        Self { address, counter: Unwrapper::new(1 << 16), fresh: None, failed: 0, lost: false }
    }

    /// Whether its counter has advanced; then it is no longer lost.
    fn is_fresh(&mut self, now: Duration, counter: u16) -> bool {
        if matches!(self.counter.advance(counter.into()), Advance::Same { .. }) {
            return false;
        }
        self.fresh = Some(now);
        self.lost = false;
        true
    }

    fn is_stale(&self, now: Duration) -> bool {
        self.fresh.is_some_and(|fresh| now.saturating_sub(fresh) >= STALE_AFTER)
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
