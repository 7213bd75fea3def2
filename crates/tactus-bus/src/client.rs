//! The bus on a client's side.

use std::{io, time::Duration};

use tactus_schema::{
    Message,
    key::{Command, Keys},
    pb,
};
use tokio::{net::TcpStream, time::timeout};
use zenoh::{
    Session,
    qos::{CongestionControl, Priority},
    query::ConsolidationMode,
};

use crate::{
    Alive, BusError, Endpoint, History, Published, Subscription, config, liveness::Roster, topic::encoding,
};

/// Time limit for a machine that does not answer.
const REACH_TIMEOUT: Duration = Duration::from_secs(2);

/// A client of one rig's service.
#[derive(Debug)]
pub struct Client {
    session: Session,
    endpoint: Endpoint,
    keys: Keys,
    roster: Roster,
}

impl Client {
    /// Connects to the service at an endpoint; fails at once if nothing listens there. Without a rig's name it connects to
    /// the only rig that is ready.
    ///
    /// # Errors
    /// [`BusError::NoService`], [`BusError::Session`]; [`BusError::RigName`] for an invalid name;
    /// without a name also [`BusError::NoRig`] and [`BusError::SeveralRigs`].
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn connect(endpoint: &Endpoint, rig: Option<&str>) -> Result<Self, BusError> {
        if let Some(rig) = rig {
            check_rig_name(rig)?;
        }
        reach(endpoint)
            .await
            .map_err(|source| BusError::NoService { endpoint: endpoint.to_string(), source })?;
        let session = zenoh::open(config::client(endpoint)?)
            .await
            .map_err(|source| BusError::Session { endpoint: endpoint.to_string(), source })?;
        let roster = Roster::keep(&session).await?;
        let rig = match rig {
            Some(rig) => rig.to_owned(),
            None => the_only_rig(roster.rigs(), endpoint)?,
        };
        Ok(Self { session, endpoint: endpoint.clone(), keys: Keys::new(rig), roster })
    }

    /// Name of the rig that this client commands.
    pub fn rig(&self) -> &str {
        self.keys.rig()
    }

    /// Endpoint of its service.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// Names of all rigs that are ready at this endpoint now, sorted.
    pub fn rigs(&self) -> Vec<String> {
        self.roster.rigs()
    }

    /// Follows whether the service is ready.
    pub fn alive(&self) -> Alive {
        self.roster.alive(self.rig())
    }

    /// Sends a command and waits for the reply. The request is a [`pb::RunRequest`] for [`Command::Run`] and a
    /// [`pb::CommandRequest`] for all others. A stop has the highest priority. A refusal is a reply, not an error: see
    /// [`pb::CommandReply::ok`].
    ///
    /// # Errors
    /// [`BusError::NoAnswer`] if there is no reply in time or the service ended;
    /// [`BusError::Answer`] if the reply cannot be decoded; [`BusError::Key`] if the session is closed.
    pub async fn command<M: Message>(
        &self,
        command: Command,
        request: &M,
        patience: Duration,
    ) -> Result<pb::CommandReply, BusError> {
        let key = self.keys.command(command);
        let priority = if command == Command::Stop { Priority::RealTime } else { Priority::InteractiveHigh };
        let replies = self
            .session
            .get(&key)
            .payload(request.encode_to_vec())
            .encoding(encoding(M::NAME))
            .consolidation(ConsolidationMode::None)
            .congestion_control(CongestionControl::Block)
            .priority(priority)
            .express(true)
            .timeout(patience)
            .await
            .map_err(BusError::key(&key))?;
        while let Ok(reply) = replies.recv_async().await {
            // Errors come from zenoh: a timeout, or a service that ended.
            if let Ok(sample) = reply.result() {
                return <pb::CommandReply as prost::Message>::decode(&*sample.payload().to_bytes())
                    .map_err(|source| BusError::Answer { key, source });
            }
        }
        Err(BusError::NoAnswer { key, waited: patience })
    }

    /// Subscribes to a message's topic.
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn subscribe<M: Published>(&self, history: History) -> Result<Subscription<M>, BusError> {
        Subscription::declare(&self.session, &self.keys, history).await
    }

    /// Closes the connection; subscriptions end.
    ///
    /// # Errors
    /// [`BusError::Close`] if zenoh could not close the session cleanly.
    pub async fn close(self) -> Result<(), BusError> {
        self.session.close().await.map_err(|source| BusError::Close { source })
    }
}

/// Refuses names with wildcards, which would command every rig on the bus.
fn check_rig_name(rig: &str) -> Result<(), BusError> {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if rig.is_empty() || !rig.chars().all(fits) {
        return Err(BusError::RigName { rig: rig.to_owned() });
    }
    Ok(())
}

/// Checks with a plain connection whether anything listens; zenoh would need seconds.
async fn reach(endpoint: &Endpoint) -> io::Result<()> {
    match timeout(REACH_TIMEOUT, TcpStream::connect(endpoint.address())).await {
        Ok(connected) => connected.map(drop),
        Err(_) => Err(io::Error::new(io::ErrorKind::TimedOut, "the machine does not answer")),
    }
}

fn the_only_rig(mut rigs: Vec<String>, endpoint: &Endpoint) -> Result<String, BusError> {
    match (rigs.pop(), rigs.is_empty()) {
        (Some(rig), true) => Ok(rig),
        (Some(rig), false) => {
            rigs.push(rig);
            Err(BusError::SeveralRigs { endpoint: endpoint.to_string(), rigs })
        }
        (None, _) => Err(BusError::NoRig { endpoint: endpoint.to_string() }),
    }
}
