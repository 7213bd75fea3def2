//! The bus between the service and its clients, based on zenoh: published messages, commands and liveliness.
//!
//! The service opens a [`Node`], puts each of its rigs on it as a [`Bus`], and hands out [`Publisher`]s, whose calls never
//! wait; it receives commands as [`CommandCall`]s. A client uses [`Client::connect`], [`Client::command`] and [`Client::subscribe`] or, where each moment counts,
//! [`Client::listen`]; a [`Lab`] has clients of many rigs over one
//! connection. Keys, messages and encoding are those
//! of `tactus-schema`, so any zenoh client in any language can take part.
//!
//! | topic | kept for late joiners |
//! |---|---|
//! | `sensor/frame`, `stage/state` | the last 1,800, a minute of frames; with more than 42 rigs fewer, 76,800 of all; or [`BusConfig::frames_kept`] |
//! | `run/event` | the last 16,384 |
//! | `sensor/info`, `safety/state` | the last 256 |
//! | `run/state`, `health` | the last one |
//!
//! Of each topic at most 4 MiB are kept.
//!
//! A client that cannot keep up misses messages and fetches those that are still kept; nobody waits for it. A client that
//! asks for something and does not read the answer is disconnected after 100 ms. Frames and other messages have separate
//! queues and priorities, so that neither delays the other; commands have priority over both. The sequence number in
//! a frame shows where frames were lost.
//!
//! Everything here needs a **multi-thread tokio runtime**: zenoh panics on a current-thread one, and
//! therefore also with a paused clock. Runs in virtual time do not use the bus.
//!
//! By default the bus uses loopback only: multicast scouting and gossip are off, and the service listens on
//! `tcp/127.0.0.1:7447`.
//!
//! A client can read, ask and command, and nothing else: `access` has the rules. A command is a request to exactly its key
//! by who holds the lease ([`Client::hold`]); a stop needs neither a lease nor a connection ([`stop()`]). Clients
//! believe only the session that the service has announced.

mod access;
mod cache;
mod client;
mod command;
mod config;
mod denial;
mod endpoint;
mod error;
mod lease;
mod linger;
mod listener;
mod liveness;
mod merge;
mod node;
mod outlet;
mod publisher;
mod queue;
mod service;
mod stop;
mod subscription;
mod topic;
mod worker;

pub use client::{Client, Lab, ask_all, rigs_at, stop};
pub use command::{Calls, CommandCall, Request, Responder};
pub use config::{BusConfig, Credentials, TlsConfig};
pub use endpoint::Endpoint;
pub use error::BusError;
pub use lease::{HeldLease, Hold};
pub use listener::Listener;
pub use liveness::{Alive, AliveToken};
pub use node::Node;
pub use publisher::Publisher;
pub use service::Bus;
pub use subscription::{Gap, History, Losses, Subscription};
pub use topic::Published;
