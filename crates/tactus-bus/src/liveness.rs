//! Who is there: the service's token, and how clients see it.

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

/// How long a client waits to be told who is there when it connects.
const ROLL_CALL_TIMEOUT: Duration = Duration::from_secs(3);

/// Tells all clients that the service is ready; dropping it, or dying, tells them that it is not.
#[derive(Debug)]
#[must_use = "the service is alive only while it holds this"]
pub struct AliveToken {
    _token: LivelinessToken,
}

/// Whether a rig's service is ready, as it changes.
#[derive(Debug)]
pub struct Alive {
    rig: String,
    ready: watch::Receiver<BTreeSet<String>>,
    /// What the reader knows.
    known: bool,
}

/// The rigs that are ready, kept up to date.
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

    /// Waits for a state other than the one told last, at first that of the beginning, and tells it;
    /// `None` once the client is closed. Cancel-safe.
    pub async fn changed(&mut self) -> Option<bool> {
        let (rig, known) = (&self.rig, self.known);
        self.ready.wait_for(|ready| ready.contains(rig) != known).await.ok()?;
        self.known = !known;
        Some(self.known)
    }
}

impl Roster {
    /// Returns once it is known who is there.
    pub(crate) async fn keep(session: &Session) -> Result<Self, BusError> {
        let everyone = Keys::new("*").alive();
        // Only the latest state counts, and a watch keeps no more.
        let (told, ready) = watch::channel(BTreeSet::new());
        // Tells who is there already, then who comes and goes.
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
        // Nobody tells when all have been told. The end of a second roll call, behind the first on the
        // same link, does; its answers are left aside, for zenoh may leave out those it knows already.
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
