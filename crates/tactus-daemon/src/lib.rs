//! `tactusd`: the lab service. It is composed of the bus, the engine and `tactus-runner`.

mod inhibitor;
mod notify;
mod service;
#[cfg(feature = "otel")]
mod telemetry;

pub use service::{command, main};
