//! MCAP recordings, their recovery, and the Parquet measurement table.
//!
//! One run is one MCAP file that stock tools open. Protobuf channels, named after the bus keys, hold frames, stage reports,
//! run events, safety events and the sensor's description. The rig, the script, the versions and the parameters are
//! attachments at the start of the file, so a recording that is cut off later still says what it is.
//!
//! - [`Recording`] writes a recording, and loses at most half a second of it when the process is killed.
//! - [`Reader`] streams a recording, complete or damaged; [`info()`] summarises it; [`recover()`] makes a complete one from a
//!   damaged one.
//! - [`Timeline`] gives the stage's position and phase at each frame's sampling time.
//! - [`export()`] makes a measurement table from any number of recordings; [`table`] reads and checks such tables from any
//!   program; [`rows::visit`] gives the rows of either kind of file.
//!
//! Everything here blocks: callers run it on a thread of its own.

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
