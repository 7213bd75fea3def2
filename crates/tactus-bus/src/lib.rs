//! The bus: what the service publishes, what it answers, and how a client finds it; zenoh underneath.
//!
//! The service opens a [`Bus`] and hands out [`Publisher`]s, whose calls never wait; commands come
//! to it as [`Calls`]. A client [`Client::connect`]s, asks [`Client::command`]s and
//! [`Client::subscribe`]s to messages. Keys, messages and their encoding are those of
//! `tactus-schema`, so that any zenoh client in any language can take part.
//!
//! | topic | kept for late joiners |
//! |---|---|
//! | `sensor/frame` | the last 300 (10 s) |
//! | `run/event` | the last 65,536 |
//! | all others | the last one |
//!
//! A client that cannot keep up misses messages, and fetches again those that are still kept; nobody waits
//! for it. A client that asks for something and does not take the answer is disconnected after 100 ms. Frames
//! and the rest travel in separate queues and priorities, so that neither delays the other, and both stand
//! behind commands. The sequence number inside a frame tells what was lost where.
//!
//! Everything here needs a **multi-thread tokio runtime**: zenoh panics on a current-thread one, and
//! with it on a paused clock. What runs in virtual time runs without the bus.
//!
//! Unless configured otherwise nothing listens or is sent beyond loopback: multicast scouting and
//! gossip are off, and the service listens on `tcp/127.0.0.1:7447` only.

mod cache;
mod client;
mod command;
mod config;
mod endpoint;
mod error;
mod liveness;
mod merge;
mod publisher;
mod queue;
mod service;
mod subscription;
mod topic;
mod worker;

pub use client::Client;
pub use command::{Calls, CommandCall, Request, Responder};
pub use config::BusConfig;
pub use endpoint::Endpoint;
pub use error::BusError;
pub use liveness::{Alive, AliveToken};
pub use publisher::Publisher;
pub use service::Bus;
pub use subscription::{History, Losses, Subscription};
pub use topic::Published;
