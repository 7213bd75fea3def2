//! What a simulation is missing: finds where it and measured frames disagree, names the effect, adds it to the model,
//! and shows the gap shrink.

#[cfg(test)]
mod bench;
mod bic;
mod candidates;
mod contacts;
mod covariates;
mod discover;
mod discovery;
mod fit;
mod frames;
mod heldout;
mod lattice;
mod linear;
mod locate;
mod next;
mod noise;
mod not_shown;
mod parallel;
mod prepare;
mod rng;
mod rows;
mod scale;
mod score;
mod search;
mod sensor;
mod spectrum;
mod telling;
mod wander;
mod wiring;

pub use discover::{DiscoverError, Known, Options, Progress, Rule, discover, predict};
pub use discovery::{
    Base, Candidate, Curve, Discovery, ElementGap, Estimated, Final, Gap, GlobalTest, Level, NextExperiment,
    NotShown, Point, Round, RunWander, Split, Step, Unexplained, Verdict,
};
pub use frames::{Frame, Frames};
