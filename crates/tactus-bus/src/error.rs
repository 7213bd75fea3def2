//! What can go wrong on the bus.

use std::{error::Error, io, time::Duration};

/// An error of the bus, with what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// An endpoint that is not `tcp/HOST:PORT`.
    #[error("endpoint {endpoint:?}: {reason}; it should read tcp/HOST:PORT, such as tcp/127.0.0.1:7447")]
    Endpoint {
        /// As it was written.
        endpoint: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The service's session could not be opened.
    #[error("cannot open the bus on {listen}; is another service listening there?")]
    Open {
        /// The endpoints to listen on.
        listen: String,
        /// What zenoh said.
        source: Box<dyn Error + Send + Sync>,
    },
    /// Nothing listens there.
    #[error("no service at {endpoint}: start tactusd, or name another endpoint")]
    NoService {
        /// Where it was looked for.
        endpoint: String,
        /// What the system said.
        source: io::Error,
    },
    /// Something listens there, but it does not speak the bus's protocol.
    #[error("what listens at {endpoint} does not answer as a Tactus service")]
    Session {
        /// Where it was looked for.
        endpoint: String,
        /// What zenoh said.
        source: Box<dyn Error + Send + Sync>,
    },
    /// A rig's name that cannot be part of a key.
    #[error("rig name {rig:?}: letters, digits, '-' and '_' only")]
    RigName {
        /// As it was written.
        rig: String,
    },
    /// No rig is alive at the endpoint that was asked.
    #[error("a bus listens at {endpoint}, but no rig is ready on it; its service may still be starting")]
    NoRig {
        /// Where it was looked for.
        endpoint: String,
    },
    /// More than one rig is alive and none was named.
    #[error("several rigs are ready at {endpoint}: {}; name one", .rigs.join(", "))]
    SeveralRigs {
        /// Where it was looked for.
        endpoint: String,
        /// Their names, sorted.
        rigs: Vec<String>,
    },
    /// A key could not be declared or asked.
    #[error("the bus refused {key}")]
    Key {
        /// The key.
        key: String,
        /// What zenoh said.
        source: Box<dyn Error + Send + Sync>,
    },
    /// A command that nobody answered.
    #[error("nobody answered {key} (waited at most {} s): the rig's service is gone or busy", .waited.as_secs_f64())]
    NoAnswer {
        /// The command's key.
        key: String,
        /// The longest the answer was waited for.
        waited: Duration,
    },
    /// An answer that is no [`tactus_schema::pb::CommandReply`].
    #[error(
        "the answer to {key} is not a tactus.v1.CommandReply; client and service may be of different versions"
    )]
    Answer {
        /// The command's key.
        key: String,
        /// What is wrong with it.
        source: prost::DecodeError,
    },
    /// A thread could not be started.
    #[error("the bus cannot start a thread")]
    Thread {
        /// What the system said.
        source: io::Error,
    },
    /// The session did not close cleanly.
    #[error("the bus did not close cleanly")]
    Close {
        /// What zenoh said.
        source: Box<dyn Error + Send + Sync>,
    },
}

impl BusError {
    /// For a key that could not be declared or asked.
    pub(crate) fn key(key: &str) -> impl FnOnce(zenoh::Error) -> Self {
        move |source| Self::Key { key: key.to_owned(), source }
    }
}
