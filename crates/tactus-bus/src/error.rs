//! Errors of the bus.

use std::{error::Error, io, time::Duration};

/// An error of the bus. The message says what to do about it.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum BusError {
    /// An endpoint in a form that [`crate::Endpoint`] does not have.
    #[error("endpoint {endpoint:?}: {reason}; it should read tcp/HOST:PORT, such as tcp/127.0.0.1:7447")]
    Endpoint { endpoint: String, reason: &'static str },
    /// An endpoint that other machines reach without a certificate.
    #[error("the bus does not use {endpoint}: {reason}")]
    Unprotected { endpoint: String, reason: &'static str },
    /// A number of frames to keep that cannot be.
    #[error("frames_kept = {frames}: 1 to {frames_max} frames of each rig can be kept")]
    FramesKept { frames: usize, frames_max: usize },
    /// What should be denied was not: see [`crate::BusConfig`].
    #[error(
        "the bus does not listen on {endpoint}: a client {who} could command the rig; see docs/security.md"
    )]
    NotDenied { endpoint: String, who: String },
    /// Another program takes the datagrams of stops.
    #[error("cannot take stops at {endpoint}; does another program use that place?")]
    Stop { endpoint: String, source: io::Error },
    /// The service's session could not be opened.
    #[error("cannot open the bus on {listen}; is another service listening there?")]
    Open { listen: String, source: Box<dyn Error + Send + Sync> },
    /// Nothing listens at the endpoint.
    #[error("no service at {endpoint}: start tactusd, or name another endpoint")]
    NoService { endpoint: String, source: io::Error },
    /// A Unix socket that this user may not open.
    #[error(
        "this user may not reach the service at {endpoint}: its group may (the installed service's is `tactus`)"
    )]
    NotAllowed { endpoint: String, source: io::Error },
    /// The program that listens at the endpoint does not use the bus's protocol.
    #[error("the program at {endpoint} does not answer as a Tactus service")]
    Session { endpoint: String, source: Box<dyn Error + Send + Sync> },
    /// Two programs say that they are one rig's service.
    #[error(
        "several programs at {endpoint} say that they are the service of rig {rig:?}: give each rig a name of its own; until then, connect to its service itself"
    )]
    SeveralServices { endpoint: String, rig: String },
    /// A rig's name with characters that a key cannot have.
    #[error("rig name {rig:?}: letters, digits, '-' and '_' only")]
    RigName { rig: String },
    /// No rig is ready at the endpoint.
    #[error("a bus listens at {endpoint}, but no rig is ready on it; its service may still be starting")]
    NoRig { endpoint: String },
    /// The node serves a rig of that name.
    #[error("rig {rig:?} is already served here: give each rig a name of its own")]
    Served { rig: String },
    /// Several rigs are there and none was named.
    #[error("several rigs are served at {endpoint}: {}; name one with --rig NAME", .rigs.join(", "))]
    SeveralRigs { endpoint: String, rigs: Vec<String> },
    /// The rig that was named is not served.
    #[error("no rig {rig:?} at {endpoint}; there is: {}", .rigs.join(", "))]
    UnknownRig { endpoint: String, rig: String, rigs: Vec<String> },
    /// No service answered a stop, neither to a datagram nor on the bus.
    #[error("STOP WAS NOT CONFIRMED: no service at {endpoint} answered. Use the emergency stop")]
    NotStopped { endpoint: String, source: Box<dyn Error + Send + Sync> },
    /// Zenoh refused a key.
    #[error("the bus refused {key}")]
    Key { key: String, source: Box<dyn Error + Send + Sync> },
    /// A command without a reply.
    #[error("no answer to {key} (waited at most {} s): the rig's service is gone or busy", .waited.as_secs_f64())]
    NoAnswer { key: String, waited: Duration },
    /// A reply that is not a [`tactus_schema::pb::CommandReply`].
    #[error(
        "the answer to {key} is not a tactus.v1.CommandReply; client and service may be of different versions"
    )]
    Answer { key: String, source: prost::DecodeError },
    /// A thread could not be started.
    #[error("the bus cannot start a thread")]
    Thread { source: io::Error },
    /// The session did not close cleanly.
    #[error("the bus did not close cleanly")]
    Close { source: Box<dyn Error + Send + Sync> },
}

impl BusError {
    /// The error for a refused key.
    pub(crate) fn key(key: &str) -> impl FnOnce(zenoh::Error) -> Self {
        move |source| Self::Key { key: key.to_owned(), source: of_zenoh(&source) }
    }
}

/// Zenoh's error without the places in its source, which name folders of the machine that built it.
pub(crate) fn of_zenoh(error: &zenoh::Error) -> Box<dyn Error + Send + Sync> {
    without_places(&error.to_string()).into()
}

/// Removes ` at FILE.rs:LINE.`, with which zenoh ends each cause.
fn without_places(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for word in text.split(' ') {
        let place = word.trim_end_matches([')', ']', ',', ';']);
        let line = place.trim_end_matches('.').rsplit_once(".rs:").map(|(_, line)| line);
        if let Some(before) = plain.strip_suffix(" at")
            && line.is_some_and(|line| line.parse::<u32>().is_ok())
        {
            plain.truncate(before.len());
            plain.push_str(&word[place.len()..]);
        } else {
            plain.push_str(if plain.is_empty() { "" } else { " " });
            plain.push_str(word);
        }
    }
    plain
}

#[cfg(test)]
#[path = "error_tests.rs"]
mod tests;
