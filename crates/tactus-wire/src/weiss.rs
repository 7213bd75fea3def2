//! `weiss-dsa`: the controller `DSACON32m` of Weiss Robotics' tactile arrays, push mode, 12-bit counts.
//!
//! # Source
//! The command set as Schunk's published SDH library uses it. Its sources name the packets, the fields and the checksum's
//! table; the controller's own manual is not public. A packet is
//!
//! ```text
//! AA AA AA | id: u8 | length: u16 LE | payload | crc: u16 LE
//! ```
//!
//! The checksum is there only if there is a payload. It covers id, length and payload. Older firmware ends a packet with an
//! 8-bit sum instead. No published source says which bytes it covers; here they are the same. All encoders write the newer
//! form, and [`Checksum::close`] converts it to the older one. [`Decoder`] and [`Config`] have an option for it.
//!
//! [`Decoder`] serves both ends of the link: the host reads replies and frames with it, a virtual
//! device reads [`HostCommand`]s. [`Session`] is the host's side.

mod checksum;
mod command;
mod crc;
mod decoder;
mod frame;
mod info;
mod packet;
mod session;
mod ticks;

pub use checksum::Checksum;
pub use command::{
    CommandError, HostCommand, acknowledge, acquire, query_controller, query_matrix, query_sensor,
};
pub use crc::crc;
pub use decoder::{ChecksumError, Decoder, DecoderStats};
pub(crate) use frame::PackedFrame;
pub use frame::{DecodedFrame, FrameError, encode_frame};
pub use info::{ControllerInfo, ErrorCode, InfoError, MatrixInfo, SensorInfo};
pub use packet::{MAX_PAYLOAD_BYTES, Packet, encode_packet, id};
pub use session::{ANSWER_TIMEOUT, Config, Session, SessionError, TICK};

/// A terminal's status query, which the controller sends three times about 7 s after power-up. It accepts commands only
/// after about 8 s.
pub const BOOT_MESSAGE: &[u8; 4] = b"\x1b[5n";
