//! The program `tactus-mock`: a virtual rig at pseudo-terminals or on USB; test data with hidden physics.

mod cli;
mod hidden;
mod usb;

pub use cli::{command, main};
