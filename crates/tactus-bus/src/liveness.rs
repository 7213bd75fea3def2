//! Liveliness: the service's token, and the clients' view of it.

use std::{collections::BTreeSet, time::Duration};

use tactus_schema::key::Keys;
use tokio::sync::watch;
use zenoh::{
    Session,
    liveliness::LivelinessToken,
    pubsub::Subscriber,
    sample::{Sample, SampleKind},
};

use crate::BusError;

/// Time limit for the list of ready rigs when a client connects.
const ROLL_CALL_TIMEOUT: Duration = Duration::from_secs(3);

/// Shows clients that the service is ready. They see it disappear when it is dropped or the process dies.
#[derive(Debug)]
#[must_use = "the service is alive only while it holds this"]
pub struct AliveToken {
    _token: LivelinessToken,
}

/// Follows whether a rig's service is ready.
#[derive(Debug)]
pub struct Alive {
    rig: String,
    ready: watch::Receiver<BTreeSet<String>>,
    /// The state told last.
    known: bool,
}

/// The set of ready rigs, kept up to date.
#[derive(Debug)]
pub(crate) struct Roster {
    ready: watch::Receiver<BTreeSet<String>>,
    _subscriber: Subscriber<()>,
}

impl AliveToken {
    pub(crate) async fn declare(session: &Session, keys: &Keys) -> Result<Self, BusError> {
        let key = keys.alive();
        let token = session.liveliness().declare_token(&key).await.map_err(BusError::key(&key))?;
        Ok(Self { _token: token })
    }
}

impl Alive {
    /// True if the service is ready now.
    pub fn now(&self) -> bool {
        self.ready.borrow().contains(&self.rig)
    }

    /// Waits for a change and returns the new state; `None` once the client is closed. The first change is relative to the
    /// state at creation. Cancel-safe.
    pub async fn changed(&mut self) -> Option<bool> {
        let (rig, known) = (&self.rig, self.known);
        self.ready.wait_for(|ready| ready.contains(rig) != known).await.ok()?;
        self.known = !known;
        Some(self.known)
    }
}

impl Roster {
    /// Returns once the ready rigs are known.
    pub(crate) async fn keep(session: &Session) -> Result<Self, BusError> {
        let everyone = Keys::new("*").alive();
        // Only the latest state counts, and a watch keeps no more.
        let (told, ready) = watch::channel(BTreeSet::new());
        // Reports present tokens first, then changes.
        let subscriber = session
            .liveliness()
            .declare_subscriber(&everyone)
            .history(true)
            .callback(move |sample: Sample| {
                let Some(rig) = rig_of(sample.key_expr().as_str()) else { return };
                told.send_modify(|ready| {
                    match sample.kind() {
                        SampleKind::Put => ready.insert(rig.to_owned()),
                        SampleKind::Delete => ready.remove(rig),
                    };
                });
            })
            .await
            .map_err(BusError::key(&everyone))?;
        // The subscriber does not show when all present tokens were reported. The end of a query on the same link, sent
        // after the subscription, does. Its replies are ignored, because zenoh may omit known tokens.
        let roll_call = session
            .liveliness()
            .get(&everyone)
            .timeout(ROLL_CALL_TIMEOUT)
            .await
            .map_err(BusError::key(&everyone))?;
        while roll_call.recv_async().await.is_ok() {}
        Ok(Self { ready, _subscriber: subscriber })
    }

    /// Names of the rigs that are ready now, sorted.
    pub(crate) fn rigs(&self) -> Vec<String> {
        self.ready.borrow().iter().cloned().collect()
    }

    /// Follows one rig.
    pub(crate) fn alive(&self, rig: &str) -> Alive {
        let ready = self.ready.clone();
        let known = ready.borrow().contains(rig);
        Alive { rig: rig.to_owned(), ready, known }
    }
}

/// The rig in `tactus/<rig>/alive`.
fn rig_of(key: &str) -> Option<&str> {
    key.split('/').nth(1)
}
