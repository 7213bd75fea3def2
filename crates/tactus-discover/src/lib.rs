//! What a simulation is missing: finds where it and measured frames disagree, names the effect, adds it to the model,
//! and shows the gap shrink.

mod discovery;

pub use discovery::{
    Candidate, Curve, Discovery, ElementGap, Estimated, Final, Gap, GlobalTest, Level, NextExperiment, NotShown,
    Point, Round, Split, Step, Unexplained, Verdict,
};
