//! A client's subscription to one topic.

use std::{
    collections::HashMap,
    marker::PhantomData,
    mem,
    ops::RangeInclusive,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use tactus_schema::key::Keys;
use zenoh::{
    Session,
    bytes::Encoding,
    query::{ConsolidationMode, QueryTarget, ReplyKeyExpr},
    sample::Sample,
    session::{EntityGlobalId, ZenohId},
};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, RecoveryConfig};

use crate::{
    BusError, Published,
    listener::Foreign,
    liveness::Trust,
    merge::{Merge, Numbered},
    queue::Queue,
    topic::{FRAMES_KEPT_MAX, Policy, encoding, heard},
};

/// Time limit for the history; later replies are ignored.
const HISTORY_TIMEOUT: Duration = Duration::from_secs(10);

/// Bytes that wait for the reader at most.
const ARRIVED_BYTES_MAX: usize = 64 << 20;

/// Publishers whose last message is remembered.
const PUBLISHERS_MAX: usize = 16;

/// Messages from before the subscription that a subscriber gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum History {
    /// None; messages missed later are counted but not fetched. For live views.
    None,
    /// The last message. For states.
    Last,
    /// All messages that the service still keeps. For frames and events.
    All,
}

/// Numbers of messages that did not reach the reader, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Lost between service and client, and not recovered. Counted by zenoh's numbers, so messages that the service dropped
    /// earlier are not included; a message's own sequence number shows those.
    pub missed: u64,
    /// Dropped by the client, oldest first, because the reader was too slow.
    pub overrun: u64,
    /// Received, but not decodable as the topic's message.
    pub unreadable: u64,
    /// Received, but not from the rig's service.
    pub foreign: u64,
}

/// Messages of one topic that their publisher sent in a row and that did not arrive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gap {
    publisher: EntityGlobalId,
    /// The publisher's numbers.
    numbers: RangeInclusive<u32>,
}

/// Messages of one topic, in order.
#[derive(Debug)]
pub struct Subscription<M> {
    reception: Arc<Reception>,
    trust: Trust,
    /// The encoding of its messages.
    expected: Encoding,
    /// The last message that was given out of each of the latest publishers.
    last: HashMap<EntityGlobalId, u32>,
    publishers: usize,
    /// What is missing just before it.
    gap: Option<Gap>,
    /// Taken, while nobody speaks for the rig yet.
    undecided: Option<Sample>,
    unreadable: u64,
    _subscriber: AdvancedSubscriber<()>,
    _message: PhantomData<fn() -> M>,
}

/// Received messages that have not been read yet.
#[derive(Debug)]
struct Reception {
    merge: Mutex<Merge<EntityGlobalId, Sample>>,
    arrived: Queue<Sample>,
    foreign: Foreign,
}

impl Gap {
    /// How many messages it is.
    pub fn messages(&self) -> u64 {
        u64::from(self.numbers.end() - self.numbers.start()) + 1
    }

    /// Asks the publisher for them; `None` if it does not answer, or not to the end. It forgets the oldest messages first, and so answers
    /// with the last of them if it has any; if not, its very last message shows that it is there.
    pub(crate) async fn ask<M: Published>(
        &self,
        session: &Session,
        keys: &Keys,
        patience: Duration,
    ) -> Result<Option<Vec<M>>, BusError> {
        let publisher = self.publisher;
        let key = format!("{}/@adv/pub/{}/{}/**", keys.topic(M::TOPIC), publisher.zid(), publisher.eid());
        let (first, last) = self.numbers.clone().into_inner();
        let mut found = ask(session, &format!("{key}?_sn={first}..{last}"), patience).await?;
        // Nobody else may answer in its place.
        found.retain(|Numbered { origin, .. }| origin.is_some_and(|(by, _)| by == publisher));
        let is_answered = if found.is_empty() {
            !ask(session, &format!("{key}?_max=1"), patience).await?.is_empty()
        } else {
            found.iter().any(|Numbered { origin, .. }| *origin == Some((publisher, last)))
        };
        if !is_answered {
            return Ok(None);
        }
        let read = |found: Numbered<_, Sample>| M::decode(&*found.item.payload().to_bytes()).ok();
        Ok(Some(found.into_iter().filter_map(read).collect()))
    }
}

impl<M: Published> Subscription<M> {
    /// Returns once the history has arrived.
    pub(crate) async fn declare(
        session: &Session,
        keys: &Keys,
        history: History,
        trust: Trust,
    ) -> Result<Self, BusError> {
        let key = keys.topic(M::TOPIC);
        let reception = Arc::new(Reception {
            merge: Mutex::new(Merge::awaiting_history()),
            // Drop-oldest, counted; holds the longest history and as much again.
            arrived: Queue::bounded(
                1_024.max(2 * Policy::of(M::TOPIC).kept.messages(FRAMES_KEPT_MAX)),
                ARRIVED_BYTES_MAX,
                |sample: &Sample| sample.payload().len(),
            ),
            foreign: Foreign::default(),
        });
        let receiver = Receiver(reception.clone(), trust.clone());
        let builder =
            session.declare_subscriber(heard(&key)).callback(move |sample| receiver.hear(sample)).advanced();
        let recovery = RecoveryConfig::default().heartbeat();
        let subscriber = if history == History::None { builder } else { builder.recovery(recovery) }
            .await
            .map_err(BusError::key(&key))?;
        // Requested after the subscription, so that no message is lost between the two.
        reception.join(past(session, &key, history).await?);
        Ok(Self {
            reception,
            trust,
            expected: encoding(M::NAME),
            last: HashMap::new(),
            publishers: 0,
            gap: None,
            undecided: None,
            unreadable: 0,
            _subscriber: subscriber,
            _message: PhantomData,
        })
    }

