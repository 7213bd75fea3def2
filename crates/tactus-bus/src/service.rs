//! The service's end of the bus.

use std::sync::Arc;

use tactus_schema::key::Keys;
use zenoh::{Session, query::Queryable};

use crate::{
    AliveToken, BusConfig, BusError, Calls, Publisher,
    cache::{self, Question},
    command::{self, Answer, Replies},
    publisher::{Lanes, Outgoing, Outlets},
    queue::Queue,
    topic::Lane,
    worker::Worker,
};

/// The service's end of the bus: publishers of all topics and the rig's commands.
#[derive(Debug)]
pub struct Bus {
    session: Session,
    keys: Keys,
    lanes: Arc<Lanes>,
    /// In the order in which they finish: what is published, what is asked.
    pumps: [Worker<Outgoing>; 2],
    answering: Worker<Answer>,
    recalling: Worker<Question>,
    _queryables: Vec<Queryable<()>>,
}

impl Bus {
    /// Opens the bus for a rig. Commands come in from here on; clients see the rig as ready only after
    /// [`Bus::declare_alive`].
    ///
    /// # Errors
    /// [`BusError::Open`] if an endpoint cannot be listened on; [`BusError::Key`] if the rig's name
    /// makes no key; [`BusError::Thread`] if the system is out of threads.
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn open(config: &BusConfig, keys: Keys) -> Result<(Self, Calls), BusError> {
        if !config.is_loopback() {
            tracing::warn!(
                ?config,
                "the bus reaches beyond this machine; whoever reaches it may command the rig"
            );
        }
        let session = zenoh::open(config.service()?).await.map_err(|source| {
            let listen: Vec<_> = config.listen.iter().map(ToString::to_string).collect();
            BusError::Open { listen: listen.join(", "), source }
        })?;
        let questions = cache::questions();
        let recalling = start("bus-past", &questions, Question::answer)?;

        let lanes = Arc::new(Lanes::new());
        let frames = Outlets::declare(&session, &keys, Lane::Frames, &questions).await?;
        let news = Outlets::declare(&session, &keys, Lane::News, &questions).await?;
        let pumps = [
            start("bus-frames", lanes.queue(Lane::Frames), move |message| frames.publish(message))?,
            start("bus-news", lanes.queue(Lane::News), move |message| news.publish(message))?,
        ];

        let answers = command::answers();
        let answering = start("bus-answers", &answers, Answer::send)?;
        let (queryables, calls) = command::declare(&session, &keys, &Replies::to(answers)).await?;
        let bus = Self { session, keys, lanes, pumps, answering, recalling, _queryables: queryables };
        Ok((bus, calls))
    }

    /// A handle for whoever has something to tell.
    pub fn publisher(&self) -> Publisher {
        Publisher::new(self.lanes.clone())
    }

    /// Tells clients that the service is ready, for as long as the token is held.
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn declare_alive(&self) -> Result<AliveToken, BusError> {
        AliveToken::declare(&self.session, &self.keys).await
    }

    /// Sends what is still on its way, answers to commands included, and closes. Drop the
    /// [`AliveToken`] before, so that clients hear of it first.
    ///
    /// # Errors
    /// [`BusError::Close`] if zenoh could not take leave of every client.
    pub async fn close(self) -> Result<(), BusError> {
        for pump in self.pumps {
            pump.finish().await;
        }
        self.answering.finish().await;
        self.recalling.finish().await;
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
