//! Liveliness: the service's tokens, and the clients' view of them.
//!
//! A service holds two tokens of each rig. `tactus/<rig>/service/<instance>` says from its start which session on the bus is
//! the rig's: clients believe the answers and messages of that session only. `tactus/<rig>/alive` says that it is ready.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    future::pending,
    time::Duration,
};

use tactus_schema::key::Keys;
use tokio::sync::watch;
use zenoh::{
    Session,
    liveliness::LivelinessToken,
    pubsub::Subscriber,
    sample::{Sample, SampleKind},
    session::ZenohId,
};

use crate::BusError;

/// The keys of both tokens. For each key that a client asks for, a zenoh node compares every token with every key that the asked one matches:
/// with `tactus/**`, which all keys of all rigs match, a client cost a service of 800 rigs a second of the processor.
const ANNOUNCEMENTS: [&str; 2] = ["tactus/*/alive", "tactus/*/service/*"];
/// Nobody has such a key. It has a wild card for the reason that [`heard`](crate::topic::heard) gives.
const NOBODY: &str = "tactus/nobody$*";
/// Time limit for the list of services when a client connects.
const ROLL_CALL_TIMEOUT: Duration = Duration::from_secs(3);

/// Instances of one rig that are remembered, so that their last messages are still believed after they have ended.
const REMEMBERED: usize = 16;
/// Rigs that a client keeps in mind; announcements of further ones are ignored.
const SERVICES_MAX: usize = 16_384;
/// Running instances of one rig that a client keeps in mind.
const INSTANCES_MAX: usize = 64;

/// Shows clients that the service is ready. They see it disappear when it is dropped or the process dies.
#[derive(Debug)]
#[must_use = "the service is alive only while it holds this"]
pub struct AliveToken {
    _token: LivelinessToken,
}

/// Shows clients which session is the service's.
#[derive(Debug)]
pub(crate) struct InstanceToken {
    _token: LivelinessToken,
}

/// Follows whether a rig's service is ready.
#[derive(Debug)]
pub struct Alive {
    rig: String,
    known: watch::Receiver<Known>,
    /// The state that was reported last.
    told: bool,
}

/// The services on the bus, kept up to date.
#[derive(Debug)]
pub(crate) struct Roster {
    known: watch::Receiver<Known>,
    _subscribers: [Subscriber<()>; 2],
}

/// Which sessions on the bus speak for one rig.
#[derive(Debug, Clone)]
pub(crate) struct Trust {
    rig: String,
    known: watch::Receiver<Known>,
}

/// The announced services.
#[derive(Debug, Default)]
pub(crate) struct Known {
    /// Rigs that are ready.
    ready: BTreeSet<String>,
    /// Running instances of each rig in the order of their announcements.
    running: BTreeMap<String, Vec<ZenohId>>,
    /// Instances that speak for their rig, the newest last. An instance that is announced while another one speaks for
    /// the same rig does not, until that one has ended.
    believed: BTreeMap<String, VecDeque<ZenohId>>,
}

