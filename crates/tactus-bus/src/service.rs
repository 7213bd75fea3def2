//! One rig's part of the bus on the service's side.

use std::sync::Arc;

use tactus_schema::key::Keys;
use tokio::sync::mpsc;
use zenoh::query::Queryable;

use crate::{
    AliveToken, BusConfig, BusError, Calls, CommandCall, Node, Publisher,
    command::{self, Intake},
    liveness::InstanceToken,
    outlet::{Outlet, Outlets},
    publisher::TopicPublishers,
    topic::Lane,
};

/// A rig on the bus, on the service's side: publishers of all topics and the rig's commands.
#[derive(Debug)]
pub struct Bus {
    node: Arc<Node>,
    keys: Keys,
    outlets: Arc<Outlets>,
    _commands: Queryable<()>,
    _instance: InstanceToken,
}

impl Bus {
    /// Opens a bus for one rig alone: a [`Node`] that serves it. Commands are received from now on; clients see the rig as
    /// ready after [`Bus::declare_alive`].
    ///
    /// # Errors
    /// As [`Node::open`] and [`Node::serve`]; [`BusError::NotDenied`] if a client that should not can command.
    ///
    /// # Panics
    /// On a current-thread tokio runtime, as zenoh does.
    pub async fn open(config: &BusConfig, keys: Keys) -> Result<(Self, Calls), BusError> {
        let (node, stops) = Node::open(config, std::slice::from_ref(&keys)).await?;
        let (bus, mut commands) = node.serve(keys).await?;
        let denied = node.check_denials(&bus, &mut commands).await;
        drop(node);
        if let Err(error) = denied {
            bus.close().await?;
            return Err(error);
        }
        Ok((bus, Calls { stops, commands }))
    }

    pub(crate) async fn declare(
        node: Arc<Node>,
        keys: Keys,
    ) -> Result<(Self, mpsc::Receiver<Box<CommandCall>>), BusError> {
        if !node.served.add(keys.rig()) {
            return Err(BusError::Served { rig: keys.rig().to_owned() });
        }
        let served = node.served.clone();
        let declared = Self::declare_keys(node, keys.clone()).await;
        if declared.is_err() {
            served.remove(keys.rig());
        }
        declared
    }

    async fn declare_keys(
        node: Arc<Node>,
        keys: Keys,
    ) -> Result<(Self, mpsc::Receiver<Box<CommandCall>>), BusError> {
        let session = &node.session;
        let (intake, commands) = Intake::open(node.stops.clone());
        let instance = InstanceToken::declare(session, &keys).await?;
        let queryable = command::declare(session, &keys, intake, &node.replies).await?;
        let [frames, updates] = &node.carriers;
        let of_lane = async |lane| {
            TopicPublishers::declare(session, &keys, lane, node.frames_kept, &node.history_queries).await
        };
        let outlets = Outlets {
            frames: Outlet::new(Lane::Frames, of_lane(Lane::Frames).await?, frames.caller(), node.gathers),
            updates: Outlet::new(
                Lane::Updates,
                of_lane(Lane::Updates).await?,
                updates.caller(),
                node.gathers,
            ),
        };
        let bus = Self { outlets: Arc::new(outlets), node, keys, _commands: queryable, _instance: instance };
        Ok((bus, commands))
    }

    /// The rig's keys.
    pub fn keys(&self) -> &Keys {
        &self.keys
    }

    /// A handle that publishes.
    pub fn publisher(&self) -> Publisher {
        Publisher::new(self.outlets.clone())
    }

    /// Shows clients that the rig is ready while the token is held.
    ///
    /// # Errors
    /// [`BusError::Key`] if the session is closed.
    pub async fn declare_alive(&self) -> Result<AliveToken, BusError> {
        AliveToken::declare(&self.node.session, &self.keys).await
    }

    /// Sends all waiting messages, then takes the rig off the bus. The last one that uses a [`Node`] closes it, once the clients have
    /// taken the messages or after 5 s. Drop the [`AliveToken`] before, so that clients learn of it first.
    ///
    /// # Errors
    /// [`BusError::Close`] if zenoh could not close the session cleanly.
    pub async fn close(self) -> Result<(), BusError> {
        self.outlets.frames.finish().await;
        self.outlets.updates.finish().await;
        let Self { node, keys, _commands, _instance, .. } = self;
        node.served.remove(keys.rig());
        match Arc::into_inner(node) {
            Some(node) => node.close().await,
            None => Ok(()),
        }
    }
}
