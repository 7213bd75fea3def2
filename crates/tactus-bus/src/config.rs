//! Whom the service listens to, and zenoh's settings for both sides.

use serde_json::{Value, json};
use zenoh::Config;

use crate::{BusError, Endpoint};

/// Whom the service listens to and joins. Default: this machine only, nobody joined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusConfig {
    /// Where it accepts clients; empty means nowhere.
    pub listen: Vec<Endpoint>,
    /// Other zenoh routers or peers to join; looked for again and again until they are there.
    pub connect: Vec<Endpoint>,
}

impl Default for BusConfig {
    fn default() -> Self {
        Self { listen: vec![Endpoint::loopback()], connect: Vec::new() }
    }
}

impl BusConfig {
    /// True if only this machine can reach the service and it joins nobody elsewhere.
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
            // Room for 1 MiB each, where zenoh has 128 KiB: a burst of events, or a usual history, waits for
            // no client.
            ("transport/link/tx/queue/size/interactive_low", json!(16)),
            ("transport/link/tx/queue/size/data_high", json!(16)),
            ("transport/link/tx/queue/size/data", json!(16)),
            // A client whose link has been full for this long (microseconds) when it is to get an answer is
            // disconnected. Until then it keeps a thread waiting, and in the end, for as long again, zenoh's
            // one sending thread, hence everybody. Zenoh's default is 5 s.
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
        // One try at start; a connection lost later is taken up again for as long as the client lives.
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
    // Nobody is looked for and nobody is told where we are.
    config.insert_json5("scouting/multicast/enabled", "false")?;
    config.insert_json5("scouting/gossip/enabled", "false")?;
    for (name, value) in settings {
        config.insert_json5(name, &value.to_string())?;
    }
    Ok(config)
}
