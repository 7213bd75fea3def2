//! Finds what a simulation is missing: where its predictions and measured frames disagree, which effect of the library
//! explains the difference, and how far the gap shrinks with that effect added to the model.
//!
//! Each module uses only those before it: `numbers`, `progress`, `data`, `fit`, `search`, `next`, `verdict`, `discover`. A test holds this:
//! `xtask/tests/it/modules.rs`.

#[cfg(test)]
mod constants_tests;
mod data;
mod discover;
mod fit;
#[cfg(test)]
mod fixtures;
mod next;
mod numbers;
mod progress;
mod search;
mod verdict;

pub use data::{DiscoverError, Floor, Frames, Known, Mismatch, TooLittle};
pub use discover::{confirm, discover, predict};
pub use fit::RunWalks;
pub use next::{
    Experiments, LeftOut, NextExperiment, OpenQuestion, Plan, Rehearsal, RehearsalOrder, WORTH_Z,
};
pub use progress::{Progress, Stage, TimeLeft};
pub use search::{
    Because, Contest, Curve, Gap, GivenUp, NoDraft, NotShown, Options, Point, RefutedFormula, Rivalry, Round,
    Rule, TriedEffect, rival_in_words,
};
pub use tactus_calibrate::{FaultKind, FaultyElement};

/// Constants that `tactus-bench evidence` looks at on tuning sets, and the level of the tests.
pub mod constants {
    pub use crate::search::{ALPHA, FORM_SHARE, LEFT_SHARE, MISFIT_SHARE, SET_PROBABILITY, TAKEN_SHARE};
    pub use crate::verdict::{DRIFTS, NEAR_CLOSES};
}
pub use verdict::{
    AddedEffect, BaseModel, Closed, Confirmation, Discovery, DraftedEffect, ElementGap, Estimated, Final,
    FittedCurve, FittedKnot, GlobalTest, Inclusion, Level, Split, Stair, Structured, Unexplained, Verdict,
};
