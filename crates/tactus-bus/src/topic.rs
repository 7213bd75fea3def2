//! The message on each topic, and its queue, history and priority.

use tactus_schema::{Message, key::Topic, pb};
use zenoh::{bytes::Encoding, qos::Priority};

/// A message that the service publishes; each has its own topic.
pub trait Published: Message {
    /// The topic that carries this message.
    const TOPIC: Topic;
}

macro_rules! on_topics {
    ($($message:ident on $topic:ident),* $(,)?) => {
        $(impl Published for pb::$message {
            const TOPIC: Topic = Topic::$topic;
        })*

        /// Full name of the message on a topic, such as `tactus.v1.Frame`.
        pub(crate) const fn message_name(topic: Topic) -> &'static str {
            match topic {
                $(Topic::$topic => <pb::$message as Message>::NAME,)*
            }
        }
    };
}

on_topics! {
    Frame on SensorFrame,
    SensorInfo on SensorInfo,
    StageState on StageState,
    RunEvent on RunEvent,
    RunState on RunState,
    Health on Health,
    SafetyEvent on SafetyState,
}

/// How a topic is sent. A message is dropped for a client whose link is full: waiting for one client would delay all,
/// because zenoh has one sending thread. A client fetches missed messages again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Policy {
    /// Outgoing queue.
    pub(crate) lane: Lane,
    /// Number of messages kept for clients that join late or missed some.
    pub(crate) history: usize,
    /// Each class has its own priority: zenoh holds a lock per client and priority while it waits for room, and history
    /// replies use [`Priority::Data`], so nothing here uses that.
    pub(crate) priority: Priority,
}

/// The outgoing queues, which are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Frames: many, soon outdated.
    Frames,
    /// Events and states: few, each of them needed.
    Updates,
}

/// Frames kept of each rig.
const FRAMES_KEPT_MAX: usize = 300;
/// Frames kept of all rigs of a service together: some 27 MB.
const FRAMES_KEPT_TOGETHER: usize = 76_800;

/// Frames that are kept of each rig, if a service has so many: with more than 256 of them, fewer than else.
pub(crate) fn frames_kept(rigs: usize) -> usize {
    (FRAMES_KEPT_TOGETHER / rigs.max(1)).clamp(1, FRAMES_KEPT_MAX)
}

impl Policy {
    pub(crate) const fn of(topic: Topic) -> Self {
        match topic {
            Topic::SensorFrame => {
                Self { lane: Lane::Frames, history: FRAMES_KEPT_MAX, priority: Priority::DataHigh }
            }
            Topic::RunEvent => Self::update(16_384),
            Topic::SensorInfo | Topic::StageState | Topic::RunState | Topic::Health | Topic::SafetyState => {
                Self::update(1)
            }
        }
    }

    const fn update(history: usize) -> Self {
        Self { lane: Lane::Updates, history, priority: Priority::InteractiveLow }
    }
}

/// What a client subscribes to in order to hear the messages on `key`. The service has no other key that it matches.
///
/// Not the key itself: a client that subscribes to a key without a wild card gives it a number, under which zenoh then sends to
/// it. With access control, zenoh 1.10.2 looks such a number up while another of its threads may change the table. A client
/// that connected or left in that moment ended the service with a segmentation fault.
pub(crate) fn heard(key: &str) -> String {
    format!("{key}$*")
}

/// The encoding that names a message, such as `application/protobuf;tactus.v1.Frame`.
pub(crate) fn encoding(message_name: &str) -> Encoding {
    Encoding::APPLICATION_PROTOBUF.with_schema(message_name)
}

#[cfg(test)]
#[path = "topic_tests.rs"]
mod tests;
