//! The host's side of the conversation: asks one element after the other.

use core::time::Duration;

use super::{Decoder, DecoderStats, Reply, ReplyError, Request};
use crate::wrapping::{Step, Wrapping};

/// Length of a tick of the board's clock.
pub const TICK: Duration = Duration::from_micros(100);

/// A request that is not answered by then is given up: the board itself waits up to 100 ms for the element.
pub const ANSWER_TIMEOUT: Duration = Duration::from_millis(250);

/// An element that leaves so many polls in a row without an answer is lost.
pub const SILENT_POLLS: u32 = 3;

/// An element that answers, but with no fresh reading for this long, is lost.
pub const STALE_AFTER: Duration = Duration::from_secs(1);

/// A conversation over one connection: polls the elements in turn, a round in every interval.
///
/// Call [`start`](Self::start) once, [`receive`](Self::receive) with what arrives and [`timer`](Self::timer)
/// when [`deadline`](Self::deadline) has come; do what the actions say, in their order. Times never go back.
/// There is one request on the way at any time; a round that takes longer than the interval is followed by
/// the next at once. A lost element is still polled, and found again when it answers.
#[derive(Debug)]
pub struct Session {
    interval: Duration,
    elements: Vec<Element>,
    decoder: Decoder,
    clock: Wrapping,
    state: State,
    next_id: u8,
    round_begun: Duration,
    unexpected_replies: u64,
}

/// What is polled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// I2C addresses, each below 128 and once; a reading names its place in this list. Every element answers
    /// at 4 too, so that 4 serves only where there is one.
    pub addresses: Vec<u8>,
    /// From the beginning of one round to that of the next; zero for as fast as they answer.
    pub interval: Duration,
}

/// Why nothing can be polled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The list is empty.
    #[error("there is no address to poll: name at least one, 4 if the element was given none of its own")]
    NoAddress,
    /// No such address on an I2C bus.
    #[error("address {address} is not below 128")]
    Address {
        /// As given.
        address: u8,
    },
    /// Twice the same.
    #[error("address {address} is there twice: give each element its own")]
    Twice {
        /// As given.
        address: u8,
    },
}

/// What the session wants done, or tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Ask this.
    Send(Request<'static>),
    /// A fresh reading.
    Reading(Reading),
    /// No more readings from an element; told once, until one comes again.
    Lost {
        /// Its place in [`Config::addresses`].
        element: usize,
        /// Its address.
        address: u8,
        /// Why.
        loss: Loss,
    },
}

/// One reading of one element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Its place in [`Config::addresses`].
    pub element: usize,
    /// The board's clock at the answer, unwrapped, in units of [`TICK`].
    pub tick: u64,
    /// The ticks of earlier readings are from another clock: this is the first reading, or the board has
    /// restarted.
    pub new_clock: bool,
    /// The element's own count of its readings, as received; wraps at 65 536.
    pub counter: u16,
    /// Readings of the element that lie between the one before and this, unseen. An element that reads faster
    /// than it is polled passes some over as a rule. 0 for the first.
    pub passed_over: u64,
    /// The value.
    pub counts: u16,
}

/// Why an element gives no more readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Loss {
    /// The interface board leaves requests unanswered.
    #[error("the interface board did not answer {SILENT_POLLS} times: check the cable and the port")]
    Silent,
    /// The answers hold no reading.
    #[error("{0}")]
    Reply(#[from] ReplyError),
    /// The element's counter stands still.
    #[error("no fresh reading for {} s: the element's counter stands still", STALE_AFTER.as_secs())]
    Stale,
}