    /// The next message; `None` once the client is closed. If the service restarts, the subscription continues: see
    /// [`crate::Client::alive`]. Cancel-safe.
    pub async fn recv(&mut self) -> Option<M> {
        loop {
            let sample = self.next_of_service().await?;
            self.count(&sample);
            if let Some(message) = read(&sample, &self.expected) {
                return Some(message);
            }
            self.unreadable += 1;
        }
    }

    /// The next sample from a session that speaks for the rig.
    async fn next_of_service(&mut self) -> Option<Sample> {
        loop {
            let sample = match self.undecided.take() {
                Some(sample) => sample,
                None => self.reception.arrived.pop().await?,
            };
            let source = sender(&sample);
            self.undecided = Some(sample);
            // A service that has just come back may be heard before it has announced itself.
            let is_own = match source {
                Some(source) => self.trust.wait(&source).await?,
                None => false,
            };
            let sample = mem::take(&mut self.undecided);
            if is_own {
                return sample;
            }
            self.reception.foreign.count();
        }
    }

    /// What the publisher of the last message sent just before it, and what has not arrived: zenoh asked for it once. See
    /// [`crate::Client::ask_again`].
    pub fn gap(&self) -> Option<&Gap> {
        self.gap.as_ref()
    }

    /// Publishers of the messages so far: a service that starts again has others. A rig that starts again alone, within its service, keeps them.
    pub fn publishers(&self) -> usize {
        self.publishers
    }

    /// Compares the message's number with the last one of its publisher.
    fn count(&mut self, sample: &Sample) {
        self.gap = None;
        let Some((publisher, number)) = origin(sample) else { return };
        let due = if let Some(last) = self.last.insert(publisher, number) {
            last.wrapping_add(1)
        } else {
            self.publishers += 1;
            if self.last.len() > PUBLISHERS_MAX {
                self.last.retain(|by, _| *by == publisher);
            }
            // What the first publisher sent before is history; of a later one, everything is due.
            if self.publishers == 1 { number } else { 0 }
        };
        if due < number {
            self.gap = Some(Gap { publisher, numbers: due..=number - 1 });
        }
    }

    /// Messages that did not reach the reader so far.
    pub fn losses(&self) -> Losses {
        Losses {
            missed: self.reception.merge.lock().unwrap_or_else(PoisonError::into_inner).missed(),
            overrun: self.reception.arrived.dropped(),
            unreadable: self.unreadable,
            foreign: self.reception.foreign.number(),
        }
    }
}

/// Fetches the history from the topic's publishers; each replies on a zenoh-ext key below the topic.
async fn past(
    session: &Session,
    key: &str,
    history: History,
) -> Result<Vec<Numbered<EntityGlobalId, Sample>>, BusError> {
    let selector = match history {
        History::None => return Ok(Vec::new()),
        History::Last => format!("{key}/@adv/pub/**?_max=1"),
        History::All => format!("{key}/@adv/pub/**"),
    };
    ask(session, &selector, HISTORY_TIMEOUT).await
}

/// Asks for messages that publishers keep.
async fn ask(
    session: &Session,
    selector: &str,
    patience: Duration,
) -> Result<Vec<Numbered<EntityGlobalId, Sample>>, BusError> {
    let replies = session
        .get(selector)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .accept_replies(ReplyKeyExpr::Any)
        .timeout(patience)
        .await
        .map_err(BusError::key(selector))?;
    let mut past = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        if let Ok(sample) = reply.into_result() {
            past.push(numbered(sample));
        }
    }
    Ok(past)
}

fn numbered(sample: Sample) -> Numbered<EntityGlobalId, Sample> {
    Numbered { origin: origin(&sample), item: sample }
}

/// The session that sent a message.
pub(crate) fn sender(sample: &Sample) -> Option<ZenohId> {
    origin(sample).map(|(publisher, _)| publisher.zid())
}

/// A sample of this encoding as the message that it is; `None` if it is none.
pub(crate) fn read<M: Published>(sample: &Sample, expected: &Encoding) -> Option<M> {
    let message =
        (sample.encoding() == expected).then(|| M::decode(&*sample.payload().to_bytes()).ok()).flatten();
    if message.is_none() {
        tracing::debug!(key = %sample.key_expr(), encoding = %sample.encoding(), "unreadable message");
    }
    message
}

/// Who sent a message, and its number.
fn origin(sample: &Sample) -> Option<(EntityGlobalId, u32)> {
    sample.source_info().map(|source| (*source.source_id(), source.source_sn()))
}

impl Reception {
    fn hear(&self, sample: Sample) {
        let mut merge = self.merge.lock().unwrap_or_else(PoisonError::into_inner);
        merge.present(numbered(sample), |sample| self.keep(sample));
    }

    fn join(&self, past: Vec<Numbered<EntityGlobalId, Sample>>) {
        let mut merge = self.merge.lock().unwrap_or_else(PoisonError::into_inner);
        merge.join(past, |sample| self.keep(sample));
    }

    fn keep(&self, sample: Sample) {
        // The queue counts dropped messages for `Losses`.
        let _dropped = self.arrived.push(sample);
    }
}

/// Zenoh's handle, which it drops when the session ends.
struct Receiver(Arc<Reception>, Trust);

impl Receiver {
    /// Takes a live message. A message that is known to come from another session is dropped.
    fn hear(&self, sample: Sample) {
        if sender(&sample).is_none_or(|source| self.1.has(&source) == Some(false)) {
            self.0.foreign.count();
        } else {
            self.0.hear(sample);
        }
    }
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.0.arrived.close();
    }
}
