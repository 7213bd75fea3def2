//! The bus on a client's side.

use std::{collections::BTreeMap, error::Error, io, sync::Arc, time::Duration};

use tactus_schema::{
    Message,
    key::{Command, Keys, STOP_EVERY_RIG},
    pb,
};
use tokio::{
    net::{TcpStream, UnixStream},
    sync::{Semaphore, watch},
    task::JoinSet,
    time::{Instant, sleep, timeout, timeout_at},
};
use zenoh::{
    Session, Wait,
    handlers::FifoChannelHandler,
    qos::{CongestionControl, Priority},
    query::{ConsolidationMode, QueryTarget, Reply},
    sample::Sample,
    session::ZenohId,
};

use crate::{
    Alive, BusError, Credentials, Endpoint, Gap, HeldLease, History, Hold, Listener, Published, Subscription,
    config,
    error::of_zenoh,
    liveness::{Known, Roster, Trust},
    topic::encoding,
};

/// Time limit for a machine that does not answer.
const REACH_TIMEOUT: Duration = Duration::from_secs(2);
/// Rigs that are asked at the same time.
const ASKED_AT_ONCE: usize = 64;
/// Time that the other services on the bus have to answer a stop after the one at the endpoint did.
const OTHERS_PATIENCE: Duration = Duration::from_secs(1);
/// An answer that is under way when its service ends may come this much later than the news of the end.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// A client of one rig's service.
#[derive(Debug)]
pub struct Client {
    caller: Caller,
    endpoint: Endpoint,
    roster: Arc<Roster>,
}

/// All rigs that an endpoint reaches, over one connection: those of one service or, behind a router, of all hosts.
#[derive(Debug)]
pub struct Lab {
    session: Session,
    endpoint: Endpoint,
    roster: Arc<Roster>,
    changes: watch::Receiver<Known>,
}

/// What it takes to send commands.
#[derive(Debug, Clone)]
pub(crate) struct Caller {
    session: Session,
    keys: Keys,
    trust: Trust,
}

impl Client {
    /// Connects to the service at an endpoint; fails at once if nothing listens there. Without a rig's name it connects to
    /// the only rig of the service that listens there or, if that is a router, to the only rig that is ready.
    ///
    /// # Errors
    /// [`BusError::NoService`], [`BusError::NotAllowed`], [`BusError::Session`]; [`BusError::RigName`] for an invalid name;
    /// [`BusError::UnknownRig`] if only other rigs are served; without a name also [`BusError::NoRig`] and [`BusError::SeveralRigs`]; behind a router
    /// [`BusError::SeveralServices`].
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn connect(endpoint: &Endpoint, rig: Option<&str>) -> Result<Self, BusError> {
        Self::connect_as(endpoint, rig, &Credentials::default()).await
    }

    /// As [`Client::connect`], with a certificate for `tls/` endpoints.
    ///
    /// # Errors
    /// As [`Client::connect`].
    ///
    /// # Panics
    /// As [`Client::connect`].
    pub async fn connect_as(
        endpoint: &Endpoint,
        rig: Option<&str>,
        credentials: &Credentials,
    ) -> Result<Self, BusError> {
        if let Some(rig) = rig {
            check_rig_name(rig)?;
        }
        let lab = Lab::connect(endpoint, credentials).await?;
        let rig = match rig {
            Some(rig) => the_named_rig(rig, &lab.roster, endpoint)?,
            None => the_rig_of(&lab.neighbours().await, &lab.roster, endpoint)?,
        };
        lab.client(&rig).await
    }

    /// Name of the rig that this client commands.
    pub fn rig(&self) -> &str {
        self.caller.keys.rig()
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

    /// Sends a command and waits for the reply. The request is that of [`Command`]. A refusal is a reply, not an error: see
    /// [`pb::CommandReply::ok`]. Answers of others than the rig's service are ignored.
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
        self.caller.command(command, request, patience).await
    }

