//! Publishing: calls that never wait, but for one, and the publishers of a rig's topics.

use std::sync::Arc;

use tactus_schema::{
    Frame,
    key::{Keys, Topic},
};
use zenoh::{
    Session, Wait,
    qos::{CongestionControl, Reliability},
};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, MissDetectionConfig};

use crate::{
    BusError, Published,
    cache::{Cache, HistoryQuery, Source},
    outlet::{Outlets, Way},
    queue::Queue,
    topic::{Lane, Policy, encoding, message_name},
};

/// Room for what a frame has beside its counts; where elements are bad, it may take more.
const FRAME_BYTES: usize = 64;

/// Publishes for the service. Cheap to clone; no call ever waits, but for [`Publisher::publish_frame_directly`].
#[derive(Debug, Clone)]
pub struct Publisher {
    outlets: Arc<Outlets>,
}

/// One encoded message.
#[derive(Debug)]
pub(crate) struct Outgoing {
    topic: Topic,
    pub(crate) payload: Vec<u8>,
}

impl Publisher {
    pub(crate) fn new(outlets: Arc<Outlets>) -> Self {
        Self { outlets }
    }

    /// Publishes a frame on `sensor/frame`.
    pub fn publish_frame(&self, frame: &Frame) {
        self.push(Topic::SensorFrame, encoded(frame), Way::Called);
    }

    /// The same from this thread, of one rig or two: no other thread has to wake. It may wait for up to 100 ms where a client asks and does
    /// not read, and so is for when nothing moves and nothing is recorded.
    pub fn publish_frame_directly(&self, frame: &Frame) {
        self.push(Topic::SensorFrame, encoded(frame), Way::Direct);
    }

    /// Publishes a message on its topic. When its queue is full the oldest message in it is dropped,
    /// counted and logged; after [`crate::Bus::close`] nothing is published any more.
    pub fn publish<M: Published>(&self, message: &M) {
        self.push(M::TOPIC, message.encode_to_vec(), Way::Called);
    }

    fn push(&self, topic: Topic, payload: Vec<u8>, way: Way) {
        let lane = Policy::of(topic).lane;
        let outlet = self.outlets.of(lane);
        if outlet.push(Outgoing { topic, payload }, way).is_some() {
            let dropped = outlet.dropped();
            // One line each time the count doubles, to limit the log.
            if dropped.is_power_of_two() {
                tracing::warn!(?lane, dropped, "the bus cannot keep up; the oldest messages are dropped");
            }
        }
    }

    /// Frames dropped by the service because the bus could not keep up. Messages that the network drops for one slow client
    /// are counted by that client: see [`crate::Losses`].
    pub fn dropped_frames(&self) -> u64 {
        self.outlets.frames.dropped()
    }

    /// Events and states dropped by the service because the bus could not keep up.
    pub fn dropped_updates(&self) -> u64 {
        self.outlets.updates.dropped()
    }
}

fn encoded(frame: &Frame) -> Vec<u8> {
    let mut payload = Vec::with_capacity(FRAME_BYTES + size_of::<f32>() * frame.counts.len());
    frame.encode(&mut payload);
    payload
}

/// The publishers of one lane; no more room than they need, because every rig has them.
#[derive(Debug)]
pub(crate) struct TopicPublishers(Box<[(Topic, TopicPublisher)]>);

/// Publisher and cache of one topic.
#[derive(Debug)]
struct TopicPublisher {
    publisher: AdvancedPublisher<'static>,
    cache: Cache,
}

impl TopicPublishers {
    /// Declares the publishers of the lane's topics; `frames_kept` frames are kept.
    pub(crate) async fn declare(
        session: &Session,
        keys: &Keys,
        lane: Lane,
        frames_kept: usize,
        history_queries: &Arc<Queue<HistoryQuery>>,
    ) -> Result<Self, BusError> {
        let mut publishers = Vec::new();
        for topic in Topic::ALL {
            if Policy::of(topic).lane == lane {
                let declared =
                    TopicPublisher::declare(session, keys, topic, frames_kept, history_queries).await?;
                publishers.push((topic, declared));
            }
        }
        Ok(Self(publishers.into()))
    }

    /// Passes a message to zenoh; may wait for slow clients.
    pub(crate) fn publish(&self, Outgoing { topic, payload }: Outgoing) {
        if let Some((_, publisher)) = self.0.iter().find(|(of, _)| *of == topic) {
            publisher.publish(payload);
        }
    }
}

impl TopicPublisher {
    async fn declare(
        session: &Session,
        keys: &Keys,
        topic: Topic,
        frames_kept: usize,
        history_queries: &Arc<Queue<HistoryQuery>>,
    ) -> Result<Self, BusError> {
        let policy = Policy::of(topic);
        let key = keys.topic(topic);
        let encoding = encoding(message_name(topic));
        let numbered = MissDetectionConfig::default();
        let detection =
            if let Some(period) = policy.heartbeat { numbered.heartbeat(period) } else { numbered };
        let publisher = session
            .declare_publisher(key.clone())
            .encoding(encoding.clone())
            .priority(policy.priority)
            .congestion_control(CongestionControl::Drop)
            .reliability(Reliability::Reliable)
            // Numbers messages from 0, as the cache does.
            .sample_miss_detection(detection)
            .publisher_detection()
            .await
            .map_err(BusError::key(&key))?;
        let source = Source { key, publisher: publisher.id(), encoding };
        let kept = policy.kept.messages(frames_kept);
        let cache = Cache::declare(session, source, kept, history_queries.clone()).await?;
        Ok(Self { publisher, cache })
    }

    fn publish(&self, payload: Vec<u8>) {
        self.cache.keep(&payload);
        if let Err(error) = self.publisher.put(payload).wait() {
            tracing::warn!(key = %self.publisher.key_expr(), %error, "not published");
        }
    }
}
