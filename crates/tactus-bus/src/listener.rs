//! One topic, heard in the thread that receives it.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use tactus_schema::key::Keys;
use zenoh::{Session, pubsub::Subscriber, sample::Sample};

use crate::{
    BusError, Published,
    liveness::Trust,
    subscription::{read, sender},
    topic::{encoding, heard},
};

/// Hears a topic until it is dropped: see [`crate::Client::listen`].
#[derive(Debug)]
#[must_use = "nothing is heard once it is dropped"]
pub struct Listener {
    passed_over: Arc<PassedOver>,
    _subscriber: Subscriber<()>,
}

/// Messages that were not given to the callback.
#[derive(Debug, Default)]
struct PassedOver {
    unreadable: AtomicU64,
    foreign: Foreign,
}

/// Counts messages of others than the rig's service.
#[derive(Debug, Default)]
pub(crate) struct Foreign(AtomicU64);

impl Listener {
    pub(crate) async fn declare<M: Published>(
        session: &Session,
        keys: &Keys,
        trust: Trust,
        hear: impl Fn(M) + Send + Sync + 'static,
    ) -> Result<Self, BusError> {
        let key = keys.topic(M::TOPIC);
        let passed_over = Arc::new(PassedOver::default());
        let counted = Arc::clone(&passed_over);
        let expected = encoding(M::NAME);
        let take = move |sample: Sample| {
            if sender(&sample).is_none_or(|sender| trust.has(&sender) != Some(true)) {
                return counted.foreign.count();
            }
            match read(&sample, &expected) {
                Some(message) => hear(message),
                None => {
                    counted.unreadable.fetch_add(1, Ordering::Relaxed);
                }
            }
        };
        let subscriber =
            session.declare_subscriber(heard(&key)).callback(take).await.map_err(BusError::key(&key))?;
        Ok(Self { passed_over, _subscriber: subscriber })
    }

    /// Messages that could not be decoded as the topic's.
    pub fn unreadable(&self) -> u64 {
        self.passed_over.unreadable.load(Ordering::Relaxed)
    }

    /// Messages of others than the rig's service, and those that came while nobody spoke for the rig.
    pub fn foreign(&self) -> u64 {
        self.passed_over.foreign.number()
    }
}

impl Foreign {
    /// Counts one more; one line each time the count doubles, to limit the log.
    pub(crate) fn count(&self) {
        let foreign = self.0.fetch_add(1, Ordering::Relaxed) + 1;
        if foreign.is_power_of_two() {
            tracing::warn!(foreign, "messages that are not the service's are dropped");
        }
    }

    pub(crate) fn number(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
