//! The message on each topic, and its queue, history and priority.

use std::time::Duration;

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
    /// Messages kept for clients that join late or missed some.
    pub(crate) kept: Kept,
    /// Period at which the last message's number is sent, so that a client notices that it missed the last message of a burst. `None` for a
    /// topic that is sent anew every second or more often, whatever happens: the next message shows it.
    pub(crate) heartbeat: Option<Duration>,
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

/// Frames kept of each rig, unless the configuration says otherwise: a minute at 30 Hz. A host that was cut off from the others for
/// half a minute needs 45 s: zenoh takes up to 10 s to notice a dead link, and tries again every 4 s.
const FRAMES_KEPT: usize = 1_800;
/// Frames kept of all rigs of a service together, unless the configuration says otherwise: some 25 MB, with as many reports of the stage.
const FRAMES_KEPT_TOGETHER: usize = 76_800;
/// No configuration may ask for more of each rig: 4 MiB have no room for more frames of 48 elements.
pub(crate) const FRAMES_KEPT_MAX: usize = 16_000;

/// Frames that are kept of each rig. Without a configured number, a service of more than 42 rigs keeps fewer of each.
pub(crate) fn frames_kept(configured: Option<usize>, rigs: usize) -> usize {
    configured.unwrap_or((FRAMES_KEPT_TOGETHER / rigs.max(1)).min(FRAMES_KEPT)).clamp(1, FRAMES_KEPT_MAX)
}

/// How many messages of a topic are kept for clients that join late or missed some.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kept {
    /// As many as frames.
    AsFrames,
    /// The last ones.
    Last(usize),
}

impl Kept {
    pub(crate) const fn messages(self, frames_kept: usize) -> usize {
        match self {
            Self::AsFrames => frames_kept,
            Self::Last(messages) => messages,
        }
    }
}

/// Heartbeat of a topic whose messages come when something happens.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// Heartbeat of a topic that flows: it shows the last message before the device ended. Of a thousand rigs each would be a load.
const HEARTBEAT_OF_A_FLOW: Duration = Duration::from_secs(2);

impl Policy {
    pub(crate) const fn of(topic: Topic) -> Self {
        let flow = Some(HEARTBEAT_OF_A_FLOW);
        match topic {
            Topic::SensorFrame => {
                let priority = Priority::DataHigh;
                Self { lane: Lane::Frames, kept: Kept::AsFrames, heartbeat: flow, priority }
            }
            Topic::StageState => Self { heartbeat: flow, ..Self::update(Kept::AsFrames) },
            Topic::RunEvent => Self::update(Kept::Last(16_384)),
            Topic::SensorInfo | Topic::SafetyState => Self::update(Kept::Last(256)),
            Topic::RunState | Topic::Health => Self { heartbeat: None, ..Self::update(Kept::Last(1)) },
        }
    }

    const fn update(kept: Kept) -> Self {
        let heartbeat = Some(HEARTBEAT);
        Self { lane: Lane::Updates, kept, heartbeat, priority: Priority::InteractiveLow }
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
