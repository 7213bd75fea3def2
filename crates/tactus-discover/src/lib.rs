//! Finds what a simulation is missing: where its predictions and measured frames disagree, which effect of the library
//! explains the difference, and how far the gap shrinks with that effect added to the model.

mod bic;
mod bins;
mod candidates;
mod contacts;
mod covariates;
mod discover;
mod discovery;
mod evidence;
mod faulty;
mod fit;
#[cfg(test)]
mod fixtures;
mod frames;
mod grams;
mod heldout;
mod lattice;
mod linear;
mod locate;
mod next;
mod noise;
mod not_shown;
mod parallel;
mod predictor;
mod prepare;
mod random_walk;
mod rivals;
mod rng;
mod scale;
mod score;
mod search;
mod spectrum;
mod structured;
mod verdict;
mod wiring;

pub use discover::{DiscoverError, Known, Options, Progress, Rule, discover, predict};
pub use discovery::{
    AddedEffect, BaseModel, Curve, Discovery, ElementGap, Estimated, Final, Floor, Gap, GlobalTest, Level,
    NextExperiment, NotShown, Point, Round, RunWalks, Split, Structured, TriedEffect, Unexplained, Verdict,
};
pub use frames::Frames;
pub use tactus_calibrate::{FaultKind, FaultyElement};
