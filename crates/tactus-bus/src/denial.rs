//! The check at start that what should be denied is denied: a client that may not command tries, on the real endpoints, before the
//! service takes any command.
//!
//! The command is a `cmd/pause` that no service has to carry out: it stays in the queue of calls, where the check looks for it.

use std::time::Duration;

use prost::Message as _;
use tactus_schema::{
    Message,
    key::{Command, Keys},
    pb,
};
use zenoh::{Config, Session, query::ConsolidationMode};

use crate::{
    BusConfig, BusError, Credentials, Endpoint, TlsConfig, config, error::of_zenoh, topic::encoding,
};

/// Time for a denied command to get through after all.
const PATIENCE: Duration = Duration::from_millis(500);
/// Who tries.
pub(crate) const WHO: &str = "self-check";

/// Tries to command without a certificate at each `tls/` endpoint, and with that of a reader if the configuration names one.
///
/// # Errors
/// [`BusError::NotDenied`] if an attempt is answered; [`BusError::Session`] if the reader cannot even connect, as then nothing is
/// shown about it.
pub(crate) async fn check(config: &BusConfig, keys: &Keys) -> Result<(), BusError> {
    let Some(tls) = &config.tls else { return Ok(()) };
    for endpoint in config.listen.iter().filter(|endpoint| endpoint.is_tls()) {
        let near = near(endpoint);
        let stranger = Credentials { authority: Some(tls.authority.clone()), ..Credentials::default() };
        // Most likely it cannot connect, which denies it everything.
        if let Ok(session) = zenoh::open(unverified(&near, &stranger)?).await {
            denied(&session, keys, endpoint, "without a certificate").await?;
        }
        if let Some(reader) = reader(tls) {
            let source = |source| BusError::Session { endpoint: near.to_string(), source: of_zenoh(&source) };
            let session = zenoh::open(unverified(&near, &reader)?).await.map_err(source)?;
            denied(&session, keys, endpoint, "with the certificate of a reader").await?;
        }
    }
    Ok(())
}

/// Fails if the session can command.
async fn denied(session: &Session, keys: &Keys, endpoint: &Endpoint, who: &str) -> Result<(), BusError> {
    let key = keys.command(Command::Pause);
    let request = pb::CommandRequest { who: WHO.to_owned(), ..Default::default() };
    let replies = session
        .get(&key)
        .payload(request.encode_to_vec())
        .encoding(encoding(pb::CommandRequest::NAME))
        .consolidation(ConsolidationMode::None)
        .timeout(PATIENCE)
        .await
        .map_err(BusError::key(&key))?;
    while let Ok(reply) = replies.recv_async().await {
        if reply.result().is_ok() {
            return Err(BusError::NotDenied { endpoint: endpoint.to_string(), who: who.to_owned() });
        }
    }
    session.close().await.map_err(|source| BusError::Close { source: of_zenoh(&source) })
}

/// The endpoint as this machine reaches it.
fn near(endpoint: &Endpoint) -> Endpoint {
    let text = endpoint.to_string().replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:");
    text.parse().unwrap_or_else(|_| endpoint.clone())
}

/// A client's settings. The service's own name need not stand in its certificate for this machine's address.
fn unverified(endpoint: &Endpoint, credentials: &Credentials) -> Result<Config, BusError> {
    let mut config = config::client(endpoint, credentials)?;
    config
        .insert_json5("transport/link/tls/verify_name_on_connect", "false")
        .map_err(|source| BusError::Session { endpoint: endpoint.to_string(), source: of_zenoh(&source) })?;
    Ok(config)
}

fn reader(tls: &TlsConfig) -> Option<Credentials> {
    let (certificate, key) = tls.check.clone()?;
    Some(Credentials {
        authority: Some(tls.authority.clone()),
        certificate: Some(certificate),
        key: Some(key),
    })
}
