//! Fits of a whole model to the bins: gains, baselines, point spread and effects together.
//!
//! ```text
//! cost = sum over bins b and elements e of w_b w_e (counts_be - predicted_be)^2        w = 1 / variance of the bin's mean
//! ```
//!
//! [`predictor`] computes the prediction with the pipeline of `tactus-model`. One pass over the data gives the [`sums`] of products of all
//! derivatives; [`elimination`] takes off what [`gains`] and baselines fit, where baselines may follow a [`random_walk`]; [`grams`] are what
//! is left. [`problem`] takes damped Gauss-Newton steps in the spread and in the parameters of the
//! effects, each on its own [`scale`]; [`knots`] of free curves stay within their class. [`folds`] measures a model on fitted presses that
//! its parameters have not seen, [`heldout`] on those that were not fitted, and [`estimates`] says how far it is
//! off there because its numbers were estimated. [`prepare`] splits the data and fits the base model, from which the search starts.
//!
//! Each file names its sources.

mod elimination;
mod estimates;
mod folds;
mod gains;
mod grams;
mod heldout;
mod knots;
mod parameters;
mod predictor;
mod prepare;
mod problem;
mod random_walk;
mod scale;
mod sums;
mod tiles;
mod totals;

pub(crate) use folds::{FoldsOf, gains_by_folds};
pub(crate) use grams::Grams;
pub(crate) use heldout::LOUD;
pub(crate) use knots::{hat, of_formulas, places, table_places};
pub(crate) use parameters::{Parameters, Term};
pub(crate) use predictor::Predictor;
pub(crate) use prepare::Prepared;
pub(crate) use problem::{Fitted, Free, Problem, undone};
pub use random_walk::RunWalks;
pub(crate) use random_walk::{RANDOM_WALK, RandomWalk, is_random_walk};
pub(crate) use scale::Scale;
pub(crate) use sums::Direction;
