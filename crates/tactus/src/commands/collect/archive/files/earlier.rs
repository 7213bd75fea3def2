//! What an earlier collection has of a rig: a collector that starts again hears much of it once more, as the rig's service keeps it.

use std::fs;
use std::path::{Path, PathBuf};

use tactus_record::{Entry, Message, MessageKind, RecordError, Timed, tail};
use tactus_schema::TimeStamp;

/// So much of the newest file is looked at: more than a minute of 48 elements at 30 Hz.
const END_BYTES: u64 = 256 * 1024;

/// Times are of one clock if their wall time is ahead of their monotonic time by the same, up to this. The monotonic time of a service begins
/// with it; the wall time of a host is set now and then.
const ONE_CLOCK_NS: u128 = 1_000_000_000;

/// Up to where the newest file of a rig goes.
#[derive(Debug, Default)]
pub(super) struct Earlier {
    /// Time of the last message of each kind.
    last: [Option<TimeStamp>; MessageKind::ALL.len()],
}

impl Earlier {
    /// Of the files in a folder, which may not be there.
    pub(super) fn in_folder(folder: &Path) -> Self {
        let mut files: Vec<PathBuf> =
            fs::read_dir(folder).into_iter().flatten().flatten().map(|file| file.path()).collect();
        files.retain(|file| file.extension().is_some_and(|extension| extension == "mcap"));
        files.sort_unstable();
        let of = |file: PathBuf| {
            Self::of(&file).unwrap_or_else(|error| {
                eprintln!("{error}: what it has of the last minute may be recorded twice");
                None
            })
        };
        files.into_iter().rev().find_map(of).unwrap_or_default()
    }

    /// Of a file; `None` if it has no message.
    fn of(file: &Path) -> Result<Option<Self>, RecordError> {
        let (mut earlier, mut first) = (Self::default(), None);
        for entry in tail::entries(file, END_BYTES)? {
            let entry = entry.map_err(|source| RecordError::Io {
                action: "look at the end of",
                path: file.to_owned(),
                source,
            })?;
            let Entry::Message { message, .. } = entry else { continue };
            let (Some(kind), Some(at)) = (kind(&message), message.at()) else { continue };
            first.get_or_insert(at);
            let last = earlier.last[kind as usize].get_or_insert(at);
            if at.mono > last.mono {
                *last = at;
            }
        }
        // Of a kind that is not in the end, all is before it.
        Ok(first.map(|first| Self { last: earlier.last.map(|last| last.or(Some(first))) }))
    }

    /// True if the message is in that file, or in one before it.
    pub(super) fn has<M: Timed>(&self, message: &M) -> bool {
        let at = message.at();
        self.last[M::KIND as usize].is_some_and(|last| is_one_clock(at, last) && at.mono <= last.mono)
    }
}

/// The kind of a message that has a time.
fn kind(message: &Message) -> Option<MessageKind> {
    match message {
        Message::Frame(_) => Some(MessageKind::Frame),
        Message::Stage(_) => Some(MessageKind::Stage),
        Message::Event(_) => Some(MessageKind::Event),
        Message::Safety(_) => Some(MessageKind::Safety),
        Message::SensorInfo(_) | Message::Unknown(_) => None,
    }
}

fn is_one_clock(one: TimeStamp, other: TimeStamp) -> bool {
    let ahead_ns = |at: TimeStamp| i128::from(at.wall.ns()) - i128::from(at.mono.ns());
    (ahead_ns(one) - ahead_ns(other)).unsigned_abs() < ONE_CLOCK_NS
}
