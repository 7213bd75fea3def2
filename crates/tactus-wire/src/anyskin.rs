//! `anyskin`: the boards of `ReSkin` and `AnySkin`, five magnetometers under a magnetic skin.
//!
//! # Source
//! The published Python libraries of both sensors, in binary mode. The board streams without a request, at 115 200 baud. A
//! frame has 82 bytes:
//!
//! ```text
//! 5 x (temperature, x, y, z: f32 LE) | 0D 0A
//! ```
//!
//! There is no mark at the beginning and no checksum, and `0D 0A` can occur in the numbers. [`Decoder`] therefore accepts a
//! frame only if further frames of this length follow. The board sends neither time nor count, so only skipped bytes show
//! that something was lost.

mod decoder;
mod frame;
mod session;

pub use decoder::{CONFIRMING_FRAMES, Decoder, DecoderStats};
pub use frame::{DecodedFrame, FRAME_BYTES, MAGNETOMETERS, Magnetometer};
pub use session::Session;
