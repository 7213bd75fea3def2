//! Hears one rig, asks again for what is missing, and passes everything on in order.

use std::time::Duration;

use tactus_bus::{BusError, Client, Gap, History, Published, Subscription};
use tactus_schema::key::{Command, Topic};
use tactus_schema::{Rig, pb};
use tokio::sync::watch;
use tokio::time::sleep;

use super::archive::{Described, Ended, Heard, Place};
use crate::connection;
use crate::exit::in_words;

/// Time for an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time between two questions.
const AGAIN: Duration = Duration::from_secs(1);
/// Questions for the same messages. A service that is silent for so long has lost them, or will have.
const QUESTIONS_MAX: u32 = 30;

/// Records one rig.
pub(super) struct Keeper {
    client: Client,
    place: Place,
    ending: watch::Receiver<bool>,
    start: Start,
}

/// What tells that a rig has started again.
struct Start {
    /// Publishers of the topic that has had most of them: a service that starts again has others.
    publishers: usize,
    /// Number of the last frame: a rig that starts again alone, within its service, counts anew.
    frame: Option<u64>,
}

/// Everything that is recorded of a rig.
struct Topics {
    infos: Subscription<pb::SensorInfo>,
    stages: Subscription<pb::StageState>,
    events: Subscription<pb::RunEvent>,
    safety: Subscription<pb::SafetyEvent>,
    frames: Subscription<pb::Frame>,
}

/// When a rig that is heard has started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Begun {
    Before,
    Anew,
}

impl Keeper {
    pub(super) fn new(client: Client, place: Place, ending: watch::Receiver<bool>) -> Self {
        Self { client, place, ending, start: Start { publishers: 1, frame: None } }
    }

    /// Records the rig until the collection ends.
    ///
    /// # Errors
    /// [`BusError::Key`] if the connection is closed.
    pub(super) async fn keep(mut self) -> Result<(), BusError> {
        // First, so that nothing is missed while the rig is asked what it is.
        let mut topics = Topics::of(&self.client).await?;
        if self.describe().await.is_ok() && self.hear(&mut topics).await.is_ok() {
            tracing::debug!(rig = self.client.rig(), "the connection was closed");
        }
        // Nobody wants to know if nothing can be written.
        drop(self.place.send(Heard::Foreign(topics.foreign())).await);
        Ok(())
    }

    /// Asks the rig what it is until it says it.
    async fn describe(&mut self) -> Result<(), Ended> {
        let request = pb::CommandRequest { who: connection::who(), ..Default::default() };
        loop {
            let asked = connection::ask(&self.client, Command::Status, &request, PATIENCE);
            let described = tokio::select! {
                () = ended(&mut self.ending) => return Err(Ended),
                reply = asked => reply.and_then(|reply| described(self.client.rig(), reply)),
            };
            match described {
                Ok(described) => return self.place.send(Heard::Described(Box::new(described))).await,
                Err(error) => self.place.send(Heard::Undescribed(in_words(&error))).await?,
            }
            self.wait().await?;
        }
    }

    /// Passes everything on until the connection is closed. States first: what was told of a frame before is then known.
    async fn hear(&mut self, topics: &mut Topics) -> Result<(), Ended> {
        loop {
            let begun = tokio::select! {
                biased;
                () = ended(&mut self.ending) => return Err(Ended),
                Some(info) = topics.infos.recv() => self.pass(&topics.infos, info, Heard::Info).await?,
                Some(event) = topics.events.recv() => self.pass(&topics.events, event, Heard::event).await?,
                Some(event) = topics.safety.recv() => self.pass(&topics.safety, event, Heard::Safety).await?,
                Some(state) = topics.stages.recv() => self.pass(&topics.stages, state, Heard::Stage).await?,
                Some(frame) = topics.frames.recv() => self.pass(&topics.frames, frame, Heard::frame).await?,
                else => return Ok(()),
            };
            if begun == Begun::Anew {
                // A service that was not believed while another one spoke for the rig has told what its sensor is, and nobody heard it.
                topics.infos = self.client.subscribe(History::All).await.map_err(|_| Ended)?;
            }
        }
    }

