//! Endpoints of the bus, and zenoh's settings for service and client.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use tactus_schema::key::Keys;
use zenoh::Config;

use crate::{BusError, Endpoint, access, error::of_zenoh, outlet::MANY, topic::FRAMES_KEPT_MAX};

/// Longest message that a service takes, in bytes. Zenoh collects a message of many parts in memory up to this size.
const SERVICE_MESSAGE_BYTES_MAX: usize = 2 << 20;
/// Longest message that a client takes, in bytes.
const CLIENT_MESSAGE_BYTES_MAX: usize = 16 << 20;
/// Connections that a service keeps open; further ones are refused. A stop needs none.
const SESSIONS_MAX: usize = 128;
/// Connections that have not introduced themselves; further ones are closed at once.
const PENDING_MAX: usize = 128;
/// Time for a connection to introduce itself, in milliseconds. Zenoh's default is 10 s.
const PENDING_MS: u64 = 2_000;

/// Endpoints of the service. Default: listens on loopback, connects to nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusConfig {
    /// Endpoints that accept clients; may be empty.
    pub listen: Vec<Endpoint>,
    /// Zenoh routers or peers to connect to; tried again until they answer.
    pub connect: Vec<Endpoint>,
    /// Names of rigs whose services may connect to this one and publish through it. Nobody else can publish, answer or
    /// announce anything here.
    pub guests: Vec<String>,
    /// Frames that are kept of each rig for clients that join late or were cut off: 1 to 16,000, each some 250 bytes of memory with 48
    /// elements. Default: 1,800, a minute at 30 Hz; 76,800 of all rigs together, if there are more than 42 of them.
    pub frames_kept: Option<usize>,
    /// Certificates for endpoints beyond this machine.
    pub tls: Option<TlsConfig>,
}

/// Certificates, as PEM files, and who may do what. Common names are those of client certificates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsConfig {
    /// Authority that signs the certificates of service and clients.
    pub authority: PathBuf,
    /// The service's certificate.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
    /// Common names that may command.
    pub commanders: Vec<String>,
    /// Common names that may only read and stop.
    pub readers: Vec<String>,
    /// Certificate and key of a reader, with which the service checks at its start that a reader cannot command.
    pub check: Option<(PathBuf, PathBuf)>,
}

/// A client's own certificate, for `tls/` endpoints.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Credentials {
    /// Authority that signed the service's certificate.
    pub authority: Option<PathBuf>,
    /// The client's certificate.
    pub certificate: Option<PathBuf>,
    /// Its private key.
    pub key: Option<PathBuf>,
}

impl Credentials {
    /// The files `authority.pem`, `client.pem` and `client.key` of a folder.
    pub fn in_folder(folder: &Path) -> Self {
        let file = |name| Some(folder.join(name));
        Self { authority: file("authority.pem"), certificate: file("client.pem"), key: file("client.key") }
    }
}

impl Default for BusConfig {
    fn default() -> Self {
        Self {
            listen: vec![Endpoint::loopback()],
            connect: Vec::new(),
            guests: Vec::new(),
            frames_kept: None,
            tls: None,
        }
    }
}

impl BusConfig {
    /// True if all endpoints are on this machine.
    pub fn is_loopback(&self) -> bool {
        self.listen.iter().chain(&self.connect).all(Endpoint::is_loopback)
    }

    /// Refuses to be reachable from other machines without certificates, and numbers that cannot be.
    pub(crate) fn check(&self) -> Result<(), BusError> {
        if let Some(frames) = self.frames_kept.filter(|frames| !(1..=FRAMES_KEPT_MAX).contains(frames)) {
            return Err(BusError::FramesKept { frames, frames_max: FRAMES_KEPT_MAX });
        }
        for endpoint in self.listen.iter().chain(&self.connect) {
            if endpoint.is_tls() && self.tls.is_none() {
                return Err(BusError::Unprotected {
                    endpoint: endpoint.to_string(),
                    reason: "tls/ needs the certificates of [bus.tls]",
                });
            }
            if endpoint.is_tls() && !cfg!(feature = "tls") {
                return Err(BusError::Unprotected {
                    endpoint: endpoint.to_string(),
                    reason: "this program was built without the feature `tls`",
                });
            }
        }
        for endpoint in &self.listen {
            if !endpoint.is_loopback() && !endpoint.is_tls() {
                return Err(BusError::Unprotected {
                    endpoint: endpoint.to_string(),
                    reason: "whoever reaches it could command the rig; listen on tls/HOST:PORT instead",
                });
            }
        }
        Ok(())
    }

