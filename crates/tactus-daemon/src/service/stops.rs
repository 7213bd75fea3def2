//! Answers stops, for all rigs.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tactus_bus::CommandCall;
use tactus_schema::pb;
use tokio::sync::mpsc;

use super::commands::CommandDesk;

/// The desks of the rigs that are up, by the names of the rigs.
#[derive(Clone, Default)]
pub(crate) struct Desks(Arc<Mutex<BTreeMap<Arc<str>, Arc<CommandDesk>>>>);

impl Desks {
    pub(super) fn add(&self, rig: &Arc<str>, desk: &Arc<CommandDesk>) {
        self.lock().insert(Arc::clone(rig), Arc::clone(desk));
    }

    pub(super) fn remove(&self, rig: &str) {
        self.lock().remove(rig);
    }

    /// All of them, or that of one rig if it is up.
    pub(crate) fn of(&self, rig: Option<&str>) -> Vec<(Arc<str>, Arc<CommandDesk>)> {
        let of = |(name, desk): (&Arc<str>, &Arc<CommandDesk>)| (Arc::clone(name), Arc::clone(desk));
        match rig {
            Some(rig) => self.lock().get_key_value(rig).map(of).into_iter().collect(),
            None => self.lock().iter().map(of).collect(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Arc<str>, Arc<CommandDesk>>> {
        // Nothing panics under this lock, and no frame takes it.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Blocks a thread of its own: stops want neither a lease nor a free task. All that wait are done before the first is answered,
/// because an answer may wait for its client.
pub(super) fn answer(desks: &Desks, mut stops: mpsc::Receiver<Box<CommandCall>>) {
    while let Some(first) = stops.blocking_recv() {
        let mut calls = vec![first];
        while let Ok(call) = stops.try_recv() {
            calls.push(call);
        }
        let stop = |call: Box<CommandCall>| {
            let concerned = desks.of(call.rig.as_deref());
            for (_, desk) in &concerned {
                desk.stop(&call.request);
            }
            (call, concerned)
        };
        let stopped: Vec<_> = calls.into_iter().map(stop).collect();
        for (call, concerned) in stopped {
            let mut answers: Vec<_> = concerned.iter().map(|(_, desk)| desk.stopped()).collect();
            if let Some(rig) = call.rig.filter(|_| answers.is_empty()) {
                answers.push(of_missing(&rig));
            }
            call.reply.reply_for_all(answers);
        }
    }
}

/// A rig that is not up moves nothing.
fn of_missing(rig: &str) -> pb::CommandReply {
    let note = "the rig is not up: `tactus status` says why".to_owned();
    pb::CommandReply { ok: true, rig: rig.to_owned(), note, ..Default::default() }
}