    /// Passes on a message, and before it what was missing and could be had after all.
    async fn pass<M: Published>(
        &mut self,
        topic: &Subscription<M>,
        message: M,
        heard: fn(M) -> Heard,
    ) -> Result<Begun, Ended> {
        let (gap, message) = (topic.gap(), heard(message));
        let begun = self.start.begun(topic.publishers(), &message);
        if begun == Begun::Anew {
            self.place.send(Heard::Restarted).await?;
            // Its files may be others now, or it is another rig of that name.
            self.describe().await?;
        }
        if let Some(gap) = gap {
            let found = self.ask_again(gap).await;
            let lost = gap.messages().saturating_sub(found.len() as u64);
            self.place.send(Heard::AskedAgain(gap.messages() - lost)).await?;
            for message in found {
                self.place.send(heard(message)).await?;
            }
            // Frames have numbers of their own, which count those, too, that were never sent.
            if lost > 0 && M::TOPIC != Topic::SensorFrame {
                self.place.send(Heard::Lost(M::TOPIC, lost)).await?;
            }
        }
        self.place.send(message).await?;
        Ok(begun)
    }

    /// What the publisher still keeps of the missing messages. It may take until the connection is there again.
    async fn ask_again<M: Published>(&mut self, gap: &Gap) -> Vec<M> {
        for _ in 0..QUESTIONS_MAX {
            let answer = tokio::select! {
                () = ended(&mut self.ending) => return Vec::new(),
                answer = self.client.ask_again(gap, PATIENCE) => answer,
            };
            match answer {
                Ok(Some(found)) => return found,
                Ok(None) => {}
                Err(_) => return Vec::new(),
            }
            if self.wait().await.is_err() {
                return Vec::new();
            }
        }
        Vec::new()
    }

    async fn wait(&mut self) -> Result<(), Ended> {
        tokio::select! {
            () = ended(&mut self.ending) => Err(Ended),
            () = sleep(AGAIN) => Ok(()),
        }
    }
}

impl Start {
    /// Whether the rig has started again before this message.
    fn begun(&mut self, publishers: usize, message: &Heard) -> Begun {
        let frame = if let Heard::Frame(frame) = message { Some(frame.seq) } else { None };
        let goes_back = frame.is_some_and(|frame| self.frame.is_some_and(|last| frame < last));
        if publishers > self.publishers || goes_back {
            *self = Self { publishers: publishers.max(self.publishers), frame };
            return Begun::Anew;
        }
        self.frame = frame.or(self.frame);
        Begun::Before
    }
}

impl Topics {
    async fn of(client: &Client) -> Result<Self, BusError> {
        Ok(Self {
            infos: client.subscribe(History::All).await?,
            stages: client.subscribe(History::All).await?,
            events: client.subscribe(History::All).await?,
            safety: client.subscribe(History::All).await?,
            frames: client.subscribe(History::All).await?,
        })
    }

    /// Messages of others than the rig's service.
    fn foreign(&self) -> u64 {
        let Self { infos, stages, events, safety, frames } = self;
        [infos.losses(), stages.losses(), events.losses(), safety.losses(), frames.losses()]
            .iter()
            .map(|losses| losses.foreign + losses.unreadable)
            .sum()
    }
}

/// Returns once the collection ends.
async fn ended(ending: &mut watch::Receiver<bool>) {
    // A sender that is gone ends it, too.
    drop(ending.wait_for(|ended| *ended).await);
}

/// The rig as its service describes it.
fn described(name: &str, reply: pb::CommandReply) -> anyhow::Result<Described> {
    let rig = Rig::from_toml(&reply.rig_toml).map_err(|error| {
        anyhow::anyhow!("its service does not describe it as a recording needs it: {error}")
    })?;
    anyhow::ensure!(rig.name == name, "its service describes another rig, {:?}", rig.name);
    // Only the name of a rig in service is sure to be the name of a folder, too.
    anyhow::ensure!(rig.service.is_some(), "its service describes a rig without sensor and stage");
    let simulated = rig.simulated || reply.health.is_some_and(|health| health.simulated);
    Ok(Described { rig, rig_toml: reply.rig_toml, simulated, version: reply.version })
}

#[cfg(test)]
#[path = "keeper_tests.rs"]
mod tests;
