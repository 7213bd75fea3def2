//! What a discovery is doing.

use std::sync::{Mutex, PoisonError};

/// Progress of a discovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Progress {
    /// The current activity, such as `round 2: fitting hysteresis`.
    pub what: String,
    /// The part of the discovery to which it belongs.
    pub stage: Stage,
}

/// A part of a discovery, in the usual order. The search goes back where a name has lost its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The base model is recalibrated.
    Base,
    /// The residual of the base model is located.
    Locating,
    /// A round: all effects are scored beside those that the model has.
    Scoring {
        /// Number of effects in the model.
        names: usize,
    },
    /// The round's best effects are fitted.
    Fitting {
        /// As in the scoring.
        names: usize,
    },
    /// Each name is taken away in turn.
    Withdrawing {
        /// Number of effects in the model.
        names: usize,
    },
    /// A name is compared with others in its place.
    Comparing {
        /// Names that are still to be compared, this one included.
        left: usize,
    },
    /// Formulas are compared with knots.
    Forms,
    /// The names are compared with rivals that have none.
    Contests,
    /// Folds of presses confirm the names.
    Confirming {
        /// Number of effects in the model.
        names: usize,
    },
    /// The residual of the grown model is located.
    LocatingLeft,
    /// The held-out presses are judged.
    Judging,
    /// What is left is drafted.
    Drafting,
    /// Experiments are rehearsed.
    Planning,
}

/// Tells somebody what a discovery is doing.
pub(crate) struct Reporter<'a> {
    progress: &'a (dyn Fn(Progress) + Sync),
    stage: Mutex<Stage>,
}

impl<'a> Reporter<'a> {
    pub(crate) fn new(progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { progress, stage: Mutex::new(Stage::Base) }
    }

    /// A stage begins.
    pub(crate) fn enter(&self, stage: Stage, what: &str) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage;
        self.tell(what);
    }

    /// A further activity of the present stage begins.
    pub(crate) fn tell(&self, what: &str) {
        let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        (self.progress)(Progress { what: what.to_owned(), stage });
    }
}
