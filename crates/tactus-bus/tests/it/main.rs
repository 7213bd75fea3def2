//! The bus, through its public interface and raw zenoh clients.

mod access;
mod churn;
mod commands;
mod history;
mod hosts;
mod lab;
mod liveliness;
mod rigs;
mod stalled;
mod stop;
#[cfg(feature = "tls")]
mod tls;
mod wire;
