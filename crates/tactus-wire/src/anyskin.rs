//! `anyskin`: the boards of `ReSkin` and `AnySkin`, five magnetometers under a magnetic skin.
//!
//! # Source
//! The published Python libraries of both sensors, in their binary mode, which streams without being asked at
//! 115 200 baud. A frame is 82 bytes:
//!
//! ```text
//! 5 x (temperature, x, y, z: f32 LE) | 0D 0A
//! ```
//!
//! with neither a beginning nor a checksum, and `0D 0A` can occur in the numbers. So [`Decoder`] takes a
//! place for the end of a frame only if frames of this length go on from it. The board sends no time and no
//! count: what is lost between two frames can be told in bytes only.

mod decoder;
mod frame;
mod session;

pub use decoder::{CONFIRMING_FRAMES, Decoder, DecoderStats};
pub use frame::{DecodedFrame, FRAME_BYTES, MAGNETOMETERS, Magnetometer};
pub use session::Session;
