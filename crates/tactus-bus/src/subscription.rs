//! A client's ear on one topic.

use std::{
    marker::PhantomData,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use tactus_schema::key::Keys;
use zenoh::{
    Session,
    query::{ConsolidationMode, QueryTarget, ReplyKeyExpr},
    sample::Sample,
    session::EntityGlobalId,
};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, RecoveryConfig};

use crate::{
    BusError, Published,
    merge::{Merge, Numbered},
    queue::Queue,
    topic::{Policy, encoding},
};

/// How long the past is waited for; what has come by then is what there is.
const PAST_TIMEOUT: Duration = Duration::from_secs(10);

/// What a subscriber gets of the time before it came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum History {
    /// Nothing, and what is missed later is counted but not fetched: for live views.
    None,
    /// The last message, then all that follow: for states.
    Last,
    /// All that the service still keeps, then all that follow: for frames and events.
    All,
}

/// Messages that did not reach the reader, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Lost between service and client, and not to be had again. Found by zenoh's own numbering, so what
    /// the service dropped before is not among them: the message's own sequence number tells that.
    pub missed: u64,
    /// Dropped here, the oldest first, because the reader was too slow.
    pub overrun: u64,
    /// Arrived, but not as the message that belongs on the topic.
    pub unreadable: u64,
}

/// Messages of one topic, in order.
#[derive(Debug)]
pub struct Subscription<M> {
    ear: Arc<Ear>,
    unreadable: u64,
    _subscriber: AdvancedSubscriber<()>,
    _message: PhantomData<fn() -> M>,
}

/// What has been heard and not yet read.
#[derive(Debug)]
struct Ear {
    merge: Mutex<Merge<EntityGlobalId, Sample>>,
    arrived: Queue<Sample>,
}

impl<M: Published> Subscription<M> {
    /// Returns once the past is there.
    pub(crate) async fn declare(session: &Session, keys: &Keys, history: History) -> Result<Self, BusError> {
        let key = keys.topic(M::TOPIC);
        let ear = Arc::new(Ear {
            merge: Mutex::new(Merge::awaiting_past()),
            // Drop-oldest, counted; holds the whole history and as much again.
            arrived: Queue::new(1_024.max(2 * Policy::of(M::TOPIC).history)),
        });
        let hearing = Hearing(ear.clone());
        let builder =
            session.declare_subscriber(key.clone()).callback(move |sample| hearing.0.hear(sample)).advanced();
        let recovery = RecoveryConfig::default().heartbeat();
        let subscriber = if history == History::None { builder } else { builder.recovery(recovery) }
            .await
            .map_err(BusError::key(&key))?;
        // Asked for after the present is listened to, so that no message falls between the two.
        ear.join(past(session, &key, history).await?);
        Ok(Self { ear, unreadable: 0, _subscriber: subscriber, _message: PhantomData })
    }

    /// The next message; `None` once the client is closed. A service that goes and comes back is
    /// waited for: see [`crate::Client::alive`]. Cancel-safe.
    pub async fn recv(&mut self) -> Option<M> {
        let expected = encoding(M::NAME);
        loop {
            let sample = self.ear.arrived.pop().await?;
            if *sample.encoding() == expected
                && let Ok(message) = M::decode(&*sample.payload().to_bytes())
            {
                return Some(message);
            }
            tracing::debug!(key = %sample.key_expr(), encoding = %sample.encoding(), "unreadable message");
            self.unreadable += 1;
        }
    }

    /// What did not reach the reader so far.
    pub fn losses(&self) -> Losses {
        Losses {
            missed: self.ear.merge.lock().unwrap_or_else(PoisonError::into_inner).missed(),
            overrun: self.ear.arrived.dropped(),
            unreadable: self.unreadable,
        }
    }
}

/// What the topic's publishers still keep of it: each answers on a key of zenoh-ext below the topic.
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
    let replies = session
        .get(&selector)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .accept_replies(ReplyKeyExpr::Any)
        .timeout(PAST_TIMEOUT)
        .await
        .map_err(BusError::key(&selector))?;
    let mut past = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        if let Ok(sample) = reply.into_result() {
            past.push(numbered(sample));
        }
    }
    Ok(past)
}

fn numbered(sample: Sample) -> Numbered<EntityGlobalId, Sample> {
    Numbered {
        origin: sample.source_info().map(|source| (*source.source_id(), source.source_sn())),
        item: sample,
    }
}

impl Ear {
    fn hear(&self, sample: Sample) {
        let mut merge = self.merge.lock().unwrap_or_else(PoisonError::into_inner);
        merge.present(numbered(sample), |sample| self.keep(sample));
    }

    fn join(&self, past: Vec<Numbered<EntityGlobalId, Sample>>) {
        let mut merge = self.merge.lock().unwrap_or_else(PoisonError::into_inner);
        merge.join(past, |sample| self.keep(sample));
    }

    fn keep(&self, sample: Sample) {
        // The queue counts what it drops; `Losses` tells it.
        let _dropped = self.arrived.push(sample);
    }
}

/// Zenoh's hold on an ear, which it lets go of when the session ends.
struct Hearing(Arc<Ear>);

impl Drop for Hearing {
    fn drop(&mut self) {
        self.0.arrived.close();
    }
}