/// What an announcement is about.
#[derive(Debug, PartialEq, Eq)]
enum Announced<'a> {
    Alive(&'a str),
    Instance(&'a str, ZenohId),
}

impl AliveToken {
    pub(crate) async fn declare(session: &Session, keys: &Keys) -> Result<Self, BusError> {
        Ok(Self { _token: token(session, &keys.alive()).await? })
    }
}

impl InstanceToken {
    pub(crate) async fn declare(session: &Session, keys: &Keys) -> Result<Self, BusError> {
        Ok(Self { _token: token(session, &keys.instance(&session.zid().to_string())).await? })
    }
}

async fn token(session: &Session, key: &str) -> Result<LivelinessToken, BusError> {
    session.liveliness().declare_token(key.to_owned()).await.map_err(BusError::key(key))
}

impl Alive {
    /// True if the service is ready now.
    pub fn now(&self) -> bool {
        self.known.borrow().ready.contains(&self.rig)
    }

    /// Waits for a change and returns the new state; `None` once the client is closed. The first change is relative to the
    /// state at creation. Cancel-safe.
    pub async fn changed(&mut self) -> Option<bool> {
        let (rig, told) = (&self.rig, self.told);
        self.known.wait_for(|known| known.ready.contains(rig) != told).await.ok()?;
        self.told = !told;
        Some(self.told)
    }
}

impl Trust {
    /// True if the session speaks for the rig; `None` while no session does.
    pub(crate) fn has(&self, session: &ZenohId) -> Option<bool> {
        self.known.borrow().believes(&self.rig, session)
    }

    /// As [`Trust::has`], once a session speaks for the rig; `None` once the client is closed. Cancel-safe.
    pub(crate) async fn wait(&mut self, session: &ZenohId) -> Option<bool> {
        if let Some(has) = self.has(session) {
            return Some(has);
        }
        let rig = self.rig.clone();
        self.known
            .wait_for(|known| known.believes(&rig, session).is_some())
            .await
            .ok()?
            .believes(&rig, session)
    }

    /// Waits until the service that speaks for the rig does so no longer; if none speaks now, the first that will. Cancel-safe.
    pub(crate) fn ended(&self) -> impl Future<Output = ()> + use<> {
        let Self { rig, mut known } = self.clone();
        let mut first = known.borrow().speaks(&rig);
        let has_ended = move |known: &Known| {
            let now = known.speaks(&rig);
            first = first.or(now);
            now != first
        };
        async move {
            if known.wait_for(has_ended).await.is_err() {
                // The client is closed, and so are its queries.
                pending::<()>().await;
            }
        }
    }
}

impl Known {
    /// False for a session that is not believed while another one is; `None` without any.
    fn believes(&self, rig: &str, session: &ZenohId) -> Option<bool> {
        if self.believed.get(rig).is_some_and(|believed| believed.contains(session)) {
            return Some(true);
        }
        self.speaks(rig).map(|_| false)
    }

    /// The running instance that is believed.
    fn speaks(&self, rig: &str) -> Option<ZenohId> {
        let running = self.running.get(rig)?;
        self.believed.get(rig)?.iter().rev().find(|id| running.contains(id)).copied()
    }

    fn on_token(&mut self, announced: &Announced<'_>, kind: SampleKind) {
        match (announced, kind) {
            (Announced::Alive(rig), SampleKind::Put) => {
                if self.ready.len() < SERVICES_MAX {
                    self.ready.insert((*rig).to_owned());
                }
            }
            (Announced::Alive(rig), SampleKind::Delete) => {
                self.ready.remove(*rig);
            }
            (Announced::Instance(rig, id), SampleKind::Put) => {
                if self.running.len() >= SERVICES_MAX && !self.running.contains_key(*rig) {
                    return;
                }
                let running = self.running.entry((*rig).to_owned()).or_default();
                if running.len() < INSTANCES_MAX && !running.contains(id) {
                    running.push(*id);
                    self.believe_the_first(rig);
                }
            }
            (Announced::Instance(rig, id), SampleKind::Delete) => {
                if let Some(running) = self.running.get_mut(*rig) {
                    running.retain(|run| run != id);
                    if running.is_empty() {
                        self.running.remove(*rig);
                    }
                }
                self.believe_the_first(rig);
            }
        }
    }

    /// Believes the longest running instance of a rig that nobody speaks for.
    fn believe_the_first(&mut self, rig: &str) {
        if self.speaks(rig).is_none()
            && let Some(first) = self.running.get(rig).and_then(|running| running.first())
        {
            let believed = self.believed.entry(rig.to_owned()).or_default();
            believed.push_back(*first);
            if believed.len() > REMEMBERED {
                believed.pop_front();
            }
        }
    }

    /// Believes an instance although another one was announced first: the client is connected to it.
    fn prefer(&mut self, neighbours: &[ZenohId]) {
        for (rig, running) in &self.running {
            for id in running.iter().filter(|id| neighbours.contains(id)) {
                self.believed.insert(rig.clone(), VecDeque::from([*id]));
            }
        }
    }
}

impl Roster {
    /// Returns once the services are known.
    pub(crate) async fn keep(session: &Session) -> Result<Self, BusError> {
        // Only the latest state counts, and a watch keeps no more.
        let (to_known, known) = watch::channel(Known::default());
        // Reports present tokens first, then changes.
        let listen = async |key: &'static str| {
            let to_known = to_known.clone();
            let hear = move |sample: Sample| {
                if let Some(announced) = announced(sample.key_expr().as_str()) {
                    to_known.send_modify(|known| known.on_token(&announced, sample.kind()));
                }
            };
            let subscriber = session.liveliness().declare_subscriber(key).history(true).callback(hear);
            subscriber.await.map_err(BusError::key(key))
        };
        let [alive, instances] = ANNOUNCEMENTS;
        let subscribers = [listen(alive).await?, listen(instances).await?];
        // A subscriber does not show when all present tokens were reported. The end of a query on the same link, sent after the
        // subscriptions, does.
        let roll_call = session.liveliness().get(NOBODY).timeout(ROLL_CALL_TIMEOUT);
        let roll_call = roll_call.await.map_err(BusError::key(NOBODY))?;
        while roll_call.recv_async().await.is_ok() {}
        let neighbours: Vec<_> = session.info().peers_zid().await.collect();
        to_known.send_modify(|known| known.prefer(&neighbours));
        Ok(Self { known, _subscribers: subscribers })
    }

    /// Shows each change of the roster, from now on.
    pub(crate) fn changes(&self) -> watch::Receiver<Known> {
        let mut changes = self.known.clone();
        changes.mark_unchanged();
        changes
    }

    /// Names of the rigs that are ready now, sorted.
    pub(crate) fn rigs(&self) -> Vec<String> {
        self.known.borrow().ready.iter().cloned().collect()
    }

    /// Names of the rigs whose services run now, ready or not, sorted.
    pub(crate) fn served(&self) -> Vec<String> {
        self.known.borrow().running.keys().cloned().collect()
    }

    /// Names of the rigs, ready or not, whose service is one of these sessions, sorted.
    pub(crate) fn rigs_of(&self, sessions: &[ZenohId]) -> Vec<String> {
        let known = self.known.borrow();
        let of = |rig: &&String| known.speaks(rig).is_some_and(|id| sessions.contains(&id));
        known.running.keys().filter(of).cloned().collect()
    }

    /// True if the rig is ready.
    pub(crate) fn is_ready(&self, rig: &str) -> bool {
        self.known.borrow().ready.contains(rig)
    }

    /// The instances that run, with their rigs.
    pub(crate) fn running(&self) -> Vec<(String, ZenohId)> {
        let known = self.known.borrow();
        let of_rig = |(rig, ids): (&String, &Vec<ZenohId>)| {
            let rig = rig.clone();
            ids.clone().into_iter().map(move |id| (rig.clone(), id))
        };
        known.running.iter().flat_map(of_rig).collect()
    }

    /// True if more than one instance says that it is the rig's, and none of them is at the other end of the connection.
    pub(crate) fn is_ambiguous(&self, rig: &str, neighbours: &[ZenohId]) -> bool {
        let known = self.known.borrow();
        let running = known.running.get(rig).map(Vec::as_slice).unwrap_or_default();
        running.len() > 1 && !running.iter().any(|id| neighbours.contains(id))
    }

    /// Follows one rig.
    pub(crate) fn alive(&self, rig: &str) -> Alive {
        let known = self.known.clone();
        let told = known.borrow().ready.contains(rig);
        Alive { rig: rig.to_owned(), known, told }
    }

    /// The sessions that speak for a rig.
    pub(crate) fn trust(&self, rig: &str) -> Trust {
        Trust { rig: rig.to_owned(), known: self.known.clone() }
    }
}

/// Reads `tactus/<rig>/alive` and `tactus/<rig>/service/<instance>`.
fn announced(key: &str) -> Option<Announced<'_>> {
    let mut parts = key.strip_prefix("tactus/")?.split('/');
    let rig = parts.next()?;
    let announced = match (parts.next()?, parts.next()) {
        ("alive", None) => Announced::Alive(rig),
        ("service", Some(instance)) => Announced::Instance(rig, instance.parse().ok()?),
        _ => return None,
    };
    parts.next().is_none().then_some(announced)
}

#[cfg(test)]
#[path = "liveness_tests.rs"]
mod tests;
