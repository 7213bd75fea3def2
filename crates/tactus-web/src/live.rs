//! The connection to the service, restored whenever it is lost, and what the pages are told.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use axum::body::Bytes;
use serde_json::{Value, json};
use tactus_bus::{BusError, Client, Credentials, Endpoint, History, Hold};
use tactus_schema::key::Command;
use tactus_schema::pb::{self, run_event::Event};
use tokio::sync::{broadcast, watch};
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};
use tracing::{info, warn};

use crate::board::Board;
use crate::feed::Feed;
use crate::order::{Order, Question};

/// Time between two attempts to connect.
const AGAIN: Duration = Duration::from_secs(1);
/// Time limit for replies, except to `reset`, `run` and `plan`.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a command waits for the connection to be restored.
const RECONNECTED: Duration = Duration::from_secs(2);
/// Time limit for the reply to `reset`, because homing is slow.
const HOMING_PATIENCE: Duration = Duration::from_mins(2);
/// Time limit for the replies to `run` and `plan`, because a dry run computes.
const DRY_RUN_PATIENCE: Duration = Duration::from_mins(5);
/// Time limit for the replies to a stop on the bus; a datagram is answered at once.
const STOP_PATIENCE: Duration = Duration::from_secs(5);
/// Time between two views of what is no frame.
const VIEW_PERIOD: Duration = Duration::from_millis(100);
/// `CommandReply.exit_code` of what cannot be done in this state.
const NOT_NOW: u32 = 5;
/// This program's name for the service.
const WHO: &str = "dashboard";

/// Why a command was not done.
#[derive(Debug)]
pub(crate) enum NotDone {
    /// Another client holds the lease.
    Held(String),
    /// A question that may be answered if it is asked again.
    NotNow(String),
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

/// Connection to the rig, and what the pages show.
#[derive(Debug, Clone)]
pub(crate) struct Live {
    service: Arc<Service>,
    client: watch::Receiver<Option<Arc<Client>>>,
    feed: Arc<Mutex<Feed>>,
    /// Pages that want the list of experiments wait for each other: the service makes one at a time.
    listing: Arc<tokio::sync::Mutex<()>>,
}

impl Live {
    /// Connects, and reconnects whenever the connection is lost.
    pub(crate) fn start(endpoint: Option<Endpoint>, rig: Option<String>) -> Self {
        let (to_client, client) = watch::channel(None);
        let service = Arc::new(Service { endpoint, rig });
        let problem = format!("no service at {} yet", service.endpoint());
        let feed = Arc::new(Mutex::new(Feed::new(Board { problem, ..Board::default() })));
        let live = Self { service, client, feed, listing: Arc::default() };
        tokio::spawn(live.clone().keep_connected(to_client));
        live
    }

    async fn keep_connected(self, to_client: watch::Sender<Option<Arc<Client>>>) {
        loop {
            let problem = match Client::connect(&self.service.endpoint(), self.service.rig.as_deref()).await {
                Ok(client) => {
                    let client = Arc::new(client);
                    self.feed().board.connected(client.rig());
                    to_client.send_replace(Some(Arc::clone(&client)));
                    info!(rig = client.rig(), "connected");
                    let ended = self.follow(&client).await;
                    let problem = ended.map_or_else(
                        |error| error.to_string(),
                        |()| format!("the service of rig {} has ended", client.rig()),
                    );
                    warn!(problem, "connection lost");
                    problem
                }
                Err(error) => error.to_string(),
            };
            {
                let mut feed = self.feed();
                feed.board.disconnected(&problem, now_wall_ns());
                feed.tell();
            }
            to_client.send_replace(None);
            sleep(AGAIN).await;
        }
    }

    fn feed(&self) -> MutexGuard<'_, Feed> {
        // What a panic left is as good as what was there before.
        self.feed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All that a page needs first, and what follows it. A page that is slower than 64 messages misses the oldest.
    pub(crate) fn join(&self) -> (Bytes, broadcast::Receiver<Bytes>) {
        self.feed().join()
    }

    /// All that a page needs after it has missed something.
    pub(crate) fn whole(&self) -> Bytes {
        self.feed().whole()
    }

    /// The last minutes, as [`tactus_live::History::bytes`] has them.
    pub(crate) fn history(&self) -> Vec<u8> {
        self.feed().board.history.bytes()
    }

