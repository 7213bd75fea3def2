//! Key expressions on the bus: `tactus/<rig>/...`.

/// Key of a stop for every rig that the bus reaches, without its name. Each service answers it, with or without a sensor.
pub const STOP_EVERY_RIG: &str = "tactus/stop";

/// The keys of one rig.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Keys {
    rig: String,
}

/// A topic that the service publishes; its message is named beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// [`crate::pb::Frame`], at the sensor's rate.
    SensorFrame,
    /// [`crate::pb::SensorInfo`], at each connection.
    SensorInfo,
    /// [`crate::pb::StageState`], at each report of the stage.
    StageState,
    /// [`crate::pb::RunEvent`], when it happens.
    RunEvent,
    /// [`crate::pb::RunState`], at each change.
    RunState,
    /// [`crate::pb::Health`], once a second.
    Health,
    /// [`crate::pb::SafetyEvent`], at each change.
    SafetyState,
}

/// A command that the service answers. The request is [`crate::pb::RunRequest`] for [`Command::Run`] and [`Command::Plan`],
/// [`crate::pb::LeaseRequest`] for [`Command::Lease`], otherwise [`crate::pb::CommandRequest`]; the answer is
/// [`crate::pb::CommandReply`]. The service answers only a request to exactly this key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Command {
    /// Report the state of the service.
    Status,
    /// List the experiments that the service knows by name, with their parameters.
    Experiments,
    /// Dry-run an experiment on the rig's twin; nothing moves. A newer one ends an older one that still computes.
    Plan,
    /// Start an experiment.
    Run,
    /// Hold after the current step.
    Pause,
    /// Continue after a pause.
    Resume,
    /// Stop motion now, retract, end the run. Never waits for other commands.
    Stop,
    /// Clear the stage's alarm and home it. Refused during a run.
    Reset,
    /// Acquire, renew, release or take over the lease, which run, pause, resume and reset want.
    Lease,
}

impl Topic {
    /// In the order of the enumeration.
    pub const ALL: [Self; 7] = [
        Self::SensorFrame,
        Self::SensorInfo,
        Self::StageState,
        Self::RunEvent,
        Self::RunState,
        Self::Health,
        Self::SafetyState,
    ];

    /// The key below `tactus/<rig>/`.
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::SensorFrame => "sensor/frame",
            Self::SensorInfo => "sensor/info",
            Self::StageState => "stage/state",
            Self::RunEvent => "run/event",
            Self::RunState => "run/state",
            Self::Health => "health",
            Self::SafetyState => "safety/state",
        }
    }
}

impl Command {
    /// In the order of the enumeration.
    pub const ALL: [Self; 9] = [
        Self::Status,
        Self::Experiments,
        Self::Plan,
        Self::Run,
        Self::Pause,
        Self::Resume,
        Self::Stop,
        Self::Reset,
        Self::Lease,
    ];

    /// The key below `tactus/<rig>/`.
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::Status => "cmd/status",
            Self::Experiments => "cmd/experiments",
            Self::Plan => "cmd/plan",
            Self::Run => "cmd/run",
            Self::Pause => "cmd/pause",
            Self::Resume => "cmd/resume",
            Self::Stop => "cmd/stop",
            Self::Reset => "cmd/reset",
            Self::Lease => "cmd/lease",
        }
    }
}

impl Keys {
    /// The keys of the rig of that name; [`crate::Rig::name`] says what a name may be.
    pub fn new(rig: impl Into<String>) -> Self {
        Self { rig: rig.into() }
    }

    /// The rig's name.
    pub fn rig(&self) -> &str {
        &self.rig
    }

    /// Key of a topic, such as `tactus/sim/sensor/frame`.
    pub fn topic(&self, topic: Topic) -> String {
        format!("tactus/{}/{}", self.rig, topic.suffix())
    }

    /// Key of a command, such as `tactus/sim/cmd/stop`.
    pub fn command(&self, command: Command) -> String {
        format!("tactus/{}/{}", self.rig, command.suffix())
    }

    /// All its commands, such as `tactus/sim/cmd/*`: what the service listens to.
    pub fn commands(&self) -> String {
        format!("tactus/{}/cmd/*", self.rig)
    }

    /// The command that has exactly this key.
    pub fn command_at(&self, key: &str) -> Option<Command> {
        let suffix = key.strip_prefix("tactus/")?.strip_prefix(&*self.rig)?.strip_prefix('/')?;
        Command::ALL.into_iter().find(|command| command.suffix() == suffix)
    }

    /// Key of the liveliness token that the service holds from its start: `instance` is the id of its session on the bus,
    /// which its answers and messages carry.
    pub fn instance(&self, instance: &str) -> String {
        format!("tactus/{}/service/{instance}", self.rig)
    }

    /// Key of the liveliness token, held while the service is ready.
    pub fn alive(&self) -> String {
        format!("tactus/{}/alive", self.rig)
    }
}
