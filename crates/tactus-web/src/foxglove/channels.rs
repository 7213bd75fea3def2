//! What viewers are told of the board.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};
use tactus_live::{Entry, Weight};
use tactus_report::viewer::{Channel, ENCODING, Level, SCHEMAS, Scene, log_line, rig_in_words};
use tactus_schema::{WallTime, pb};
use tokio::sync::broadcast;

use crate::board::Board;
use crate::metrics;

/// Messages of all channels that a viewer may be behind: two seconds. Slower ones miss the oldest.
const BEHIND_MAX: usize = 256;
/// White in the image fades to half of it in so many frames, half a minute.
const HALF_LIFE_FRAMES: f32 = 900.0;
/// White in the image is at least this share of the limit of an element, so that noise stays dark.
const WHITE_MIN: f64 = 0.05;

/// Something that is told to all viewers.
#[derive(Debug, Clone)]
pub(crate) struct Told {
    /// They are numbered in the order in which they were told.
    pub(crate) number: u64,
    pub(crate) what: What,
}

/// What is told.
#[derive(Debug, Clone)]
pub(crate) enum What {
    Data(Data),
    /// A message of the protocol, for everybody.
    Text(String),
}

/// A message of a channel.
#[derive(Debug, Clone)]
pub(crate) struct Data {
    pub(crate) channel: Channel,
    pub(crate) at: WallTime,
    pub(crate) message: Arc<[u8]>,
}

/// The channels, and what was told on them.
#[derive(Debug)]
pub(crate) struct Channels {
    viewers: broadcast::Sender<Told>,
    /// Number of the next message.
    next: u64,
    scene: Option<Scene>,
    /// The rise that is white in the image.
    white_counts: f32,
    /// Number of the first log entry that was not told.
    told_log: u64,
    told_server: Value,
    told_problem: String,
    missed: u64,
    /// Viewers forget what they know when it changes.
    session: String,
}

impl Default for Channels {
    fn default() -> Self {
        // Drop-oldest: nothing waits for a viewer.
        let (viewers, _) = broadcast::channel(BEHIND_MAX);
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            viewers,
            next: 0,
            scene: None,
            white_counts: 0.0,
            told_log: 0,
            told_server: Value::Null,
            told_problem: String::new(),
            missed: 0,
            session: now.as_nanos().to_string(),
        }
    }
}

impl Channels {
    /// What a new viewer is told first, and what follows.
    pub(crate) fn join(&self, board: &Board) -> (Vec<String>, broadcast::Receiver<Told>) {
        let mut first = vec![self.server(board).to_string(), advertisement().to_string()];
        if !board.problem.is_empty() {
            first.push(problem(&board.problem).to_string());
        }
        (first, self.viewers.subscribe())
    }

    /// The present state of a channel for who subscribes to it, and the number of the first message that follows.
    pub(crate) fn present(&self, channel: Channel, board: &Board) -> (Vec<Data>, u64) {
        let scene = self.scene.as_ref();
        let data = match channel {
            Channel::Grid | Channel::Image => {
                self.of_frame(board).into_iter().filter(|data| data.channel == channel).collect()
            }
            Channel::Tip => self.of_stage(board).into_iter().collect(),
            Channel::Sensor => {
                let place = scene.zip(now(board)).map(|(scene, at)| data(channel, at, scene.sensor(at)));
                place.into_iter().collect()
            }
            // An entry that was not told yet follows by itself.
            Channel::Log => {
                let told = board.log.entries_from(0).filter(|entry| entry.number < self.told_log);
                told.map(of_entry).chain(of_rig(board)).collect()
            }
        };
        (data, self.next)
    }

    pub(crate) fn on_frame(&mut self, board: &Board) {
        let Some(frame) = &board.frame else { return };
        let greatest = rises(board, frame).filter(|rise| rise.is_finite()).fold(0.0, f32::max);
        let limit = board.description.as_ref().map_or(0.0, |rig| rig.element_max_counts);
        #[expect(clippy::cast_possible_truncation, reason = "counts are far within f32")]
        let least = (WHITE_MIN * limit).max(1.0) as f32;
        self.white_counts =
            (self.white_counts * 0.5_f32.powf(1.0 / HALF_LIFE_FRAMES)).max(greatest).max(least);
        if self.viewers.receiver_count() > 0 {
            for data in self.of_frame(board) {
                self.tell_all(What::Data(data));
            }
        }
    }

    pub(crate) fn on_stage(&mut self, board: &Board) {
        if self.viewers.receiver_count() > 0
            && let Some(data) = self.of_stage(board)
        {
            self.tell_all(What::Data(data));
        }
    }

