//! The lease on a client's side: taken, kept, and given back.

use std::time::Duration;

use tactus_schema::{key::Command, pb};
use tokio::{sync::watch, task::JoinHandle, time::sleep};

use crate::{BusError, client::Caller};

/// Time between two renewals: a lease without one ends after 5 s.
const RENEWAL: Duration = Duration::from_millis(1_500);
/// Time limit for each answer about a lease.
const PATIENCE: Duration = Duration::from_secs(3);

/// Exit code of a client that does not hold the lease.
const EXIT_NOT_NOW: u32 = 5;

/// The answer to a client that asks for the lease.
#[derive(Debug)]
pub enum Hold {
    /// The client has it.
    Held(HeldLease),
    /// The service says why not, and who has it.
    Refused(Box<pb::CommandReply>),
}

/// The lease, renewed until it is released or dropped; a dropped one ends by itself after 5 s.
#[derive(Debug)]
#[must_use = "the lease ends with this"]
pub struct HeldLease {
    caller: Caller,
    who: String,
    lease: Vec<u8>,
    lost: watch::Receiver<Option<String>>,
    keeping: JoinHandle<()>,
}

impl HeldLease {
    /// Takes the lease; from whoever has it if there is a reason to take it over.
    pub(crate) async fn take(caller: Caller, who: &str, take_over: Option<&str>) -> Result<Hold, BusError> {
        let action = if take_over.is_some() { pb::LeaseAction::TakeOver } else { pb::LeaseAction::Acquire };
        let request = pb::LeaseRequest {
            action: action.into(),
            who: who.to_owned(),
            reason: take_over.unwrap_or_default().to_owned(),
            lease: Vec::new(),
        };
        let reply = caller.command(Command::Lease, &request, PATIENCE).await?;
        if !reply.ok {
            return Ok(Hold::Refused(Box::new(reply)));
        }
        let lease = reply.lease.unwrap_or_default().lease;
        let (to_lost, lost) = watch::channel(None);
        let renewal = pb::LeaseRequest {
            action: pb::LeaseAction::Renew.into(),
            who: who.to_owned(),
            reason: String::new(),
            lease: lease.clone(),
        };
        let keeping = tokio::spawn(keep(caller.clone(), renewal, to_lost));
        Ok(Hold::Held(Self { caller, who: who.to_owned(), lease, lost, keeping }))
    }

    /// The secret that goes with each command.
    pub fn secret(&self) -> Vec<u8> {
        self.lease.clone()
    }

    /// Waits until the service no longer accepts the lease, and returns why. Cancel-safe.
    pub async fn lost(&mut self) -> String {
        match self.lost.wait_for(Option::is_some).await {
            Ok(why) => why.clone().unwrap_or_default(),
            Err(_) => "the lease is no longer renewed".to_owned(),
        }
    }

    /// Gives the lease back, so that others need not wait until it ends.
    ///
    /// # Errors
    /// If the service does not answer; the lease then ends by itself.
    pub async fn release(self) -> Result<(), BusError> {
        self.keeping.abort();
        let request = pb::LeaseRequest {
            action: pb::LeaseAction::Release.into(),
            who: self.who.clone(),
            reason: String::new(),
            lease: self.lease.clone(),
        };
        self.caller.command(Command::Lease, &request, PATIENCE).await.map(drop)
    }
}

impl Drop for HeldLease {
    fn drop(&mut self) {
        self.keeping.abort();
    }
}

/// Renews until the service says that the lease is another's or none. All else is tried again: the service may be busy or
/// restarting.
async fn keep(caller: Caller, renewal: pb::LeaseRequest, lost: watch::Sender<Option<String>>) {
    loop {
        sleep(RENEWAL).await;
        match caller.command(Command::Lease, &renewal, PATIENCE).await {
            Ok(reply) if reply.ok => {}
            Ok(reply) if reply.exit_code == EXIT_NOT_NOW => {
                lost.send_replace(Some(reply.error));
                return;
            }
            Ok(reply) => tracing::debug!(error = reply.error, "the lease was not renewed"),
            Err(error) => tracing::debug!(%error, "the lease was not renewed"),
        }
    }
}
