//! The kinds of messages in a recording, listed once. Channels, encoding, decoding and counting follow from the list.

use prost::Message as _;
use tactus_schema::{Frame, Message as Schema, MonoTime, TimeStamp, WallTime, key::Topic, pb};

use crate::Tally;

/// A message that recordings hold.
pub trait Recorded {
    /// Its kind, which determines channel and schema.
    const KIND: MessageKind;

    /// Appends the message as protobuf.
    fn encode(&self, bytes: &mut Vec<u8>);

    /// Adds the message to the counts of its run.
    fn count(&self, tally: &mut Tally);
}

/// A recorded message that has a time and a sequence number of its own.
pub trait Timed: Recorded {
    /// When it was made; of a frame, when it was received.
    fn at(&self) -> TimeStamp;

    /// Its sequence number.
    fn seq(&self) -> u64;
}

/// Makes everything that knows all kinds. The entry of a kind names, in this order: its variant of [`Message`] with what
/// that holds; the type that is written; its form on the wire, which is the channel's schema; the topic, which names the
/// channel; time and sequence number, unless the message has none; and what it adds to the counts beside its time.
macro_rules! kinds {
    ($(
        $(#[$doc:meta])*
        $kind:ident($held:ty) {
            message: $message:ty,
            wire: $wire:ty,
            topic: $topic:ident,
            $(timed: |$timed:ident| ($at:expr, $seq:expr),)?
            $(counted: |$counted:ident, $tally:ident| $count:expr,)?
        }
    )*) => {
        /// A recorded message as it is read back.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Message {
            $($(#[$doc])* $kind($held),)*
            /// A message that this version does not know; its schema's name.
            Unknown(String),
        }

        /// A kind of message that this version writes and reads.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum MessageKind {
            $($(#[$doc])* $kind,)*
        }

        impl MessageKind {
            /// Every kind, in the order in which a recording declares their channels.
            pub const ALL: [Self; [$(Self::$kind),*].len()] = [$(Self::$kind),*];

            /// The topic that the channel is named after.
            pub const fn topic(self) -> Topic {
                match self {
                    $(Self::$kind => Topic::$topic,)*
                }
            }

            /// Name of the channel's schema, such as `tactus.v1.Frame`.
            pub const fn schema(self) -> &'static str {
                match self {
                    $(Self::$kind => <$wire as Schema>::NAME,)*
                }
            }
        }

        impl Message {
            /// Reads a message of the schema of that name.
            pub(crate) fn decode(schema: &str, bytes: &[u8]) -> Result<Self, prost::DecodeError> {
                match MessageKind::ALL.into_iter().find(|kind| kind.schema() == schema) {
                    $(Some(MessageKind::$kind) => Ok(Self::$kind(<$wire>::decode(bytes)?.into())),)*
                    None => Ok(Self::Unknown(schema.to_owned())),
                }
            }

            /// When it was made, on both clocks of the host; `None` if the message does not say.
            #[allow(unreachable_patterns, reason = "the second list has those kinds too that have a time")]
            pub fn at(&self) -> Option<TimeStamp> {
                match self {
                    $($(Self::$kind($timed) => Some($at),)?)*
                    $(Self::$kind(_) => None,)*
                    Self::Unknown(_) => None,
                }
            }

            /// Adds it to the counts of its run.
            pub(crate) fn count(&self, tally: &mut Tally) {
                match self {
                    $(Self::$kind(message) => <$message as Recorded>::count(message, tally),)*
                    Self::Unknown(_) => {}
                }
            }

            /// An empty message of every kind.
            #[cfg(test)]
            pub(crate) fn empty() -> Vec<Self> {
                vec![$(Self::$kind(<$wire>::default().into())),*]
            }

            /// Writes it as its own kind.
            #[cfg(test)]
            pub(crate) fn write(
                &self,
                writer: &mut crate::stream::ChannelWriter,
                at: TimeStamp,
            ) -> Result<(), mcap::McapError> {
                match self {
                    $(Self::$kind(message) => writer.write::<$message>(message, 0, at),)*
                    Self::Unknown(_) => Ok(()),
                }
            }
        }

        $(
            impl Recorded for $message {
                const KIND: MessageKind = MessageKind::$kind;

                fn encode(&self, bytes: &mut Vec<u8>) {
                    OnWire::<$wire>::append(self, bytes);
                }

                #[allow(unused_variables, reason = "a message without a time that is not counted")]
                fn count(&self, tally: &mut Tally) {
                    $({
                        let $timed = self;
                        tally.time($at.mono);
                    })?
                    $({
                        let ($counted, $tally) = (self, tally);
                        $count;
                    })?
                }
            }

            $(impl Timed for $message {
                fn at(&self) -> TimeStamp {
                    let $timed = self;
                    $at
                }

                fn seq(&self) -> u64 {
                    let $timed = self;
                    $seq
                }
            })?
        )*
    };
}

// The order is part of the format, and only ever grows at its end: recovery knows the channels by it.
kinds! {
    /// One reading of all elements.
    Frame(Frame) {
        message: Frame,
        wire: pb::Frame,
        topic: SensorFrame,
        timed: |frame| (frame.received, frame.seq),
        counted: |frame, tally| tally.frame(frame),
    }
    /// The sensor's description of itself.
    SensorInfo(pb::SensorInfo) {
        message: pb::SensorInfo,
        wire: pb::SensorInfo,
        topic: SensorInfo,
    }
    /// A report of the stage.
    Stage(pb::StageState) {
        message: pb::StageState,
        wire: pb::StageState,
        topic: StageState,
        timed: |state| (stamp(state.t_mono_ns, state.t_wall_ns), state.seq),
    }
    /// An event of the run.
    Event(Box<pb::RunEvent>) {
        message: pb::RunEvent,
        wire: pb::RunEvent,
        topic: RunEvent,
        timed: |event| (stamp(event.t_mono_ns, event.t_wall_ns), event.seq),
        counted: |event, tally| tally.event(event),
    }
    /// A verdict of the safety supervisor.
    Safety(pb::SafetyEvent) {
        message: pb::SafetyEvent,
        wire: pb::SafetyEvent,
        topic: SafetyState,
        timed: |event| (stamp(event.t_mono_ns, event.t_wall_ns), event.seq),
    }
}

fn stamp(mono_ns: i64, wall_ns: i64) -> TimeStamp {
    TimeStamp { mono: MonoTime::from_ns(mono_ns), wall: WallTime::from_ns(wall_ns) }
}

/// A message that is written as the protobuf message `W`.
trait OnWire<W> {
    fn append(&self, bytes: &mut Vec<u8>);
}

impl<W: Schema> OnWire<W> for W {
    fn append(&self, bytes: &mut Vec<u8>) {
        self.encode_raw(bytes);
    }
}

impl OnWire<pb::Frame> for Frame {
    fn append(&self, bytes: &mut Vec<u8>) {
        self.encode(bytes);
    }
}

#[cfg(test)]
#[path = "message_tests.rs"]
mod tests;