    /// The present state, as [`crate::metrics`] has it.
    pub(crate) fn metrics(&self) -> String {
        let feed = self.feed();
        let metrics = crate::metrics::metrics(&feed.board);
        #[cfg(feature = "foxglove")]
        let metrics = metrics + &feed.channels.metrics(&feed.board);
        metrics
    }

    /// What viewers are told, and the board that it is made of.
    #[cfg(feature = "foxglove")]
    pub(crate) fn channels<T>(&self, ask: impl FnOnce(&mut crate::foxglove::Channels, &Board) -> T) -> T {
        let Feed { channels, board, .. } = &mut *self.feed();
        ask(channels, board)
    }

    /// Takes a zero for all viewers.
    ///
    /// # Errors
    /// As [`Board::take_zero`].
    pub(crate) fn take_zero(&self) -> Result<(), String> {
        let mut feed = self.feed();
        feed.board.take_zero()?;
        feed.tell();
        Ok(())
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

    /// Sends a command that needs the lease. Takes the lease for it; given a reason, takes it over if another client holds it. Returns
    /// what who asks should know besides.
    ///
    /// # Errors
    /// What keeps the rig from doing it.
    pub(crate) async fn command(&self, order: Order, take_over: Option<&str>) -> Result<String, NotDone> {
        let client = self.connected().await?;
        let who = order.who().unwrap_or(WHO).to_owned();
        let held =
            match client.hold(&who, take_over).await.map_err(|error| NotDone::Failed(in_words(error)))? {
                Hold::Held(held) => held,
                Hold::Refused(reply) => return Err(NotDone::Held(reply.error)),
            };
        let reason = take_over.unwrap_or("button").to_owned();
        let control = pb::CommandRequest { who, reason, lease: held.secret(), ..Default::default() };
        let reply = match order {
            Order::Pause => client.command(Command::Pause, &control, PATIENCE).await,
            Order::Resume { covering_mm } => {
                let control = pb::CommandRequest { covering_mm, ..control };
                client.command(Command::Resume, &control, PATIENCE).await
            }
            Order::Reset => client.command(Command::Reset, &control, HOMING_PATIENCE).await,
            Order::Run(request) => {
                let request = pb::RunRequest { who: control.who, lease: control.lease, ..request };
                client.command(Command::Run, &request, DRY_RUN_PATIENCE).await
            }
        };
        if let Err(error) = held.release().await {
            warn!(%error, "the lease was not given back; it ends by itself");
        }
        let reply = reply.map_err(|error| NotDone::Failed(in_words(error)))?;
        done(&reply).map_err(NotDone::Failed)?;
        Ok(reply.note)
    }

    /// Asks for something that commands nothing. JSON for the page.
    ///
    /// # Errors
    /// What the service says, or why there is none.
    pub(crate) async fn ask(&self, question: Question) -> Result<Value, NotDone> {
        let client = self.connected().await?;
        let reply = match question {
            Question::Experiments => {
                let (client, listing) = (Arc::clone(&client), Arc::clone(&self.listing));
                // A task of its own: if this page is closed meanwhile, the next one still waits until the service has listed.
                let listed = tokio::spawn(async move {
                    let _turn = listing.lock().await;
                    let request = pb::CommandRequest { who: WHO.into(), ..Default::default() };
                    client.command(Command::Experiments, &request, DRY_RUN_PATIENCE).await
                });
                listed.await.map_err(|error| NotDone::Failed(error.to_string()))?
            }
            Question::Plan(request) => {
                let request = pb::RunRequest { who: WHO.into(), ..request };
                client.command(Command::Plan, &request, DRY_RUN_PATIENCE).await
            }
        };
        let reply = reply.map_err(|error| NotDone::Failed(in_words(error)))?;
        let why = if reply.exit_code == NOT_NOW { NotDone::NotNow } else { NotDone::Failed };
        done(&reply).map_err(why)?;
        Ok(match &reply.plan {
            Some(plan) => plan_json(plan),
            None => reply.experiments.iter().map(experiment_json).collect(),
        })
    }

    async fn connected(&self) -> Result<Arc<Client>, NotDone> {
        let mut clients = self.client.clone();
        let client = match timeout(RECONNECTED, clients.wait_for(Option::is_some)).await {
            Ok(Ok(client)) => client.clone(),
            Ok(Err(_)) | Err(_) => None,
        };
        client.ok_or_else(|| NotDone::Failed(self.feed().board.problem.clone()))
    }

    /// Keeps the board up to date until the service ends.
    async fn follow(&self, client: &Client) -> Result<(), BusError> {
        let mut alive = client.alive();
        if !alive.now() {
            return Ok(());
        }
        let mut infos = client.subscribe::<pb::SensorInfo>(History::Last).await?;
        let mut stages = client.subscribe::<pb::StageState>(History::Last).await?;
        let mut runs = client.subscribe::<pb::RunState>(History::Last).await?;
        let mut safety = client.subscribe::<pb::SafetyEvent>(History::Last).await?;
        let mut health = client.subscribe::<pb::Health>(History::Last).await?;
        let mut events = client.subscribe::<pb::RunEvent>(History::All).await?;
        let mut frames = client.subscribe::<pb::Frame>(History::All).await?;
        let mut views = interval(VIEW_PERIOD);
        views.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // Asked again after each change of covering.
        let mut is_asking = true;
        let description = describe(client);
        tokio::pin!(description);
        loop {
            tokio::select! {
                // Frames last: what was told of them before is known then. Whatever else comes is rare.
                biased;
                there = alive.changed() => if there != Some(true) {
                    return Ok(());
                },
                Some(info) = infos.recv() => self.feed().board.info = Some(info),
                Some(stage) = stages.recv() => self.feed().on_stage(stage),
                Some(run) = runs.recv() => self.feed().board.run = Some(run),
                Some(event) = safety.recv() => self.feed().board.on_safety(event),
                Some(pulse) = health.recv() => self.feed().board.on_health(pulse),
                Some(event) = events.recv() => {
                    if matches!(event.event, Some(Event::CoveringChanged(_))) {
                        description.set(describe(client));
                        is_asking = true;
                    }
                    self.feed().board.on_event(&event);
                }
                described = &mut description, if is_asking => {
                    is_asking = false;
                    if let Some(described) = described {
                        self.feed().board.on_description(described);
                    }
                }
                _ = views.tick() => self.feed().tell(),
                Some(frame) = frames.recv() => {
                    let missed = frames.losses().missed + frames.losses().overrun;
                    self.feed().on_frame(frame, missed);
                }
            }
        }
    }
}

/// The rig as it is now; `None` if the service does not tell.
async fn describe(client: &Client) -> Option<pb::RigDescription> {
    let request = pb::CommandRequest { who: WHO.into(), ..Default::default() };
    match client.command(Command::Status, &request, PATIENCE).await {
        Ok(reply) => reply.description,
        Err(error) => {
            warn!(%error, "the service does not describe its rig");
            None
        }
    }
}

fn done(reply: &pb::CommandReply) -> Result<(), String> {
    if reply.ok { Ok(()) } else { Err(reply.error.clone()) }
}

/// An error with its causes.
fn in_words(error: BusError) -> String {
    format!("{:#}", anyhow::Error::from(error))
}

fn now_wall_ns() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

fn plan_json(plan: &pb::Plan) -> Value {
    json!({
        "possible": plan.exit_status() == pb::ExitStatus::Done,
        "exit_status": plan.exit_status().word(),
        "message": plan.message,
        "presses": plan.presses,
        "dwells": plan.dwells,
        "duration_s": plan.duration_s,
        "deepest_mm": plan.deepest_mm,
        "depth_max_mm": plan.depth_max_mm,
        "travel_mm": plan.travel_mm,
        // A text: the page's numbers have 53 bits.
        "seed": plan.seed.to_string(),
        "parameters": json_or_null(&plan.parameters_json),
    })
}

fn experiment_json(experiment: &pb::Experiment) -> Value {
    json!({
        "name": experiment.name,
        "doc": experiment.doc,
        "error": experiment.error,
        "parameters": experiment.parameters.iter().map(|parameter| json!({
            "name": parameter.name,
            "kind": parameter.kind,
            "default": json_or_null(&parameter.default_json),
            "doc": parameter.doc,
            "unit": parameter.unit,
            "choices": parameter.choices_json.iter().map(|text| json_or_null(text)).collect::<Vec<_>>(),
            "min": parameter.min,
            "max": parameter.max,
        })).collect::<Vec<_>>(),
    })
}

fn json_or_null(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_default()
}