    /// Stops the rig, by datagram and on the bus at once; returns the first answer.
    ///
    /// # Errors
    /// As [`Client::command`].
    pub async fn stop(
        &self,
        request: &pb::CommandRequest,
        patience: Duration,
    ) -> Result<pb::CommandReply, BusError> {
        let on_bus = self.command(Command::Stop, request, patience);
        let datagram = stop_by_datagram(&self.endpoint, Some(self.rig()), request, patience);
        tokio::pin!(on_bus, datagram);
        tokio::select! {
            answer = &mut datagram => match answer {
                Ok(Some(reply)) => Ok(reply),
                Ok(None) | Err(_) => on_bus.await,
            },
            answer = &mut on_bus => match answer {
                Ok(reply) => Ok(reply),
                Err(error) => match datagram.await {
                    Ok(Some(reply)) => Ok(reply),
                    Ok(None) | Err(_) => Err(error),
                },
            },
        }
    }

    /// Takes the lease that run, pause, resume and reset want, and keeps it. With a reason it is taken from whoever has it.
    ///
    /// # Errors
    /// As [`Client::command`].
    pub async fn hold(&self, who: &str, take_over: Option<&str>) -> Result<Hold, BusError> {
        HeldLease::take(self.caller.clone(), who, take_over).await
    }

    /// Subscribes to a message's topic. Messages of others than the rig's service are dropped and counted: see
    /// [`crate::Losses::foreign`].
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn subscribe<M: Published>(&self, history: History) -> Result<Subscription<M>, BusError> {
        let Caller { session, keys, trust } = &self.caller;
        Subscription::declare(session, keys, history, trust.clone()).await
    }

    /// Gives each message of a topic to `hear` in the thread that received it, from now on, until the listener is dropped. No queue and no
    /// other thread is between; in return nothing else of this connection arrives before `hear` returns, so that it must not wait. What was
    /// missed is not fetched: a frame's own sequence number shows it. Messages of others than the rig's service are dropped and counted.
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn listen<M: Published>(
        &self,
        hear: impl Fn(M) + Send + Sync + 'static,
    ) -> Result<Listener, BusError> {
        let Caller { session, keys, trust } = &self.caller;
        Listener::declare(session, keys, trust.clone(), hear).await
    }

    /// Asks once more for messages that a subscription misses: [`Subscription::gap`]. Gives those that their publisher still keeps, in
    /// order; `None` if it does not answer, such as while the connection is cut.
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn ask_again<M: Published>(
        &self,
        gap: &Gap,
        patience: Duration,
    ) -> Result<Option<Vec<M>>, BusError> {
        gap.ask(&self.caller.session, &self.caller.keys, patience).await
    }

    /// Closes the connection, also for the other clients of a [`Lab`]; subscriptions end.
    ///
    /// # Errors
    /// [`BusError::Close`] if zenoh could not close the session cleanly.
    pub async fn close(self) -> Result<(), BusError> {
        self.caller.session.close().await.map_err(|source| BusError::Close { source: of_zenoh(&source) })
    }
}

impl Caller {
    /// As [`Client::command`].
    pub(crate) async fn command<M: Message>(
        &self,
        command: Command,
        request: &M,
        patience: Duration,
    ) -> Result<pb::CommandReply, BusError> {
        let key = self.keys.command(command);
        let ended = self.trust.ended();
        let replies = ask(&self.session, &key, command, request, patience).await?;
        let answer = async {
            while let Ok(reply) = replies.recv_async().await {
                // Errors come from zenoh: a timeout, or a service that ended.
                let (Ok(sample), Some(replier)) = (reply.result(), reply.replier_id()) else { continue };
                if self.trust.has(&replier.zid()) == Some(true) {
                    return Some(decode(&key, sample));
                }
                tracing::warn!(key, replier = %replier.zid(), "an answer that is not the service's is ignored");
            }
            None
        };
        // Zenoh ends the query of a service that is gone, but does not promise it.
        let gone = async {
            ended.await;
            sleep(LAST_WORDS).await;
        };
        let reply = tokio::select! {
            reply = answer => reply,
            () = gone => None,
        };
        reply.unwrap_or(Err(BusError::NoAnswer { key, waited: patience }))
    }
}

