//! Which message stands on which topic, and how it travels.

use tactus_schema::{Message, key::Topic, pb};
use zenoh::{bytes::Encoding, qos::Priority};

/// A message that the service publishes, on a topic of its own.
pub trait Published: Message {
    /// Its topic.
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

/// How a topic travels. Whatever is published is dropped for a client whose link is full: to wait for one
/// client would be to wait for all, since zenoh's one sending thread waits along. A client fetches again
/// what it missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Policy {
    /// The queue it waits in on its way out.
    pub(crate) lane: Lane,
    /// Messages kept for late joiners and for those who missed some.
    pub(crate) history: usize,
    /// Each class has a priority of its own: zenoh holds a lock per client and priority while it waits for
    /// room, and it answers for history at [`Priority::Data`], so nothing here uses that.
    pub(crate) priority: Priority,
}

/// The queues on the way out; neither waits for the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Frames, many and soon stale.
    Frames,
    /// Everything else, few and each of them wanted.
    News,
}

impl Policy {
    pub(crate) const fn of(topic: Topic) -> Self {
        match topic {
            Topic::SensorFrame => Self { lane: Lane::Frames, history: 300, priority: Priority::DataHigh },
            Topic::RunEvent => Self::news(65_536),
            Topic::SensorInfo | Topic::StageState | Topic::RunState | Topic::Health | Topic::SafetyState => {
                Self::news(1)
            }
        }
    }

    const fn news(history: usize) -> Self {
        Self { lane: Lane::News, history, priority: Priority::InteractiveLow }
    }
}

/// The encoding that names a message, such as `application/protobuf;tactus.v1.Frame`.
pub(crate) fn encoding(message_name: &str) -> Encoding {
    Encoding::APPLICATION_PROTOBUF.with_schema(message_name)
}

#[cfg(test)]
#[path = "topic_tests.rs"]
mod tests;
