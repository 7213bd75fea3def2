//! MCAP recordings, their recovery, and the Parquet measurement table.
//!
//! One run is one MCAP file that stock tools open. Protobuf channels, named after the bus keys, hold frames, stage reports,
//! run events, safety events and the sensor's description. The rig, the script, the versions and the parameters are
//! attachments at the start of the file, so a recording that is cut off later still says what it is.
//!
//! - [`Recording`] writes a recording, and loses at most half a second of it when the process is killed. It goes to a
//!   [`Storage`]: [`FileStorage`] locks its file, and keeps disk space in reserve for its end. [`space`] says how much is needed.
//! - [`Reader`] streams a recording, complete or damaged; [`info()`] summarises it; [`recover()`] makes a complete one from a
//!   damaged one.
//! - [`Timeline`] gives the stage's position and phase at each frame's sampling time.
//! - [`export()`] makes a measurement table from any number of recordings; [`table`] reads and checks such tables from any
//!   program; [`rows::visit`] gives the rows of either kind of file.
//!
//! Everything here blocks: callers run it on a thread of its own.

pub mod meter;
pub mod rows;
pub mod space;
pub mod table;
pub mod tail;

mod bytes;
mod channel;
mod chunk;
mod clock;
mod completeness;
mod compressor;
mod confirmed;
mod error;
mod export;
#[cfg(test)]
mod fixtures;
mod header;
mod info;
mod layout;
mod message;
mod reader;
mod recording;
mod recover;
mod rig_groups;
mod scan;
mod storage;
mod stream;
mod tally;
mod timeline;

pub use clock::{EpochClock, NoClock};
pub use completeness::{Completeness, Damage};
pub use confirmed::{ConfirmedPress, confirmed_presses};
pub use error::{Missing, RecordError, RowsError};
pub use export::{ExportSummary, export, export_as};
pub use header::{Attachment, Header, RunMetadata, Script};
pub use info::{AttachmentInfo, Info, info};
pub use message::{Message, MessageKind, Recorded, Timed};
pub use reader::{Entry, Reader, read};
pub use recording::{Recording, Summary};
pub use recover::{LastPress, Recovery, recover};
pub use rig_groups::RigGroups;
pub use storage::{FileStorage, Storage, SyncHandle, sync_folder_of};
pub use tally::Tally;
pub use timeline::{Sampling, StageReport, Timeline};
