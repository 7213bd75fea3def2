//! The connection to the service, restored whenever it is lost, and the latest view.

use std::sync::Arc;
use std::time::Duration;

use tactus_bus::{BusError, Client, Credentials, Endpoint, History, Hold};
use tactus_schema::key::Command;
use tactus_schema::pb;
use tokio::sync::watch;
use tokio::time::{sleep, timeout};
use tracing::{info, warn};

use crate::view::View;

/// Time between two attempts to connect.
const AGAIN: Duration = Duration::from_secs(1);
/// Time limit for replies, except to `reset`.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a command waits for the connection to be restored.
const RECONNECTED: Duration = Duration::from_secs(2);
/// Time limit for the reply to `reset`, because homing is slow.
const HOMING_PATIENCE: Duration = Duration::from_mins(2);

/// Time limit for the replies to a stop on the bus; a datagram is answered at once.
const STOP_PATIENCE: Duration = Duration::from_secs(5);
/// This program's name for the service.
const WHO: &str = "dashboard";

/// Why a command was not done.
#[derive(Debug)]
pub(crate) enum NotDone {
    /// Another client holds the lease.
    Held(String),
    /// Any other reason.
    Failed(String),
}

/// Which service.
#[derive(Debug)]
struct Service {
    /// Without one it is looked for at each attempt: the service may start later than this program.
    endpoint: Option<Endpoint>,
    rig: Option<String>,
}

impl Service {
    fn endpoint(&self) -> Endpoint {
        self.endpoint.clone().unwrap_or_else(Endpoint::of_this_machine)
    }
}

/// Connection to the rig, and its latest view.
#[derive(Debug, Clone)]
pub(crate) struct Live {
    service: Arc<Service>,
    client: watch::Receiver<Option<Arc<Client>>>,
    view: watch::Receiver<View>,
}

impl Live {
    /// Connects, and reconnects whenever the connection is lost.
    pub(crate) fn start(endpoint: Option<Endpoint>, rig: Option<String>) -> Self {
        let (to_client, client) = watch::channel(None);
        let service = Arc::new(Service { endpoint, rig });
        let problem = format!("no service at {} yet", service.endpoint());
        let (to_view, view) = watch::channel(View { problem, ..View::default() });
        let own = Arc::clone(&service);
        tokio::spawn(async move {
            loop {
                let problem = match Client::connect(&own.endpoint(), own.rig.as_deref()).await {
                    Ok(client) => {
                        let client = Arc::new(client);
                        info!(rig = client.rig(), "connected");
                        to_view.send_replace(View { rig: client.rig().to_owned(), ..View::default() });
                        to_client.send_replace(Some(Arc::clone(&client)));
                        let ended = follow(&client, &to_view).await;
                        let problem = ended.map_or_else(
                            |error| error.to_string(),
                            |()| format!("the service of rig {} has ended", client.rig()),
                        );
                        warn!(problem, "connection lost");
                        problem
                    }
                    Err(error) => error.to_string(),
                };
                to_view.send_replace(View { problem, ..View::default() });
                to_client.send_replace(None);
                sleep(AGAIN).await;
            }
        });
        Self { service, client, view }
    }

    /// The latest view and its changes.
    pub(crate) fn view(&self) -> watch::Receiver<View> {
        self.view.clone()
    }

    /// Stops the rig, connected or not.
    ///
    /// # Errors
    /// A message for the user.
    pub(crate) async fn stop(&self) -> Result<(), String> {
        let request = pb::CommandRequest { who: WHO.into(), reason: "button".into(), ..Default::default() };
        // Copied out: nothing may be borrowed while this waits.
        let connected = self.client.borrow().clone();
        if let Some(client) = connected
            && let Ok(reply) = client.stop(&request, STOP_PATIENCE).await
        {
            return done(&reply);
        }
        let (endpoint, rig) = (self.service.endpoint(), self.service.rig.as_deref());
        let answers =
            tactus_bus::stop(&endpoint, rig, &request, &Credentials::default(), STOP_PATIENCE).await;
        answers.map_err(in_words)?.iter().try_for_each(done)
    }

    /// Sends a command that needs the lease. Takes the lease for it; given a reason, takes it over if another client holds it.
    ///
    /// # Errors
    /// What keeps the rig from doing it.
    pub(crate) async fn command(&self, command: Command, take_over: Option<&str>) -> Result<(), NotDone> {
        let mut clients = self.client.clone();
        let client = match timeout(RECONNECTED, clients.wait_for(Option::is_some)).await {
            Ok(Ok(client)) => client.clone(),
            Ok(Err(_)) | Err(_) => None,
        };
        let Some(client) = client else { return Err(NotDone::Failed(self.view.borrow().problem.clone())) };
        let held =
            match client.hold(WHO, take_over).await.map_err(|error| NotDone::Failed(in_words(error)))? {
                Hold::Held(held) => held,
                Hold::Refused(reply) => return Err(NotDone::Held(reply.error)),
            };
        let request = pb::CommandRequest {
            who: WHO.into(),
            reason: take_over.unwrap_or("button").into(),
            lease: held.secret(),
            ..Default::default()
        };
        let patience = if command == Command::Reset { HOMING_PATIENCE } else { PATIENCE };
        let reply = client.command(command, &request, patience).await;
        if let Err(error) = held.release().await {
            warn!(%error, "the lease was not given back; it ends by itself");
        }
        let reply = reply.map_err(|error| NotDone::Failed(in_words(error)))?;
        done(&reply).map_err(NotDone::Failed)
    }
}

fn done(reply: &pb::CommandReply) -> Result<(), String> {
    if reply.ok { Ok(()) } else { Err(reply.error.clone()) }
}

/// An error with its causes.
fn in_words(error: BusError) -> String {
    format!("{:#}", anyhow::Error::from(error))
}

/// Keeps `view` up to date until the service ends.
async fn follow(client: &Client, view: &watch::Sender<View>) -> Result<(), BusError> {
    let mut alive = client.alive();
    if !alive.now() {
        return Ok(());
    }
    let mut frames = client.subscribe::<pb::Frame>(History::Last).await?;
    let mut infos = client.subscribe::<pb::SensorInfo>(History::Last).await?;
    let mut stages = client.subscribe::<pb::StageState>(History::Last).await?;
    let mut runs = client.subscribe::<pb::RunState>(History::Last).await?;
    let mut safety = client.subscribe::<pb::SafetyEvent>(History::Last).await?;
    let mut health = client.subscribe::<pb::Health>(History::Last).await?;
    loop {
        tokio::select! {
            Some(frame) = frames.recv() => {
                let missed = frames.losses().missed + frames.losses().overrun;
                view.send_modify(|view| {
                    view.frame = Some(frame);
                    view.missed = missed;
                });
            }
            Some(info) = infos.recv() => view.send_modify(|view| view.info = Some(info)),
            Some(stage) = stages.recv() => view.send_modify(|view| view.stage = Some(stage)),
            Some(run) = runs.recv() => view.send_modify(|view| view.run = Some(run)),
            Some(event) = safety.recv() => view.send_modify(|view| view.safety = Some(event)),
            Some(pulse) = health.recv() => view.send_modify(|view| view.health = Some(pulse)),
            there = alive.changed() => if there != Some(true) {
                return Ok(());
            },
        }
    }
}
