//! `tactusd`: the lab service. It is composed of the bus, the engine and `tactus-runner`.

mod inhibitor;
mod notify;
mod service;

pub use service::{command, main};
