//! The bus on the service's side.

use std::sync::Arc;

use tactus_schema::key::Keys;
use zenoh::{Session, query::Queryable};

use crate::{
    AliveToken, BusConfig, BusError, Calls, Publisher,
    cache::{self, HistoryQuery},
    command::{self, PendingReply, Replies},
    publisher::{Lanes, Outgoing, TopicPublishers},
    queue::Queue,
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
}

impl Bus {
    /// Opens the bus for a rig. Commands are received from now on; clients see the rig as ready after
    /// [`Bus::declare_alive`].
    ///
    /// # Errors
    /// [`BusError::Open`] if an endpoint cannot be listened on; [`BusError::Key`] if the rig's name
    /// is not valid in a key; [`BusError::Thread`] if the system is out of threads.
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn open(config: &BusConfig, keys: Keys) -> Result<(Self, Calls), BusError> {
        if !config.is_loopback() {
            tracing::warn!(
                ?config,
                "the bus is reachable from other machines; whoever reaches it can command the rig"
            );
        }
        let session = zenoh::open(config.service()?).await.map_err(|source| {
            let listen: Vec<_> = config.listen.iter().map(ToString::to_string).collect();
            BusError::Open { listen: listen.join(", "), source }
        })?;
        let history_queries = cache::history_queries();
        let history_replies = start("bus-history", &history_queries, HistoryQuery::answer)?;

        let lanes = Arc::new(Lanes::new());
        let frames = TopicPublishers::declare(&session, &keys, Lane::Frames, &history_queries).await?;
        let updates = TopicPublishers::declare(&session, &keys, Lane::Updates, &history_queries).await?;
        let publishing = [
            start("bus-frames", lanes.queue(Lane::Frames), move |message| frames.publish(message))?,
            start("bus-updates", lanes.queue(Lane::Updates), move |message| updates.publish(message))?,
        ];

        let answers = command::answers();
        let command_replies = start("bus-answers", &answers, PendingReply::send)?;
        let (queryables, calls) = command::declare(&session, &keys, &Replies::to(answers)).await?;
        let bus = Self {
            session,
            keys,
            lanes,
            publishing,
            command_replies,
            history_replies,
            _queryables: queryables,
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
        self.session.close().await.map_err(|source| BusError::Close { source })
    }
}

fn start<T: Send + 'static>(
    name: &str,
    queue: &Arc<Queue<T>>,
    work: impl FnMut(T) + Send + 'static,
) -> Result<Worker<T>, BusError> {
    Worker::start(name, queue.clone(), work).map_err(|source| BusError::Thread { source })
}
