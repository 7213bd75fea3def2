//! The bus, through its public interface and raw zenoh clients.

mod commands;
mod history;
mod lab;
mod liveliness;
mod stalled;
mod wire;
