//! The way out: calls that never wait, and what hands their messages to zenoh.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use tactus_schema::{
    Frame,
    key::{Keys, Topic},
    pb,
};
use zenoh::{
    Session, Wait,
    bytes::ZBytes,
    qos::{CongestionControl, Reliability},
};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, MissDetectionConfig};

use crate::{
    BusError, Published,
    cache::{Cache, Question, Source},
    queue::Queue,
    topic::{Lane, Policy, encoding, message_name},
};

/// How often the last sequence number of each topic is told, so that a client finds out that it
/// missed the last message of a burst.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Publishes for the service. Cheap to clone; no call ever waits.
#[derive(Debug, Clone)]
pub struct Publisher {
    lanes: Arc<Lanes>,
}

/// What waits on its way out.
#[derive(Debug)]
pub(crate) struct Lanes {
    frames: Arc<Queue<Outgoing>>,
    news: Arc<Queue<Outgoing>>,
}

/// One encoded message.
#[derive(Debug)]
pub(crate) struct Outgoing {
    topic: Topic,
    payload: Vec<u8>,
}

impl Publisher {
    pub(crate) fn new(lanes: Arc<Lanes>) -> Self {
        Self { lanes }
    }

    /// Publishes a frame on `sensor/frame`.
    pub fn publish_frame(&self, frame: &Frame) {
        self.publish(&pb::Frame::from(frame));
    }

    /// Publishes a message on its topic. When its queue is full the oldest message in it is dropped,
    /// counted and logged; after [`crate::Bus::close`] nothing is published any more.
    pub fn publish<M: Published>(&self, message: &M) {
        let lane = Policy::of(M::TOPIC).lane;
        let queue = self.lanes.queue(lane);
        if queue.push(Outgoing { topic: M::TOPIC, payload: message.encode_to_vec() }).is_some() {
            let dropped = queue.dropped();
            // One line each time the count doubles: a flood of losses is no flood of lines.
            if dropped.is_power_of_two() {
                tracing::warn!(?lane, dropped, "the bus cannot keep up; the oldest messages are dropped");
            }
        }
    }

    /// Frames dropped on the service's side because the bus could not keep up. What the network then
    /// drops for a single slow client is counted by that client: see [`crate::Losses`].
    pub fn dropped_frames(&self) -> u64 {
        self.lanes.frames.dropped()
    }

    /// Events and states dropped on the service's side because the bus could not keep up.
    pub fn dropped_news(&self) -> u64 {
        self.lanes.news.dropped()
    }
}

impl Lanes {
    pub(crate) fn new() -> Self {
        Self {
            // Drop-oldest, counted: 10 s of frames. More would only be stale.
            frames: Arc::new(Queue::new(300)),
            // Drop-oldest, counted: far more than a run says while clients that stand still cost a
            // millisecond a message each.
            news: Arc::new(Queue::new(8_192)),
        }
    }

    pub(crate) fn queue(&self, lane: Lane) -> &Arc<Queue<Outgoing>> {
        match lane {
            Lane::Frames => &self.frames,
            Lane::News => &self.news,
        }
    }
}

/// The publishers of one lane.
#[derive(Debug)]
pub(crate) struct Outlets(BTreeMap<Topic, Outlet>);

/// One topic's way out.
#[derive(Debug)]
struct Outlet {
    publisher: AdvancedPublisher<'static>,
    cache: Cache,
}

impl Outlets {
    /// Declares the publishers of the lane's topics.
    pub(crate) async fn declare(
        session: &Session,
        keys: &Keys,
        lane: Lane,
        questions: &Arc<Queue<Question>>,
    ) -> Result<Self, BusError> {
        let mut outlets = BTreeMap::new();
        for topic in Topic::ALL {
            if Policy::of(topic).lane == lane {
                outlets.insert(topic, Outlet::declare(session, keys, topic, questions).await?);
            }
        }
        Ok(Self(outlets))
    }

    /// Hands a message to zenoh; may wait for slow clients.
    pub(crate) fn publish(&self, Outgoing { topic, payload }: Outgoing) {
        if let Some(outlet) = self.0.get(&topic) {
            outlet.publish(payload);
        }
    }
}

impl Outlet {
    async fn declare(
        session: &Session,
        keys: &Keys,
        topic: Topic,
        questions: &Arc<Queue<Question>>,
    ) -> Result<Self, BusError> {
        let policy = Policy::of(topic);
        let key = keys.topic(topic);
        let encoding = encoding(message_name(topic));
        let publisher = session
            .declare_publisher(key.clone())
            .encoding(encoding.clone())
            .priority(policy.priority)
            .congestion_control(CongestionControl::Drop)
            .reliability(Reliability::Reliable)
            // Numbers its messages from 0 on, as the cache does.
            .sample_miss_detection(MissDetectionConfig::default().heartbeat(HEARTBEAT))
            .publisher_detection()
            .await
            .map_err(BusError::key(&key))?;
        let source = Source { key, publisher: publisher.id(), encoding };
        let cache = Cache::declare(session, source, policy.history, questions.clone()).await?;
        Ok(Self { publisher, cache })
    }

    fn publish(&self, payload: Vec<u8>) {
        let payload = ZBytes::from(payload);
        self.cache.keep(payload.clone());
        if let Err(error) = self.publisher.put(payload).wait() {
            tracing::warn!(key = %self.publisher.key_expr(), %error, "not published");
        }
    }
}
