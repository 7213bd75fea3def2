//! The connection to the service.

use std::time::Duration;

use anyhow::{Context, bail};
use tactus_bus::{BusError, Client, Endpoint, HeldLease, Hold};
use tactus_schema::key::Command;
use tactus_schema::{Message, pb};
use tokio::runtime::Runtime;

use crate::cli::{Common, LeaseArgs};
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

/// The endpoint of the command line.
///
/// # Errors
/// If it is none.
pub(crate) fn endpoint(common: &Common) -> anyhow::Result<Endpoint> {
    Ok(common.endpoint.parse().map_err(|error: BusError| Failure::new(Exit::Usage, error))?)
}

/// Who sends commands, for the service's log and the run's events.
pub(crate) fn who() -> String {
    std::env::var("USER").map_or_else(|_| "cli".to_owned(), |user| format!("cli:{user}"))
}

/// Takes the lease, which is kept while the returned value is.
///
/// # Errors
/// If another client holds it.
pub(crate) async fn hold(client: &Client, args: &LeaseArgs) -> anyhow::Result<HeldLease> {
    match client.hold(&who(), args.take_over.as_deref()).await? {
        Hold::Held(held) => Ok(held),
        Hold::Refused(reply) => {
            let exit = Exit::of_reply(reply.exit_code);
            let hint = if exit == Exit::NotNow { " (--take-over REASON)" } else { "" };
            Err(Failure::new(exit, format!("{}{hint}", reply.error)).into())
        }
    }
}

/// Gives the lease back. If the service does not answer, it ends by itself.
pub(crate) async fn release(held: HeldLease) {
    if let Err(error) = held.release().await {
        tracing::debug!(%error, "the lease was not given back");
    }
}

/// The service, or `None` if nothing listens at the default endpoint.
///
/// # Errors
/// If nothing listens at an endpoint that was given, or a rig was named: who names either does not mean the embedded rig.
pub(crate) async fn find(common: &Common) -> anyhow::Result<Option<Client>> {
    match look(common).await? {
        None if common.is_endpoint_given => bail!(
            "no service at {}: start `tactusd --config FILE`, correct the address (--endpoint or TACTUS_ENDPOINT), or use \
             the embedded simulated rig with --embedded",
            common.endpoint
        ),
        None => {
            if let Some(rig) = &common.rig {
                bail!(
                    "no rig {rig:?}: no service at {}. Start `tactusd --config FILE`, leave out --rig (TACTUS_RIG) to use the embedded \
                     simulated rig, or name a rig's file with --rig-file",
                    common.endpoint
                );
            }
            Ok(None)
        }
        found => Ok(found),
    }
}

/// The service, or `None` if nothing listens at the endpoint.
pub(crate) async fn look(common: &Common) -> anyhow::Result<Option<Client>> {
    found(connect(common).await?)
}

async fn connect(common: &Common) -> anyhow::Result<Result<Client, BusError>> {
    let endpoint = endpoint(common)?;
    Ok(Client::connect_as(&endpoint, common.rig.as_deref(), &common.credentials()).await)
}

/// What was found, with errors that say what to do.
fn found(connected: Result<Client, BusError>) -> anyhow::Result<Option<Client>> {
    match connected {
        Ok(client) => Ok(Some(client)),
        Err(BusError::NoService { .. }) => Ok(None),
        Err(BusError::SeveralRigs { endpoint, rigs }) => {
            Err(Failure::new(Exit::Usage, choose(&endpoint, &rigs)).into())
        }
        Err(error @ (BusError::RigName { .. } | BusError::UnknownRig { .. })) => {
            Err(Failure::new(Exit::Usage, error).into())
        }
        Err(error) => Err(error.into()),
    }
}

/// What to do when there are several rigs: this command again, with the name of one.
fn choose(endpoint: &str, rigs: &[String]) -> String {
    let command: Vec<_> = std::env::args().skip(1).collect();
    let one = rigs.first().map(String::as_str).unwrap_or_default();
    format!(
        "several rigs are served at {endpoint}: {}; name one: `tactus {} --rig {one}`",
        rigs.join(", "),
        command.join(" ")
    )
}

/// Connects to the service at the endpoint.
///
/// # Errors
/// If nothing listens at the endpoint.
pub(crate) async fn require(common: &Common) -> anyhow::Result<Client> {
    required(common, look(common).await?)
}

/// As [`require`], or `None` if the service has several rigs and none is named.
pub(crate) async fn require_one_or_all(common: &Common) -> anyhow::Result<Option<Client>> {
    match connect(common).await? {
        Err(BusError::SeveralRigs { .. }) => Ok(None),
        connected => required(common, found(connected)?).map(Some),
    }
}

fn required(common: &Common, found: Option<Client>) -> anyhow::Result<Client> {
    found.with_context(|| {
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
