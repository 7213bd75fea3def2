//! MCAP recordings, their recovery, and the Parquet measurement table.
//!
//! One run is one MCAP file that stock tools open: protobuf channels for frames, stage reports, run events,
//! safety events and the sensor's description, named after the bus keys; and, at its start, the rig, the script,
//! the versions and the parameters as attachments, so that a recording cut off at any byte still says what it is.
//!
//! - [`Recording`] writes one, and loses at most half a second of it when the process is killed.
//! - [`Reader`] streams one, whole or damaged; [`info()`] summarises it; [`recover()`] makes a whole one of a damaged one.
//! - [`Timeline`] knows where the stage was and what it did at each frame's sampling time.
//! - [`export()`] makes the measurement table of any number of recordings; [`table`] reads and checks such a table,
//!   whoever wrote it; [`rows::visit`] gives the rows of either kind of file.
//!
//! Everything here is blocking: callers give it a thread of its own.

pub mod rows;
pub mod table;

mod channel;
mod clock;
mod error;
mod export;
mod header;
mod info;
mod layout;
mod message;
mod reader;
mod recording;
mod recover;
mod scan;
mod tally;
mod timeline;

pub use clock::{EpochClock, NoClock};
pub use error::{RecordError, RowsError};
pub use export::{ExportSummary, export};
pub use header::{Attachment, Header, RunMetadata, Script};
pub use info::{AttachmentInfo, Info, info};
pub use message::{Message, MessageKind, Recorded, Timed};
pub use reader::{Entry, Reader, read};
pub use recording::{Recording, Summary};
pub use recover::{Recovery, recover};
pub use scan::Completeness;
pub use tally::Tally;
pub use timeline::{Sampling, StageReport, Timeline};
