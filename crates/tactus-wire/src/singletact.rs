//! `singletact`: PPS's single capacitive element behind its interface board, an Arduino or the USB board.
//!
//! # Source
//! PPS's published demonstration programs: the sketch of the interface board, and the Windows library that uses it.
//! 115 200 baud, no checksum. A request of the host is
//!
//! ```text
//! FF FF FF FF | address | 100 | id | operation | location | n | data | FF | FE FE FE FE
//! ```
//!
//! where `operation` is 1 for read, 2 for write, 4 for calibrate. A read has no data: `n` is the number of requested bytes,
//! and a zero byte follows, which makes it 16 bytes long. 100 is the timeout of the I2C bus in ms. The board answers
//!
//! ```text
//! FF FF FF FF | address | timed out | id | timestamp: u32 BE | n | data | FE FE FE FE
//! ```
//!
//! if it is an Arduino; from the USB board the first four bytes are `AA AA AA AA`. The timestamp is in units of 0.1 ms; in the
//! answer to a write it is an earlier one. The element's reading is at location 128: a frame counter (u16 BE), two bytes
//! that the library ignores, and the value (u16 BE). The library takes 255 as no load.
//!
//! Every element answers at address 4 and at its own address.
//!
//! [`Decoder`] is for both ends of the link. [`Session`] is the host, which polls one or more elements.

mod decoder;
mod reply;
mod request;
mod session;

pub use decoder::{Decoder, DecoderStats};
pub use reply::{ElementReading, Reply, ReplyError, Via};
pub use request::{Operation, Request, RequestError};
pub use session::{ANSWER_TIMEOUT, Config, ConfigError, SILENT_POLLS, STALE_AFTER, Session, TICK};

/// Address at which every element answers.
pub const DEFAULT_ADDRESS: u8 = 4;

/// Location of the reading in the element's register.
pub const READING_LOCATION: u8 = 128;

/// Length of the reading.
pub const READING_BYTES: u8 = 6;

/// Counts without load, by the published library.
pub const BASELINE_COUNTS: u16 = 255;

/// Begins every packet of the host and of an Arduino, four times.
const HEADER: u8 = 0xFF;

/// Begins every packet of the USB board, four times.
const USB_HEADER: u8 = 0xAA;

/// Ends every packet.
const FOOTER: [u8; 4] = [0xFE; 4];