impl Lab {
    /// Connects to the service or the router at an endpoint; fails at once if nothing listens there.
    ///
    /// # Errors
    /// [`BusError::NoService`], [`BusError::NotAllowed`], [`BusError::Session`].
    ///
    /// # Panics
    /// As [`Client::connect`].
    pub async fn connect(endpoint: &Endpoint, credentials: &Credentials) -> Result<Self, BusError> {
        reach(endpoint).await?;
        let session = open(endpoint, credentials).await?;
        let roster = Arc::new(Roster::keep(&session).await?);
        let changes = roster.changes();
        Ok(Self { session, endpoint: endpoint.clone(), roster, changes })
    }

    /// Names of the rigs whose services run now, ready or not, sorted.
    pub fn rigs(&self) -> Vec<String> {
        self.roster.served()
    }

    /// Waits until a service comes, becomes ready or goes; `None` once the connection is closed. Cancel-safe.
    pub async fn changed(&mut self) -> Option<()> {
        self.changes.changed().await.ok()
    }

    /// A client of one of the rigs, which shares the connection.
    ///
    /// # Errors
    /// [`BusError::RigName`] for an invalid name; [`BusError::SeveralServices`] if more than one says that it is the rig's.
    pub async fn client(&self, rig: &str) -> Result<Client, BusError> {
        check_rig_name(rig)?;
        if self.roster.is_ambiguous(rig, &self.neighbours().await) {
            let (endpoint, rig) = (self.endpoint.to_string(), rig.to_owned());
            return Err(BusError::SeveralServices { endpoint, rig });
        }
        let (session, trust) = (self.session.clone(), self.roster.trust(rig));
        let caller = Caller { session, trust, keys: Keys::new(rig) };
        Ok(Client { caller, endpoint: self.endpoint.clone(), roster: Arc::clone(&self.roster) })
    }

    /// Closes the connection; subscriptions end.
    ///
    /// # Errors
    /// [`BusError::Close`] if zenoh could not close the session cleanly.
    pub async fn close(self) -> Result<(), BusError> {
        self.session.close().await.map_err(|source| BusError::Close { source: of_zenoh(&source) })
    }

    /// The services at the other end of the connection.
    async fn neighbours(&self) -> Vec<ZenohId> {
        self.session.info().peers_zid().await.collect()
    }
}

/// Names of all rigs whose services run at an endpoint, ready or not, sorted.
///
/// # Errors
/// [`BusError::NoService`], [`BusError::NotAllowed`], [`BusError::Session`].
///
/// # Panics
/// As [`Client::connect`].
pub async fn rigs_at(endpoint: &Endpoint, credentials: &Credentials) -> Result<Vec<String>, BusError> {
    let lab = Lab::connect(endpoint, credentials).await?;
    let rigs = lab.rigs();
    lab.close().await?;
    Ok(rigs)
}

/// Sends one command to every rig of the service at an endpoint or, if that is a router, to every rig behind it. Each answer comes
/// with its rig's name, sorted by it, or why there is none: as [`Lab::client`] and [`Client::command`].
///
/// # Errors
/// [`BusError::NoService`], [`BusError::NotAllowed`], [`BusError::Session`]; [`BusError::NoRig`] if there is none.
///
/// # Panics
/// As [`Client::connect`].
pub async fn ask_all<M: Message + Clone + 'static>(
    endpoint: &Endpoint,
    credentials: &Credentials,
    command: Command,
    request: &M,
    patience: Duration,
) -> Result<Vec<(String, Result<pb::CommandReply, BusError>)>, BusError> {
    let lab = Lab::connect(endpoint, credentials).await?;
    let own = lab.roster.rigs_of(&lab.neighbours().await);
    let rigs = if own.is_empty() { lab.rigs() } else { own };
    if rigs.is_empty() {
        return Err(BusError::NoRig { endpoint: endpoint.to_string() });
    }
    // A service takes so many at once and refuses more.
    let (places, mut asking) = (Arc::new(Semaphore::new(ASKED_AT_ONCE)), JoinSet::new());
    for rig in rigs {
        let (client, request, places) = (lab.client(&rig).await, request.clone(), Arc::clone(&places));
        asking.spawn(async move {
            // Nobody closes it.
            let _place = places.acquire().await;
            let answer = match client {
                Ok(client) => client.command(command, &request, patience).await,
                Err(error) => Err(error),
            };
            (rig, answer)
        });
    }
    let mut answers = asking.join_all().await;
    answers.sort_by(|(rig, _), (other, _)| rig.cmp(other));
    lab.close().await?;
    Ok(answers)
}

