//! `declared`: any format with frames of one length, given by a description instead of code.
//!
//! The format of the `DigiTacts` kit is not public, and laboratories build their own arrays. A description in TOML
//! (`tactus.link/1`, examples in `config/links`) defines the frames. It is checked once:
//!
//! ```toml
//! schema = "tactus.link/1"
//! name = "my array"
//! framing = "stream"            # or "packet": each read of the device is one frame
//!
//! [frame]
//! bytes = 104                   # length of the whole frame
//! sync = [0xAA, 0x55]           # what it begins with
//! trailer = []                  # what it ends with
//! length = { offset = 2, width = 1, adds = 4 }   # the frame has this field's value and 4 more bytes
//!
//! [samples]
//! offset = 6
//! elements = 48
//! rows = 6
//! cols = 8
//! type = "u16"                  # u8, u12 (packed), u16, i16, u32, f32
//! endian = "little"
//! order = "row-major"           # or "column-major", or the element of each sample: [3, 0, ...]
//! bad = [65535]                 # values that mark an element as bad
//!
//! [sequence]
//! offset = 3
//! width = 1                     # wraps at 256, unless wrap says otherwise
//!
//! [timestamp]
//! offset = 4
//! width = 2
//! tick_ns = 1_000_000
//! unchanged_is_stale = false
//!
//! [checksum]
//! kind = "crc16"                # none, sum8, xor8, crc16, crc32
//! polynomial = 0x1021
//! init = 0xFFFF
//! reflect = false
//! xorout = 0
//! check = 0x29B1                # of "123456789": a guard against a wrong parameter
//! from = 2                      # the first byte that it covers; it stands at the end, behind them all
//! endian = "big"
//! ```
//!
//! `[hid] report_id` and `[usb] interface, endpoint` can say where the frames come from. Negative offsets count from the
//! frame's end.
//!
//! [`RawFormat`] is the description as written, for serde. Reading the file is left to the caller, who knows its path.
//! [`RawFormat::check`] makes a [`Format`], or names the field that contradicts the others. [`Decoder`] is
//! the host's side, [`Encoder`] a virtual device's. [`Session`] reads one connection to a device.
//!
//! To find the description of a device, record what it sends. [`propose`] analyses bytes of an unknown format.
//! [`check_capture`] compares them with a description, and says how to correct it.
//!
//! # Source
//! The parameters of CRCs are those of the public catalogue of CRC algorithms (width, poly, init, refin = refout,
//! xorout, check).

mod capture;
mod check;
mod checksum;
mod decoder;
mod encoder;
mod field;
mod format;
mod inspect;
mod layout;
mod raw;
mod samples;
mod session;
mod sniff;
mod ticks;

pub use capture::{CaptureReport, Hint, Mismatch, Stride, check_capture};
pub use checksum::{Algorithm, CRC32, Crc, CrcParameters, CrcWidth};
pub use decoder::{DecodedFrame, Decoder, DecoderStats};
pub use encoder::{ElementsError, Encoder};
pub use field::Field;
pub use format::{Format, FormatError, MAX_FRAME_BYTES};
pub use raw::{
    ChecksumKind, Endian, Framing, OrderName, RawChecksum, RawFormat, RawFrame, RawHid, RawLength, RawOrder,
    RawSamples, RawSequence, RawTimestamp, RawUsb, SCHEMA, SampleType,
};
pub use samples::Samples;
pub use session::Session;
pub use sniff::{MAX_STRIDE_BYTES, Proposal, propose};

#[cfg(test)]
#[path = "declared/any_description_tests.rs"]
mod any_description_tests;
