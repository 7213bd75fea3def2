//! A service's node on the bus: one session with its threads, which all rigs of the service share.

use std::{
    collections::BTreeSet,
    fs::{self, Permissions},
    io,
    os::unix::fs::PermissionsExt as _,
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tactus_schema::key::Keys;
use tokio::sync::mpsc;
use zenoh::{Session, query::Queryable};

use crate::{
    Bus, BusConfig, BusError, CommandCall, Endpoint,
    cache::{self, HistoryQuery},
    command::{self, PendingReplies, Replies},
    denial,
    error::of_zenoh,
    linger,
    outlet::Carrier,
    queue::Queue,
    stop::StopSocket,
    topic::{Lane, frames_kept},
    worker::Worker,
};

/// Stops that can wait, for each rig. Further ones are refused with an error.
const WAITING_STOPS: usize = 16;

/// The part of the bus that the rigs of a service share: the session, what it listens on, and the threads that send.
///
/// No two rigs wait for each other here: each has queues of its own, and the threads take from them in turn.
#[derive(Debug)]
pub struct Node {
    pub(crate) session: Session,
    config: BusConfig,
    pub(crate) carriers: [Carrier; 2],
    pub(crate) replies: Replies,
    pub(crate) history_queries: Arc<Queue<HistoryQuery>>,
    pub(crate) stops: mpsc::Sender<Box<CommandCall>>,
    pub(crate) served: Served,
    /// [`BusConfig::gathers`].
    pub(crate) gathers: bool,
    /// Frames that are kept of each rig.
    pub(crate) frames_kept: usize,
    command_replies: Worker<PendingReplies>,
    history_replies: Worker<HistoryQuery>,
    /// Of a stop for every rig.
    _stop: Queryable<()>,
    _stop_sockets: Vec<StopSocket>,
}

/// The names of the rigs that the service serves now.
#[derive(Debug, Clone, Default)]
pub(crate) struct Served(Arc<Mutex<BTreeSet<Arc<str>>>>);

impl Node {
    /// Opens the bus for these rigs, which [`Node::serve`] then puts on it. Every stop arrives at the returned channel: of
    /// each rig's `cmd/stop`, of [`tactus_schema::key::STOP_EVERY_RIG`], and datagrams.
    ///
    /// # Errors
    /// [`BusError::Open`] or [`BusError::Stop`] if an endpoint cannot be listened on; [`BusError::Unprotected`] if other
    /// machines would reach one without a certificate; [`BusError::Thread`] if the system is out of threads.
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn open(
        config: &BusConfig,
        rigs: &[Keys],
    ) -> Result<(Arc<Self>, mpsc::Receiver<Box<CommandCall>>), BusError> {
        config.check()?;
        let session = zenoh::open(config.service(rigs)?)
            .await
            .map_err(|source| BusError::Open { listen: texts(config), source: of_zenoh(&source) })?;
        for path in config.listen.iter().filter_map(Endpoint::unix_path) {
            share(path).map_err(|source| BusError::Open { listen: texts(config), source: source.into() })?;
        }
        // Stops first, and before anything can wait for a client. Bounded; a stop that does not fit is refused at once.
        let (stops, stops_taken) = mpsc::channel(WAITING_STOPS * rigs.len().max(1));
        let served = Served::default();
        let stop_sockets = stop_sockets(config, &served, &stops)?;
        let answers = command::answers(rigs.len());
        let command_replies = start("bus-answers", &answers, PendingReplies::send)?;
        let replies = Replies::to(answers);
        let stop = command::declare_stop(&session, &stops, &replies).await?;
        let history_queries = cache::history_queries();
        let history_replies = start("bus-history", &history_queries, HistoryQuery::answer)?;
        let carriers = [Lane::Frames, Lane::Updates]
            .map(|lane| Carrier::start(lane).map_err(|source| BusError::Thread { source }));
        let [frames, updates] = carriers;
        let node = Self {
            session,
            config: config.clone(),
            carriers: [frames?, updates?],
            replies,
            history_queries,
            stops,
            served,
            gathers: config.gathers(rigs),
            frames_kept: frames_kept(config.frames_kept, rigs.len()),
            command_replies,
            history_replies,
            _stop: stop,
            _stop_sockets: stop_sockets,
        };
        Ok((Arc::new(node), stops_taken))
    }

    /// Puts a rig on the bus. Its commands are received from now on; clients see the rig as ready after
    /// [`Bus::declare_alive`].
    ///
    /// # Errors
    /// [`BusError::Key`] if the rig's name is not valid in a key, [`BusError::Served`] if the node serves a rig of that name.
    pub async fn serve(
        self: &Arc<Self>,
        keys: Keys,
    ) -> Result<(Bus, mpsc::Receiver<Box<CommandCall>>), BusError> {
        Bus::declare(Arc::clone(self), keys).await
    }

    /// Checks on the real endpoints that who should not command a rig cannot, before its commands are read. Nothing is to be checked
    /// without certificates.
    ///
    /// # Errors
    /// [`BusError::NotDenied`] if a client that should not can command.
    pub async fn check_denials(
        &self,
        bus: &Bus,
        commands: &mut mpsc::Receiver<Box<CommandCall>>,
    ) -> Result<(), BusError> {
        if self.config.tls.is_none() {
            return Ok(());
        }
        let mut denied = denial::check(&self.config, bus.keys()).await;
        // Calls that come so early get no answer.
        while let Ok(call) = commands.try_recv() {
            if call.is_by(denial::WHO) {
                let who = "without the right to command".to_owned();
                denied = Err(BusError::NotDenied { endpoint: texts(&self.config), who });
            }
        }
        denied
    }

    /// Sends all waiting messages and replies, waits until the clients have taken them or for 5 s, then closes.
    pub(crate) async fn close(self) -> Result<(), BusError> {
        for carrier in self.carriers {
            carrier.finish().await;
        }
        self.command_replies.finish().await;
        self.history_replies.finish().await;
        linger::until_taken(&self.session).await;
        self.session.close().await.map_err(|source| BusError::Close { source: of_zenoh(&source) })
    }
}

impl Served {
    /// False if a rig of that name is there.
    pub(crate) fn add(&self, rig: &str) -> bool {
        self.names().insert(rig.into())
    }

    pub(crate) fn remove(&self, rig: &str) {
        self.names().remove(rig);
    }

    /// The name as it was added.
    pub(crate) fn get(&self, rig: &str) -> Option<Arc<str>> {
        self.names().get(rig).cloned()
    }

    fn names(&self) -> MutexGuard<'_, BTreeSet<Arc<str>>> {
        // Nothing panics under this lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lets the group connect; who may enter its folder is the administrator's choice.
fn share(socket: &Path) -> io::Result<()> {
    fs::set_permissions(socket, Permissions::from_mode(0o660))
}

fn texts(config: &BusConfig) -> String {
    let listen: Vec<_> = config.listen.iter().map(ToString::to_string).collect();
    listen.join(", ")
}

fn start<T: Send + 'static>(
    name: &str,
    queue: &Arc<Queue<T>>,
    work: impl FnMut(T) + Send + 'static,
) -> Result<Worker<T>, BusError> {
    Worker::start(name, queue.clone(), work).map_err(|source| BusError::Thread { source })
}

fn stop_sockets(
    config: &BusConfig,
    served: &Served,
    stops: &mpsc::Sender<Box<CommandCall>>,
) -> Result<Vec<StopSocket>, BusError> {
    let open = |endpoint: &Endpoint| {
        StopSocket::open(endpoint, served.clone(), stops.clone())
            .map_err(|source| BusError::Stop { endpoint: endpoint.to_string(), source })
            .transpose()
    };
    config.listen.iter().filter_map(open).collect()
}
