//! The connection to the service, restored whenever it is lost, and the latest view.

use std::sync::Arc;
use std::time::Duration;

use tactus_bus::{BusError, Client, Endpoint, History};
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

/// Connection to the rig, and its latest view.
#[derive(Debug, Clone)]
pub(crate) struct Live {
    client: watch::Receiver<Option<Arc<Client>>>,
    view: watch::Receiver<View>,
}

impl Live {
    /// Connects, and reconnects whenever the connection is lost.
    pub(crate) fn start(endpoint: Endpoint, rig: Option<String>) -> Self {
        let (to_client, client) = watch::channel(None);
        let problem = format!("no service at {endpoint} yet");
        let (to_view, view) = watch::channel(View { problem, ..View::default() });
        tokio::spawn(async move {
            loop {
                let problem = match Client::connect(&endpoint, rig.as_deref()).await {
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
        Self { client, view }
    }

    /// The latest view and its changes.
    pub(crate) fn view(&self) -> watch::Receiver<View> {
        self.view.clone()
    }

    /// Sends a command to the service.
    ///
    /// # Errors
    /// A message for the user.
    pub(crate) async fn command(&self, command: Command) -> Result<(), String> {
        let mut clients = self.client.clone();
        let client = match timeout(RECONNECTED, clients.wait_for(Option::is_some)).await {
            Ok(Ok(client)) => client.clone(),
            Ok(Err(_)) | Err(_) => None,
        };
        let Some(client) = client else { return Err(self.view.borrow().problem.clone()) };
        let request =
            pb::CommandRequest { who: "dashboard".into(), reason: "button".into(), ..Default::default() };
        let patience = if command == Command::Reset { HOMING_PATIENCE } else { PATIENCE };
        let reply = client.command(command, &request, patience).await.map_err(|error| error.to_string())?;
        if reply.ok { Ok(()) } else { Err(reply.error) }
    }
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
