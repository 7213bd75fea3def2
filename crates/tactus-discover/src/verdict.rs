//! The verdict: what was found, how much of the gap it closes, and what is left.
//!
//! A model's residual on held-out presses is noise and structure. [`structured`] bounds the structure from above, in units of the noise.
//! The verdict depends on five things: whether effects were added, whether a test rejects the base model, whether one rejects the grown
//! model, whether that is further from the held-out presses than the base model, and that bound ([`judged`]). One of the tests is of the
//! noise ([`own_noise`]): whether elements share it, and single readings. How much of the gap is closed, which may be far below the noise,
//! is measured so that the noise cancels ([`closed`]).
//!
//! An added effect must be confirmed ([`mod@confirmed`]): fitted presses that its parameters have not seen, by five folds, must be nearer to
//! the model with it than to the model without. The held-out presses are opened for the figures and the verdict, and to say of a name that it
//! is only the nearest, because it closes less of the gap there than an effect closes of its own physics.
//!
//! What is left and significant is drafted ([`drafting`]), and names that a draft makes needless give way to it. The report is a
//! [`Discovery`] ([`conclude()`]).

mod closed;
mod conclude;
mod confirmed;
mod discovery;
mod drafting;
mod held_out;
mod judged;
mod own_noise;
mod structured;

pub use closed::Closed;
pub(crate) use conclude::{SearchOutcome, cannot_judge, conclude};
pub(crate) use confirmed::confirmed;
pub use discovery::{
    AddedEffect, BaseModel, Discovery, ElementGap, Estimated, Final, FittedCurve, FittedKnot, GlobalTest,
    Inclusion, Level, Split, Stair, Unexplained, Verdict,
};
pub(crate) use drafting::confirmation;
pub use drafting::{Confirmation, DraftedEffect};
pub use structured::Structured;
