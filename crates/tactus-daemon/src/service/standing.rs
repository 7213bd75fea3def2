//! How the rigs stand, for systemd and the log.

use std::collections::BTreeMap;
use std::sync::Arc;

use tokio::sync::watch;

use crate::notify::Systemd;

/// How a rig stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Standing {
    /// Its devices are being opened.
    Starts,
    /// Frames have come.
    Flows,
    /// It failed, and is started again later.
    Off(String),
}

/// How all rigs stand.
#[derive(Debug, Clone, Default)]
pub(super) struct Standings(Arc<watch::Sender<BTreeMap<Arc<str>, Standing>>>);

impl Standings {
    pub(super) fn set(&self, rig: &Arc<str>, standing: Standing) {
        self.0.send_modify(|all| {
            all.insert(Arc::clone(rig), standing);
        });
    }

    /// Tells systemd that the service is ready as soon as the frames of one rig flow: a rig whose device is missing must not keep
    /// the others waiting. Then tells each change.
    pub(super) async fn tell(&self, systemd: &Systemd) {
        let mut all = self.0.subscribe();
        let mut is_ready = false;
        let mut told = String::new();
        loop {
            let (flow, words) = in_words(&all.borrow_and_update());
            if flow && words != told {
                if std::mem::replace(&mut is_ready, true) {
                    systemd.status(&words);
                } else {
                    systemd.ready(&words);
                }
                told = words;
            }
            if all.changed().await.is_err() {
                return;
            }
        }
    }
}

/// Rigs that systemd's line names.
const NAMED_MAX: usize = 5;

/// Whether the frames of any rig flow, and systemd's line.
fn in_words(all: &BTreeMap<Arc<str>, Standing>) -> (bool, String) {
    let flow = all.values().filter(|standing| **standing == Standing::Flows).count();
    if let (Some((rig, _)), 1) = (all.first_key_value(), all.len()) {
        return (flow == 1, format!("rig {rig}: frames flow"));
    }
    let mut missing = all.iter().filter(|(_, of)| **of != Standing::Flows).map(|(rig, _)| &**rig);
    let named: Vec<_> = missing.by_ref().take(NAMED_MAX).collect();
    let without = match (named.is_empty(), missing.count()) {
        (true, _) => String::new(),
        (false, 0) => format!(", not those of {}", named.join(", ")),
        (false, more) => format!(", not those of {} and {more} more", named.join(", ")),
    };
    (flow > 0, format!("frames of {flow} of {} rigs flow{without}", all.len()))
}