/// Stops the rig of that name, or every rig that the bus at an endpoint reaches: by datagram and on the bus at once, without
/// a lease, and without waiting until a service says that it is ready. Returns the answer of each service.
///
/// # Errors
/// [`BusError::RigName`] for an invalid name; [`BusError::NotStopped`] if no service has answered: then nothing is known.
///
/// # Panics
/// As [`Client::connect`].
pub async fn stop(
    endpoint: &Endpoint,
    rig: Option<&str>,
    request: &pb::CommandRequest,
    credentials: &Credentials,
    patience: Duration,
) -> Result<Vec<pb::CommandReply>, BusError> {
    if let Some(rig) = rig {
        check_rig_name(rig)?;
    }
    let datagram = stop_by_datagram(endpoint, rig, request, patience);
    let on_bus = async {
        let late = |_| Err(BusError::NoAnswer { key: STOP_EVERY_RIG.to_owned(), waited: patience });
        let stopping = stop_on_bus(endpoint, rig, request, credentials, patience);
        timeout(patience, stopping).await.unwrap_or_else(late)
    };
    tokio::pin!(datagram, on_bus);
    let (by_datagram, on_bus) = tokio::select! {
        answer = &mut datagram => {
            let limit = if matches!(answer, Ok(Some(_))) { OTHERS_PATIENCE } else { patience };
            (answer, timeout(limit, on_bus).await.unwrap_or(Ok(Vec::new())))
        }
        answers = &mut on_bus => match answers {
            Ok(answers) if !answers.is_empty() => (Ok(None), Ok(answers)),
            answers => (datagram.await, answers),
        }
    };
    let mut answers = BTreeMap::new();
    let mut sources: Vec<Box<dyn Error + Send + Sync>> = Vec::new();
    match by_datagram {
        Ok(reply) => answers.extend(reply.map(|reply| (reply.rig.clone(), reply))),
        Err(error) => sources.push(Box::new(error)),
    }
    match on_bus {
        Ok(replies) => answers.extend(replies.into_iter().map(|reply| (reply.rig.clone(), reply))),
        Err(error) => sources.push(Box::new(error)),
    }
    if answers.is_empty() {
        let source = match reach(endpoint).await {
            Err(nobody) => nobody.into(),
            Ok(()) => sources.pop().unwrap_or_else(|| "nobody serves the rig there".into()),
        };
        return Err(BusError::NotStopped { endpoint: endpoint.to_string(), source });
    }
    Ok(answers.into_values().collect())
}

/// Sends a stop to the endpoint's place for datagrams, if it has one: now, before the returned future is polled.
fn stop_by_datagram(
    endpoint: &Endpoint,
    rig: Option<&str>,
    request: &pb::CommandRequest,
    patience: Duration,
) -> impl Future<Output = io::Result<Option<pb::CommandReply>>> + use<> {
    let (endpoint, rig, request) = (endpoint.clone(), rig.map(str::to_owned), request.clone());
    let sent =
        tokio::task::spawn_blocking(move || crate::stop::send(&endpoint, rig.as_deref(), &request, patience));
    async { sent.await.map_err(io::Error::other)? }
}

/// Sends a stop on the bus, and waits for the answers of all services that it concerns.
async fn stop_on_bus(
    endpoint: &Endpoint,
    rig: Option<&str>,
    request: &pb::CommandRequest,
    credentials: &Credentials,
    patience: Duration,
) -> Result<Vec<pb::CommandReply>, BusError> {
    let until = Instant::now() + patience;
    let session = open(endpoint, credentials).await?;
    let key = rig.map_or(STOP_EVERY_RIG.to_owned(), |rig| Keys::new(rig).command(Command::Stop));
    let replies = ask(&session, &key, Command::Stop, request, patience).await?;
    // The stop is on its way; only now it is asked who has to answer it.
    let roster = Roster::keep(&session).await?;
    let mut awaited = roster.running();
    awaited.retain(|(of, _)| rig.is_none_or(|rig| rig == of));
    let mut answers = Vec::new();
    while !awaited.is_empty()
        && let Ok(Ok(reply)) = timeout_at(until, replies.recv_async()).await
    {
        let (Ok(sample), Some(replier)) = (reply.result(), reply.replier_id()) else { continue };
        let reply = decode(&key, sample)?;
        // A service of one rig may leave its name out.
        let is_by = |(rig, id): &(String, ZenohId)| {
            *id == replier.zid() && (reply.rig.is_empty() || *rig == reply.rig)
        };
        if let Some(known) = awaited.iter().position(is_by) {
            let (rig, _) = awaited.remove(known);
            answers.push(pb::CommandReply { rig, ..reply });
        }
    }
    // Another service may only say that it is the rig's: it counts if all have answered.
    answers.retain(|reply| awaited.iter().all(|(rig, _)| *rig != reply.rig));
    if let Err(error) = session.close().await {
        tracing::debug!(%error, "the connection did not close cleanly");
    }
    Ok(answers)
}

