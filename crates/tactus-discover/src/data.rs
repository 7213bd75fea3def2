//! The data before any model: frames, where the tip rests and presses, bins of frames, the noise of a reading, faulty elements.
//!
//! Readings are averaged where the tip rests ([`bins`]). The mean of `n` consecutive readings with the autocorrelation `rho` has the
//! variance
//!
//! ```text
//! noise^2 / n (1 + 2 sum over k of (1 - k / n) rho(k))
//! ```
//!
//! The noise is that of readings that repeat each other ([`noise`]), so it does not depend on the model. One press in three is held out.
//! Blocks of bins that are long beside the memory of the noise count as independent. Elements that calibration finds faulty
//! ([`faulty`]) have no weight, or an effect of their own in the base model.

mod bins;
mod contacts;
mod converter;
mod error;
mod excerpt;
mod faulty;
mod floor;
mod frames;
mod history;
mod known;
mod motion;
mod noise;
pub(crate) mod spectrum;
mod way;

pub(crate) use bins::{Bins, HeldOut, presses};
pub(crate) use contacts::Contacts;
pub(crate) use converter::{Converter, Fault, Gap, Rounding};
pub use error::DiscoverError;
pub(crate) use faulty::{Faulty, MISWIRED, rewired};
pub use floor::Floor;
pub use frames::Frames;
pub(crate) use frames::OnWay;
pub(crate) use history::History;
pub use known::Known;
pub(crate) use motion::{interval_s, load_speeds_mm_per_s, still, turns};
pub(crate) use noise::{Noise, QUIETEST};
pub(crate) use spectrum::Line;
