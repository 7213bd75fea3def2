//! The bus on the service's side.

use std::{
    fs::{self, Permissions},
    io,
    os::unix::fs::PermissionsExt as _,
    path::Path,
    sync::Arc,
};

use tactus_schema::key::Keys;
use zenoh::{Session, query::Queryable};

use crate::{
    AliveToken, BusConfig, BusError, Calls, Endpoint, Publisher,
    cache::{self, HistoryQuery},
    command::{self, Intake, PendingReply, Replies},
    denial,
    error::of_zenoh,
    liveness::InstanceToken,
    publisher::{Lanes, Outgoing, TopicPublishers},
    queue::Queue,
    stop::StopSocket,
    topic::Lane,
    worker::Worker,
};

/// The bus on the service's side: publishers of all topics and the rig's commands.
#[derive(Debug)]
pub struct Bus {
    session: Session,
    keys: Keys,
    lanes: Arc<Lanes>,
    /// Finished first, in this order, when the bus closes.
    publishing: [Worker<Outgoing>; 2],
    command_replies: Worker<PendingReply>,
    history_replies: Worker<HistoryQuery>,
    _queryables: Vec<Queryable<()>>,
    _stop_sockets: Vec<StopSocket>,
    _instance: InstanceToken,
}

impl Bus {
    /// Opens the bus for a rig. Commands are received from now on; clients see the rig as ready after
    /// [`Bus::declare_alive`].
    ///
    /// # Errors
    /// [`BusError::Open`] or [`BusError::Stop`] if an endpoint cannot be listened on; [`BusError::Unprotected`] if other
    /// machines would reach one without a certificate; [`BusError::NotDenied`] if a client that should not can command;
    /// [`BusError::Key`] if the rig's name is not valid in a key;
    /// [`BusError::Thread`] if the system is out of threads.
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn open(config: &BusConfig, keys: Keys) -> Result<(Self, Calls), BusError> {
        config.check()?;
        let (bus, mut calls) = Self::listen(config, keys).await?;
        if config.tls.is_none() {
            return Ok((bus, calls));
        }
        let mut denied = denial::check(config, &bus.keys).await;
        // Calls that come so early get no answer.
        while let Ok(call) = calls.commands.try_recv() {
            if call.is_by(denial::WHO) {
                let who = "without the right to command".to_owned();
                denied = Err(BusError::NotDenied { endpoint: texts(config), who });
            }
        }
        if let Err(error) = denied {
            bus.close().await?;
            return Err(error);
        }
        Ok((bus, calls))
    }

    async fn listen(config: &BusConfig, keys: Keys) -> Result<(Self, Calls), BusError> {
        let session = zenoh::open(config.service(&keys)?)
            .await
            .map_err(|source| BusError::Open { listen: texts(config), source: of_zenoh(&source) })?;
        for path in config.listen.iter().filter_map(Endpoint::unix_path) {
            share(path).map_err(|source| BusError::Open { listen: texts(config), source: source.into() })?;
        }
        // Stops first, and before anything can wait for a client.
        let (intake, calls) = command::channels();
        let stop_sockets = stop_sockets(config, &keys, &intake)?;
        let instance = InstanceToken::declare(&session, &keys).await?;
        let answers = command::answers();
        let command_replies = start("bus-answers", &answers, PendingReply::send)?;
        let queryables = command::declare(&session, &keys, &intake, &Replies::to(answers)).await?;

        let history_queries = cache::history_queries();
        let history_replies = start("bus-history", &history_queries, HistoryQuery::answer)?;
        let lanes = Arc::new(Lanes::new());
        let frames = TopicPublishers::declare(&session, &keys, Lane::Frames, &history_queries).await?;
        let updates = TopicPublishers::declare(&session, &keys, Lane::Updates, &history_queries).await?;
        let publishing = [
            start("bus-frames", lanes.queue(Lane::Frames), move |message| frames.publish(message))?,
            start("bus-updates", lanes.queue(Lane::Updates), move |message| updates.publish(message))?,
        ];
        let bus = Self {
            session,
            keys,
            lanes,
            publishing,
            command_replies,
            history_replies,
            _queryables: queryables,
            _stop_sockets: stop_sockets,
            _instance: instance,
        };
        Ok((bus, calls))
    }

    /// A handle that publishes.
    pub fn publisher(&self) -> Publisher {
        Publisher::new(self.lanes.clone())
    }

    /// Shows clients that the service is ready while the token is held.
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn declare_alive(&self) -> Result<AliveToken, BusError> {
        AliveToken::declare(&self.session, &self.keys).await
    }

    /// Sends all waiting messages and replies, then closes. Drop the [`AliveToken`] before, so that clients learn of it
    /// first.
    ///
    /// # Errors
    /// [`BusError::Close`] if zenoh could not close the session cleanly.
    pub async fn close(self) -> Result<(), BusError> {
        for worker in self.publishing {
            worker.finish().await;
        }
        self.command_replies.finish().await;
        self.history_replies.finish().await;
        self.session.close().await.map_err(|source| BusError::Close { source: of_zenoh(&source) })
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

fn stop_sockets(config: &BusConfig, keys: &Keys, intake: &Intake) -> Result<Vec<StopSocket>, BusError> {
    let open = |endpoint: &Endpoint| {
        StopSocket::open(endpoint, keys.rig(), intake.stops.clone())
            .map_err(|source| BusError::Stop { endpoint: endpoint.to_string(), source })
            .transpose()
    };
    config.listen.iter().filter_map(open).collect()
}
