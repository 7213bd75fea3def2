//! Sans-IO codecs and protocol state machines of sensors and stages, one module a device family.
//!
//! Bytes and times come in, actions go out: no sockets, no clock, no tokio. A time is a
//! [`Duration`](core::time::Duration) since an instant of the caller's choice, the same for all calls.
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