/// Sends a request; all services that have the key answer.
async fn ask<M: Message>(
    session: &Session,
    key: &str,
    command: Command,
    request: &M,
    patience: Duration,
) -> Result<FifoChannelHandler<Reply>, BusError> {
    // A stop has the highest priority.
    let priority = if command == Command::Stop { Priority::RealTime } else { Priority::InteractiveHigh };
    session
        .get(key)
        .payload(request.encode_to_vec())
        .encoding(encoding(M::NAME))
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .congestion_control(CongestionControl::Block)
        .priority(priority)
        .express(true)
        .timeout(patience)
        .await
        .map_err(BusError::key(key))
}

fn decode(key: &str, sample: &Sample) -> Result<pb::CommandReply, BusError> {
    <pb::CommandReply as prost::Message>::decode(&*sample.payload().to_bytes())
        .map_err(|source| BusError::Answer { key: key.to_owned(), source })
}

/// Opens a session on a thread for waiting: zenoh's `open` blocks its thread until it is connected, and a service without a free
/// connection may take seconds for that.
async fn open(endpoint: &Endpoint, credentials: &Credentials) -> Result<Session, BusError> {
    let opening = zenoh::open(config::client(endpoint, credentials)?);
    let opened = tokio::task::spawn_blocking(move || opening.wait()).await;
    opened
        .unwrap_or_else(|panic| Err(panic.into()))
        .map_err(|source| BusError::Session { endpoint: endpoint.to_string(), source: of_zenoh(&source) })
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
async fn reach(endpoint: &Endpoint) -> Result<(), BusError> {
    let connected = async {
        match endpoint.unix_path() {
            Some(path) => UnixStream::connect(path).await.map(drop),
            None => TcpStream::connect(endpoint.address()).await.map(drop),
        }
    };
    let late = || Err(io::Error::new(io::ErrorKind::TimedOut, "the machine does not answer"));
    timeout(REACH_TIMEOUT, connected).await.unwrap_or_else(|_| late()).map_err(|source| {
        let endpoint = endpoint.to_string();
        if source.kind() == io::ErrorKind::PermissionDenied {
            BusError::NotAllowed { endpoint, source }
        } else {
            BusError::NoService { endpoint, source }
        }
    })
}

/// The rig of that name. If only others are served it is an error at once: nobody would answer.
fn the_named_rig(rig: &str, roster: &Roster, endpoint: &Endpoint) -> Result<String, BusError> {
    let rigs = roster.served();
    if rigs.is_empty() || rigs.iter().any(|one| one == rig) {
        return Ok(rig.to_owned());
    }
    Err(BusError::UnknownRig { endpoint: endpoint.to_string(), rig: rig.to_owned(), rigs })
}

/// The only rig of the service at the other end of the connection or, if that is a router, the only one that is ready. A service of
/// several rigs wants a name, whichever of them are ready: another rig must not take the place of one that is missing.
fn the_rig_of(neighbours: &[ZenohId], roster: &Roster, endpoint: &Endpoint) -> Result<String, BusError> {
    let mut own = roster.rigs_of(neighbours);
    if own.len() > 1 {
        return Err(BusError::SeveralRigs { endpoint: endpoint.to_string(), rigs: own });
    }
    match own.pop() {
        Some(rig) if roster.is_ready(&rig) => Ok(rig),
        _ => the_only_rig(roster.rigs(), endpoint),
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
