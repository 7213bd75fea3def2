//! Endpoints of the bus, and zenoh's settings for service and client.

use serde_json::{Value, json};
use zenoh::Config;

use crate::{BusError, Endpoint};

/// Endpoints of the service. Default: listens on loopback, connects to nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusConfig {
    /// Endpoints that accept clients; may be empty.
    pub listen: Vec<Endpoint>,
    /// Zenoh routers or peers to connect to; tried again until they answer.
    pub connect: Vec<Endpoint>,
}

impl Default for BusConfig {
    fn default() -> Self {
        Self { listen: vec![Endpoint::loopback()], connect: Vec::new() }
    }
}

impl BusConfig {
    /// True if all endpoints are on this machine.
    pub fn is_loopback(&self) -> bool {
        self.listen.iter().chain(&self.connect).all(Endpoint::is_loopback)
    }

    /// Zenoh's settings for the service.
    pub(crate) fn service(&self) -> Result<Config, BusError> {
        let listen = texts(&self.listen);
        zenoh_config(&[
            ("mode", json!("peer")),
            ("listen/endpoints", json!(listen)),
            ("connect/endpoints", json!(texts(&self.connect))),
            // 1 MiB each instead of zenoh's 128 KiB: a burst of events, or a usual history, then fits without waiting.
            ("transport/link/tx/queue/size/interactive_low", json!(16)),
            ("transport/link/tx/queue/size/data_high", json!(16)),
            ("transport/link/tx/queue/size/data", json!(16)),
            // In microseconds: a client whose link stays full for so long while a reply waits is disconnected. Until then it
            // blocks a thread and finally, for the same time, zenoh's only sending thread and so all clients. Zenoh's
            // default is 5 s.
            ("transport/link/tx/queue/congestion_control/block/wait_before_close", json!(100_000)),
        ])
        .map_err(|source| BusError::Open { listen: listen.join(", "), source })
    }
}

/// Zenoh's settings for a client of the service at `endpoint`.
pub(crate) fn client(endpoint: &Endpoint) -> Result<Config, BusError> {
    zenoh_config(&[
        ("mode", json!("client")),
        ("connect/endpoints", json!([endpoint.to_string()])),
        // One attempt at start; a connection lost later is restored while the client exists.
        ("connect/timeout_ms", json!(0)),
        ("transport/unicast/open_timeout", json!(3_000)),
    ])
    .map_err(|source| BusError::Session { endpoint: endpoint.to_string(), source })
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