    /// Tells what has changed since the last call, besides frames and reports of the stage.
    pub(crate) fn tell(&mut self, board: &Board) {
        let scene = board.description.as_ref().and_then(Scene::described);
        if scene.is_some() && scene != self.scene {
            self.scene = scene;
            let (place, _) = self.present(Channel::Sensor, board);
            for data in place {
                self.tell_all(What::Data(data));
            }
        }
        let server = self.server(board);
        if server != self.told_server {
            self.tell_all(What::Text(server.to_string()));
            if let Some(data) = of_rig(board) {
                self.tell_all(What::Data(data));
            }
            self.told_server = server;
        }
        if board.problem != self.told_problem {
            let status = match board.problem.as_str() {
                "" => json!({ "op": "removeStatus", "statusIds": [SERVICE] }),
                text => problem(text),
            };
            self.tell_all(What::Text(status.to_string()));
            self.told_problem.clone_from(&board.problem);
        }
        let lines: Vec<Data> = board.log.entries_from(self.told_log).map(of_entry).collect();
        self.told_log = board.log.next();
        for data in lines {
            self.tell_all(What::Data(data));
        }
    }

    /// A viewer missed so many messages.
    pub(crate) fn on_missed(&mut self, messages: u64) {
        self.missed += messages;
    }

    /// Lines for Prometheus.
    pub(crate) fn metrics(&self, board: &Board) -> String {
        metrics::of_viewers(&board.rig, self.viewers.receiver_count(), self.missed)
    }

    fn tell_all(&mut self, what: What) {
        // An error says that nobody looks.
        let _unseen = self.viewers.send(Told { number: self.next, what });
        self.next += 1;
    }

    /// The latest frame.
    fn of_frame(&self, board: &Board) -> Vec<Data> {
        let (Some(scene), Some(frame)) = (&self.scene, &board.frame) else { return Vec::new() };
        let at = WallTime::from_ns(frame.t_wall_ns);
        let rises: Vec<f32> = rises(board, frame).collect();
        let messages = scene.frame(&rises, self.white_counts, at);
        messages.into_iter().flatten().map(|(channel, message)| data(channel, at, message)).collect()
    }

    /// The latest report of the stage.
    fn of_stage(&self, board: &Board) -> Option<Data> {
        let (scene, stage) = (self.scene.as_ref()?, board.stage.as_ref()?);
        let at = WallTime::from_ns(stage.t_wall_ns);
        Some(data(Channel::Tip, at, scene.tip(stage, at)?))
    }

    /// Who serves.
    fn server(&self, board: &Board) -> Value {
        let health = board.health.as_ref();
        let simulated = health.map(|health| health.simulated);
        let mark = if simulated == Some(true) { " (SIMULATED)" } else { "" };
        json!({
            "op": "serverInfo",
            "name": format!("Tactus {}{mark}", board.rig),
            "capabilities": [],
            "supportedEncodings": [],
            "metadata": {
                "rig": board.rig,
                "simulated": simulated.map_or("unknown".to_owned(), |simulated| simulated.to_string()),
                "version": health.map_or("unknown", |health| &health.version),
            },
            "sessionId": self.session,
        })
    }
}

/// Id of the status that says why there is no service.
const SERVICE: &str = "service";

fn problem(text: &str) -> Value {
    json!({ "op": "status", "level": 2, "message": text, "id": SERVICE })
}

fn advertisement() -> Value {
    let schema = BASE64_STANDARD.encode(SCHEMAS);
    let channels = Channel::ALL.map(|channel| {
        json!({
            "id": channel as u8,
            "topic": channel.topic(),
            "encoding": ENCODING,
            "schemaName": channel.schema(),
            "schema": schema,
            "schemaEncoding": ENCODING,
        })
    });
    json!({ "op": "advertise", "channels": channels })
}

/// The rise of each element above the zero; none without a zero.
fn rises(board: &Board, frame: &pb::Frame) -> impl Iterator<Item = f32> {
    frame.counts.iter().zip(board.zero.counts()).map(|(counts, zero)| counts - zero)
}

fn of_entry(entry: &Entry) -> Data {
    let level = match entry.weight {
        Weight::Note => Level::Info,
        Weight::Warning => Level::Warning,
        Weight::Stop => Level::Error,
    };
    let name = if entry.run_id.is_empty() { entry.kind } else { &entry.run_id };
    let at = WallTime::from_ns(entry.t_wall_ns);
    data(Channel::Log, at, log_line(level, name, &entry.text, at))
}

/// The line that says which rig it is, and whether it is simulated; `None` while that is not known.
fn of_rig(board: &Board) -> Option<Data> {
    let (health, at) = (board.health.as_ref()?, now(board)?);
    let words = rig_in_words(&board.rig, health.simulated);
    Some(data(Channel::Log, at, log_line(Level::Info, "rig", &words, at)))
}

/// The present, as the service's last sign of life says.
fn now(board: &Board) -> Option<WallTime> {
    board.health.as_ref().map(|health| WallTime::from_ns(health.t_wall_ns))
}

fn data(channel: Channel, at: WallTime, message: Vec<u8>) -> Data {
    Data { channel, at, message: message.into() }
}
