//! `weiss-dsa`: the controller `DSACON32m` of Weiss Robotics' tactile arrays, push mode, 12-bit counts.
//!
//! # Source
//! The command set as Schunk's published SDH library uses it (its sources name the packets, the
//! fields and the checksum's table; the controller's own manual is not public). A packet is
//!
//! ```text
//! AA AA AA | id: u8 | length: u16 LE | payload | crc: u16 LE
//! ```
//!
//! with the checksum only where there is a payload; it covers id, length and payload. Firmware older than
//! that library closes a packet with an 8-bit sum instead, taken here to cover the same bytes; no published
//! source says which. All encoders write the newer form, and [`Checksum::close`] turns it into the older one;
//! [`Decoder`] and [`Config`] are told which to expect.
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
pub use frame::{DecodedFrame, FrameError, encode_frame};
pub use info::{ControllerInfo, ErrorCode, InfoError, MatrixInfo, SensorInfo};
pub use packet::{MAX_PAYLOAD_BYTES, Packet, encode_packet, id};
pub use session::{ANSWER_TIMEOUT, Config, Session, SessionError, TICK};

/// What the controller sends three times about 7 s after power-up: a terminal's status query.
/// It takes commands only from about 8 s on.
pub const BOOT_MESSAGE: &[u8; 4] = b"\x1b[5n";