    /// True if a service of these rigs and its guests gathers frames, and lets zenoh wait for room in a full link before it drops one.
    pub(crate) fn gathers(&self, rigs: &[Keys]) -> bool {
        rigs.len() + self.guests.len() >= MANY
    }

    /// Zenoh's settings for the service of these rigs.
    pub(crate) fn service(&self, rigs: &[Keys]) -> Result<Config, BusError> {
        let listen = texts(&self.listen);
        let mut settings = vec![
            ("mode", json!("peer")),
            ("listen/endpoints", json!(listen)),
            ("connect/endpoints", json!(texts(&self.connect))),
            ("access_control", access::rules(self, rigs)),
            ("transport/unicast/max_sessions", json!(SESSIONS_MAX)),
            ("transport/unicast/accept_pending", json!(PENDING_MAX)),
            ("transport/unicast/accept_timeout", json!(PENDING_MS)),
            ("transport/link/rx/max_message_size", json!(SERVICE_MESSAGE_BYTES_MAX)),
            // 1 MiB each instead of zenoh's 128 KiB: a burst of events, or a usual history, then fits without waiting.
            ("transport/link/tx/queue/size/interactive_low", json!(16)),
            ("transport/link/tx/queue/size/data_high", json!(16)),
            ("transport/link/tx/queue/size/data", json!(16)),
            // In microseconds: a client whose link stays full for this time while a reply waits is disconnected. Until then it
            // blocks a thread and finally, for the same time, zenoh's only sending thread and so all clients. Zenoh's
            // default is 5 s.
            ("transport/link/tx/queue/congestion_control/block/wait_before_close", json!(100_000)),
        ];
        if !self.gathers(rigs) {
            // Zenoh's default is 1 ms, and 50 ms more for a message of many parts.
            settings.extend([
                ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", json!(0)),
                ("transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments", json!(0)),
            ]);
        }
        if let Some(tls) = &self.tls {
            settings.extend([
                ("transport/link/tls/root_ca_certificate", json!(tls.authority)),
                ("transport/link/tls/listen_certificate", json!(tls.certificate)),
                ("transport/link/tls/listen_private_key", json!(tls.key)),
                // At a router it shows the same.
                ("transport/link/tls/connect_certificate", json!(tls.certificate)),
                ("transport/link/tls/connect_private_key", json!(tls.key)),
                ("transport/link/tls/enable_mtls", json!(true)),
                ("transport/link/tls/close_link_on_expiration", json!(true)),
            ]);
        }
        zenoh_config(&settings)
            .map_err(|source| BusError::Open { listen: listen.join(", "), source: of_zenoh(&source) })
    }
}

/// Zenoh's settings for a client of the service at `endpoint`.
pub(crate) fn client(endpoint: &Endpoint, credentials: &Credentials) -> Result<Config, BusError> {
    let mut settings = vec![
        ("mode", json!("client")),
        ("connect/endpoints", json!([endpoint.to_string()])),
        // One attempt at start; a connection lost later is restored while the client exists.
        ("connect/timeout_ms", json!(0)),
        ("transport/unicast/open_timeout", json!(3_000)),
        ("transport/link/rx/max_message_size", json!(CLIENT_MESSAGE_BYTES_MAX)),
    ];
    for (name, file) in [
        ("transport/link/tls/root_ca_certificate", &credentials.authority),
        ("transport/link/tls/connect_certificate", &credentials.certificate),
        ("transport/link/tls/connect_private_key", &credentials.key),
    ] {
        if let Some(file) = file {
            settings.push((name, json!(file)));
        }
    }
    if credentials.certificate.is_some() {
        settings.push(("transport/link/tls/enable_mtls", json!(true)));
    }
    zenoh_config(&settings)
        .map_err(|source| BusError::Session { endpoint: endpoint.to_string(), source: of_zenoh(&source) })
}

fn texts(endpoints: &[Endpoint]) -> Vec<String> {
    endpoints.iter().map(Endpoint::to_string).collect()
}

fn zenoh_config(settings: &[(&str, Value)]) -> Result<Config, zenoh::Error> {
    let mut config = Config::default();
    // No discovery of or by others.
    config.insert_json5("scouting/multicast/enabled", "false")?;
    config.insert_json5("scouting/gossip/enabled", "false")?;
    for (name, value) in settings {
        config.insert_json5(name, &value.to_string())?;
    }
    Ok(config)
}
