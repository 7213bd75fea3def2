//! The contracts of Tactus: messages, bus keys, frames and times, the rig file, the model file, the draft file, the
//! measurement table.
//!
//! Every change is a new version. There is no I/O: the caller reads and stores the texts and bytes.

pub mod draft;
pub mod key;
pub mod model;
pub mod rig;
pub mod table;

mod description;
mod frame;
mod message;
mod time;

pub use description::stated_schema;
pub use draft::{DraftFile, DraftFileError};
pub use frame::{Frame, FrameFlags};
pub use message::{Message, pb, with_message};
pub use model::{Model, ModelFileError};
pub use rig::{Rig, RigError};
pub use time::{DeviceTick, MonoTime, TimeStamp, WallTime};

/// The compiled descriptor set of `tactus.v1`, as stock protobuf and MCAP tools read it.
pub const DESCRIPTOR_SET: &[u8] = include_bytes!("../proto/tactus.binpb");
