//! What a discovery is doing, and how much of its time is left then.
//!
//! How long a discovery takes depends on what the data hold. So the time left is a range, in times of the time so far: from many
//! discoveries, for each stage, the quantiles of
//!
//! ```text
//! (time of the whole discovery - time so far) / time so far
//! ```
//!
//! over moments evenly in time. At a random moment of such a discovery the time left is within the range with a probability of 80 %. The
//! speed of the machine and the number of frames cancel, as far as all stages depend on them in the same way.

use std::sync::{Mutex, PoisonError};

/// Progress of a discovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Progress {
    /// The current activity, such as `fitting hysteresis`.
    pub what: String,
    /// The stage to which it belongs.
    pub stage: Stage,
}

/// A part of a discovery, in the usual order. The search goes back where a name has lost its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The base model is recalibrated.
    Base,
    /// The residual of the base model is located.
    Locating,
    /// The scatter of that residual is tested.
    Scattering,
    /// All effects are scored beside those that the model has.
    Scoring {
        /// Number of effects in the model.
        names: usize,
    },
    /// The scores are tested against noise.
    Testing {
        /// As in [`Stage::Scoring`].
        names: usize,
    },
    /// The best effects are fitted.
    Fitting {
        /// As in [`Stage::Scoring`].
        names: usize,
    },
    /// Each effect is taken away in turn.
    Withdrawing,
    /// An effect is compared with others in its place.
    Comparing {
        /// Effects that are still to be compared, this one included.
        left: usize,
    },
    /// Formulas are compared with knots.
    Forms,
    /// The effects are compared with rivals without a name.
    Contests,
    /// Folds of presses confirm the effects.
    Confirming,
    /// The residual of the grown model is located.
    LocatingLeft,
    /// The held-out presses are judged.
    Judging,
    /// What is left is drafted.
    Drafting,
    /// Experiments are rehearsed.
    Planning {
        /// Pairs of explanations that an experiment should separate.
        questions: usize,
    },
}

/// For each stage, the time left in times of the time so far: quantiles of 10, 50 and 90 %. `just discovery-progress` prints this table.
#[rustfmt::skip]
const LEFT: [(&str, [f64; 3]); 24] = [
    ("base", [25.67, 79.00, 399.00]),
    ("comparing several", [0.59, 1.03, 1.81]),
    ("comparing the last", [0.10, 0.29, 0.86]),
    ("comparing the last two", [0.17, 0.45, 1.91]),
    ("confirming", [0.04, 0.11, 0.34]),
    ("contests", [0.11, 0.22, 0.38]),
    ("drafting", [0.17, 0.78, 2.10]),
    ("fitting beside none", [1.14, 1.76, 4.19]),
    ("fitting beside one", [0.29, 0.97, 5.80]),
    ("fitting beside several", [0.49, 1.55, 4.03]),
    ("forms", [0.05, 0.12, 0.45]),
    ("judging", [0.03, 0.07, 1.52]),
    ("locating", [3.21, 11.12, 35.36]),
    ("locating what is left", [0.03, 0.08, 0.25]),
    ("planning", [0.02, 0.13, 0.41]),
    ("planning without a question", [0.00, 0.02, 0.05]),
    ("scattering", [2.05, 5.67, 11.51]),
    ("scoring beside none", [0.34, 2.36, 6.84]),
    ("scoring beside one", [0.36, 0.80, 2.15]),
    ("scoring beside several", [0.59, 1.34, 4.33]),
    ("testing beside none", [0.10, 1.55, 3.38]),
    ("testing beside one", [0.21, 0.35, 2.16]),
    ("testing beside several", [0.39, 0.83, 2.76]),
    ("withdrawing", [0.35, 0.96, 1.71]),
];

impl Stage {
    /// Its row of the table. Larger numbers are in one row.
    pub fn name(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::Locating => "locating",
            Self::Scattering => "scattering",
            Self::Scoring { names: 0 } => "scoring beside none",
            Self::Scoring { names: 1 } => "scoring beside one",
            Self::Scoring { .. } => "scoring beside several",
            Self::Testing { names: 0 } => "testing beside none",
            Self::Testing { names: 1 } => "testing beside one",
            Self::Testing { .. } => "testing beside several",
            Self::Fitting { names: 0 } => "fitting beside none",
            Self::Fitting { names: 1 } => "fitting beside one",
            Self::Fitting { .. } => "fitting beside several",
            Self::Withdrawing => "withdrawing",
            Self::Comparing { left: 0 | 1 } => "comparing the last",
            Self::Comparing { left: 2 } => "comparing the last two",
            Self::Comparing { .. } => "comparing several",
            Self::Forms => "forms",
            Self::Contests => "contests",
            Self::Confirming => "confirming",
            Self::LocatingLeft => "locating what is left",
            Self::Judging => "judging",
            Self::Drafting => "drafting",
            Self::Planning { questions: 0 } => "planning without a question",
            Self::Planning { .. } => "planning",
        }
    }

    /// How much of the time is left in this stage.
    pub fn left(self) -> Option<TimeLeft> {
        TimeLeft::in_stage(self.name())
    }
}

/// The time left of a discovery, in times of the time so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeLeft {
    least: f64,
    median: f64,
    most: f64,
}

impl TimeLeft {
    /// That in the stage of this name.
    pub fn in_stage(name: &str) -> Option<Self> {
        let (_, [least, median, most]) = *LEFT.iter().find(|(known, _)| *known == name)?;
        Some(Self { least, median, most })
    }

    /// A range that holds the time left with a probability of 80 %.
    pub fn range_s(self, elapsed_s: f64) -> [f64; 2] {
        [self.least * elapsed_s, self.most * elapsed_s]
    }

    /// The share of the discovery that is done if the median is left, 0 to 1.
    pub fn share_done(self) -> f64 {
        1.0 / (1.0 + self.median)
    }
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

    /// The last stage begins.
    pub(crate) fn enter_planning(&self, questions: usize) {
        self.enter(Stage::Planning { questions }, "planning what to measure next");
    }

    /// An activity within the stage begins.
    pub(crate) fn tell(&self, what: &str) {
        let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        (self.progress)(Progress { what: what.to_owned(), stage });
    }
}

#[cfg(test)]
#[path = "progress_tests.rs"]
mod tests;