#[derive(Debug)]
struct Element {
    address: u8,
    counter: Wrapping,
    fresh: Option<Duration>,
    /// Polls in a row without an answer, or with one that is no reading.
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
    /// No address, one that is no address, or one twice.
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
        Ok(Self {
            interval,
            elements: addresses.into_iter().map(Element::new).collect(),
            decoder: Decoder::new(),
            clock: Wrapping::new(1 << 32),
            state: State::Unstarted,
            next_id: 0,
            round_begun: Duration::ZERO,
            unexpected_replies: 0,
        })
    }

    /// When [`timer`](Self::timer) is due; `None` before the start.
    pub fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Unstarted => None,
            State::Waiting { deadline, .. } => Some(deadline),
            State::Resting { until } => Some(until),
        }
    }

    /// What the decoder met beside good packets.
    pub fn decoder_stats(&self) -> DecoderStats {
        self.decoder.stats()
    }

    /// Replies that came too late, or to no request of this session.
    pub fn unexpected_replies(&self) -> u64 {
        self.unexpected_replies
    }

    /// Begins the first round.
    pub fn start(&mut self, now: Duration) -> Vec<Action> {
        self.round_begun = now;
        vec![self.ask(now, 0)]
    }

    /// Takes what arrived.
    pub fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut actions = Vec::new();
        self.decoder.push(bytes);
        // The decoder is set aside while its replies, which borrow from it, are handled.
        let mut decoder = core::mem::take(&mut self.decoder);
        while let Some(reply) = decoder.next_reply() {
            self.handle(now, &reply, &mut actions);
        }
        self.decoder = decoder;
        actions
    }

    /// Does what is due at [`deadline`](Self::deadline).
    pub fn timer(&mut self, now: Duration) -> Vec<Action> {
        let mut actions = Vec::new();
        match self.state {
            State::Waiting { element, deadline, .. } if now >= deadline => {
                self.fail(element, Loss::Silent, &mut actions);
                self.go_on(now, element, &mut actions);
            }
            State::Resting { until } if now >= until => actions.push(self.begin_round(now)),
            State::Unstarted | State::Waiting { .. } | State::Resting { .. } => {}
        }
        actions
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
                let fresh = element.take(now, reading.counter);
                if let Some(passed_over) = fresh {
                    actions.push(Action::Reading(Reading {
                        element: place,
                        tick: clock.total(),
                        new_clock: matches!(clock, Step::Anew { .. }),
                        counter: reading.counter,
                        passed_over,
                        counts: reading.counts,
                    }));
                } else if element.is_stale(now) {
                    actions.extend(element.lose(place, Loss::Stale));
                }
            }
            Err(error) => self.fail(place, Loss::Reply(error), actions),
        }
        self.go_on(now, place, actions);
    }

    fn fail(&mut self, place: usize, loss: Loss, actions: &mut Vec<Action>) {
        let Some(element) = self.elements.get_mut(place) else { return };
        element.failed = element.failed.saturating_add(1);
        if element.failed >= SILENT_POLLS {
            actions.extend(element.lose(place, loss));
        }
    }

    /// The next element of the round, or a rest until the next round.
    fn go_on(&mut self, now: Duration, asked: usize, actions: &mut Vec<Action>) {
        let until = self.round_begun.saturating_add(self.interval);
        if asked + 1 < self.elements.len() {
            actions.push(self.ask(now, asked + 1));
        } else if now < until {
            self.state = State::Resting { until };
        } else {
            actions.push(self.begin_round(now));
        }
    }

    fn begin_round(&mut self, now: Duration) -> Action {
        // Rounds keep their beat; beats that were missed are not made up for.
        let due = self.round_begun.saturating_add(self.interval);
        let missed = now.saturating_sub(due) >= self.interval;
        self.round_begun = if missed { now } else { due };
        self.ask(now, 0)
    }

    fn ask(&mut self, now: Duration, element: usize) -> Action {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        self.state = State::Waiting { element, id, deadline: now.saturating_add(ANSWER_TIMEOUT) };
        let address = self.elements.get(element).map_or(super::DEFAULT_ADDRESS, |element| element.address);
        Action::Send(Request::reading(address, id))
    }
}

impl Element {
    fn new(address: u8) -> Self {
        Self { address, counter: Wrapping::new(1 << 16), fresh: None, failed: 0, lost: false }
    }

    /// How many readings were passed over, if this one is fresh.
    fn take(&mut self, now: Duration, counter: u16) -> Option<u64> {
        let passed_over = match self.counter.advance(counter.into()) {
            Step::Anew { .. } => 0,
            Step::Ahead { by, .. } => by - 1,
            Step::Same { .. } => return None,
        };
        self.fresh = Some(now);
        self.lost = false;
        Some(passed_over)
    }

    fn is_stale(&self, now: Duration) -> bool {
        self.fresh.is_some_and(|fresh| now.saturating_sub(fresh) >= STALE_AFTER)
    }

    fn lose(&mut self, element: usize, loss: Loss) -> Option<Action> {
        let already = core::mem::replace(&mut self.lost, true);
        (!already).then_some(Action::Lost { element, address: self.address, loss })
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
