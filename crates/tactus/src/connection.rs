//! The connection to the service.

use std::time::Duration;

use anyhow::Context;
use tactus_bus::{BusError, Client, Endpoint};
use tactus_schema::key::Command;
use tactus_schema::{Message, pb};
use tokio::runtime::Runtime;

use crate::cli::Common;
use crate::exit::{Exit, Failure};

/// How long to wait for an answer to any command but `run` and `reset`.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// A runtime for the bus, which needs threads.
pub(crate) fn runtime() -> anyhow::Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start the async runtime")
}

/// The service, or `None` if nothing listens at the endpoint.
pub(crate) async fn find(common: &Common) -> anyhow::Result<Option<Client>> {
    let endpoint: Endpoint =
        common.endpoint.parse().map_err(|error: BusError| Failure::new(Exit::Usage, error))?;
    match Client::connect(&endpoint, common.rig.as_deref()).await {
        Ok(client) => Ok(Some(client)),
        Err(BusError::NoService { .. }) => Ok(None),
        Err(error @ BusError::RigName { .. }) => Err(Failure::new(Exit::Usage, error).into()),
        Err(error) => Err(error.into()),
    }
}

/// Connects to the service at the endpoint.
///
/// # Errors
/// If nothing listens at the endpoint.
pub(crate) async fn require(common: &Common) -> anyhow::Result<Client> {
    find(common).await?.with_context(|| {
        format!(
            "no service at {}: start `tactusd --config FILE`, or give its address with --endpoint",
            common.endpoint
        )
    })
}

/// Sends a command to the service. A refusal is an error with the service's own exit code.
pub(crate) async fn ask<M: Message>(
    client: &Client,
    command: Command,
    request: &M,
    patience: Duration,
) -> anyhow::Result<pb::CommandReply> {
    let reply = client.command(command, request, patience).await?;
    if reply.ok { Ok(reply) } else { Err(Failure::new(Exit::of_reply(reply.exit_code), &reply.error).into()) }
}
