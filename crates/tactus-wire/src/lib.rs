//! Codecs and protocol state machines of sensors and stages, without I/O; one module for each device family.
//!
//! A session takes bytes and times and returns actions. It has no sockets, no clock and no tokio. A time is a
//! [`Duration`](core::time::Duration) since an instant of the caller's choice, the same for all calls.
//! [`sensor`] and [`stage`] contain what the protocols share.
#![warn(clippy::indexing_slicing)]

pub mod anyskin;
pub mod declared;
pub mod grbl;
pub mod lines;
pub mod sensor;
pub mod singletact;
pub mod stage;
pub mod weiss;
pub mod zaber;

#[cfg(test)]
mod pieces;
mod unwrapper;
