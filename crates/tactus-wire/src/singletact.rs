//! `singletact`: PPS's single capacitive element behind its interface board, an Arduino or the USB board.
//!
//! # Source
//! PPS's published demonstration programs: the sketch of the interface board and the Windows library
//! that talks to it. 115 200 baud, no checksum. The host asks:
//!
//! ```text
//! FF FF FF FF | address | 100 | id | operation | location | n | data | FF | FE FE FE FE
//! ```
//!
//! where `operation` is 1 for read, 2 for write, 4 for calibrate; a read has no data (`n` is what it asks
//! for) and one zero byte behind it, so that it fills 16 bytes. 100 is the timeout of the I2C bus in ms. The
//! board answers:
//!
//! ```text
//! FF FF FF FF | address | timed out | id | timestamp: u32 BE | n | data | FE FE FE FE
//! ```
//!
//! from an Arduino, and with `AA AA AA AA` in front from the USB board. The timestamp is in units of 0.1 ms;
//! in the answer to a write it is an earlier one. The element's reading lies at location 128: a frame counter
//! u16 BE, two bytes that the library passes over, the value u16 BE; the library takes 255 for nothing.
//!
//! Every element answers at address 4 and at one of its own.
//!
//! [`Decoder`] serves both ends of the link; [`Session`] is the host that polls one or several elements.

mod decoder;
mod reply;
mod request;
mod session;

pub use decoder::{Decoder, DecoderStats};
pub use reply::{ElementReading, Reply, ReplyError, Via};
pub use request::{Operation, Request, RequestError};
pub use session::{ANSWER_TIMEOUT, Config, ConfigError, SILENT_POLLS, STALE_AFTER, Session, TICK};

/// The address that every element answers at.
pub const DEFAULT_ADDRESS: u8 = 4;

/// Where the reading begins.
pub const READING_LOCATION: u8 = 128;

/// Bytes of the reading.
pub const READING_BYTES: u8 = 6;

/// What the library takes for no load, in counts.
pub const BASELINE_COUNTS: u16 = 255;

/// What every packet of the host and of an Arduino begins with, four times.
const HEADER: u8 = 0xFF;

/// What every packet of the USB board begins with, four times.
const USB_HEADER: u8 = 0xAA;

/// What every packet ends with, four times.
const FOOTER: [u8; 4] = [0xFE; 4];
