//! Fits of a whole model to the bins: gains, baselines, point spread and effects together.
//!
//! ```text
//! cost = sum over bins b and elements e of w_b w_e (counts_be - predicted_be)^2        w = 1 / variance of the bin's mean
//! ```
//!
//! [`predictor`] computes the prediction with the pipeline of `tactus-model`. One pass over the data gives the [`sums`] of products of all
//! derivatives, of which some are [`sparse`]; [`elimination`] takes off what [`gains`] and baselines fit, where baselines may follow a [`random_walk`]; [`grams`] are what
//! is left. [`problem`] takes damped Gauss-Newton steps in the spread and in the parameters of the
//! effects, each on its own [`scale`]; [`knots`] of free curves stay within their class. [`folds`] measures a model on fitted presses that
//! its parameters have not seen, [`heldout`] on those that were not fitted, and [`estimates`] says how far it is
//! off there because its numbers were estimated. [`prepare`] splits the data and fits the base model, from which the search starts.
//!
//! # Sources
//! Methods that others have published name them in their file: [`elimination`], [`folds`], [`knots`], [`problem`], [`random_walk`]. What
//! [`estimates`] computes is the variance of a prediction of linear least squares, as in any textbook. The rest is ours, and mostly
//! bookkeeping: `gains`, [`grams`], [`heldout`], `parameters`, [`predictor`], [`prepare`], [`scale`], [`sparse`], [`sums`], `tiles`, `totals`.
//!
//! # Constants
//!
//! *Derived*: from other numbers. *Convention*: chosen when it was written, and not changed since; no measurement says how much hangs on it.
//! *Cost*: a bound of time or memory. *Measured*: on sets, as the reason says. *Tried*: changed after runs on tuning sets, of which no recipe is
//! kept. *Default*: that of a script. A test compares the values with the code.
//!
//! | file | constant | value | kind | reason |
//! |---|---|---|---|---|
//! | elimination.rs | `OWN_LEAST` | `1e-6` | derived | the error of products in double precision |
//! | elimination.rs | `OWN_SHARE_LEAST` | `1e-3` | convention | keeps damping finite |
//! | estimates.rs | `SHOWN_LEAST` | `1e-6` | derived | the error of products in double precision |
//! | folds.rs | `FOLDS` | `5` | convention | five, as is usual; of presses, of elements, and of the blocks of a draft |
//! | folds.rs | `CLIP` | `4.0` | tried | of folds, and of flipped sums (`search/score.rs`); 3 on the first day, under coloured noise |
//! | gains.rs | `GAIN_RATIOS` | `[0.25, 4.0]` | convention | an element beyond has another fault (decision 0011) |
//! | gains.rs | `PIN_MARGIN` | `0.02` | convention | within 2 % of an end |
//! | gains.rs | `GAIN_ERROR_MAX` | `0.3` | convention | a gain that is worse known is not fitted |
//! | heldout.rs | `SURE_Z` | `2.0` | convention | two standard errors |
//! | heldout.rs | `LOUD` | `5.0` | convention | five standard deviations of the noise |
//! | knots.rs | `STEP` | `1e-3` | convention | small beside a range, large beside its rounding |
//! | knots.rs | `OF_LINE` | `10` | cost | knots are columns of a pass |
//! | knots.rs | `OF_TIMES` | `9` | cost | knots are columns of a pass |
//! | knots.rs | `OF_DELAYS` | `8` | cost | knots are columns of a pass |
//! | knots.rs | `OF_THRESHOLDS` | `8` | cost | knots are columns of a pass |
//! | knots.rs | `OF_WIDTHS` | `5` | cost | each is an image |
//! | knots.rs | `PRESSES_A_KNOT` | `4` | convention | what drifts holds for several presses |
//! | knots.rs | `OF_TIME_LINE` | `8..=24` | cost | 8 is as free as formulas |
//! | knots.rs | `OVER_THE_SENSOR` | `5` | cost | straight lines over four parts of the sensor |
//! | knots.rs | `OF_DEPTH_OR_TIME` | `8` | cost | the same over seven |
//! | knots.rs | `APART_MM` | `0.05` | convention | as places that count as one |
//! | knots.rs | `APART_S` | `1.0` | convention | shorter is no table of time |
//! | knots.rs | `WIDTHS` | `[1.4, 6.0]` | convention | narrower is the core's own width, wider is flat over the sensor |
//! | knots.rs | `LEAST_THRESHOLD` | `0.03` | convention | of the greatest |
//! | knots.rs | `LEAST_SPEED` | `0.01` | convention | of the greatest |
//! | predictor.rs | `IMAGES_MAX` | `200_000` | cost | 130 MB; 600,000 at first |
//! | prepare.rs | `PRESSES_LEAST` | `3` | convention | fewer give no scatter |
//! | prepare.rs | `BASE_ROUNDS` | `12` | cost | a fit ends by itself before |
//! | problem.rs | `COST_LEAST` | `0.05` | convention | far below one unit of likelihood |
//! | problem.rs | `COST_SHARE_LEAST` | `1e-4` | convention | the same, of a large cost |
//! | problem.rs | `TAKEN_UP_LEAST` | `0.1` | convention | saves rounds |
//! | problem.rs | `UNSEEN_SHARE` | `0.1` | tried | 0.01 at first |
//! | problem.rs | `LONG_FRAMES` | `1000` | convention | long beside the memory of the noise |
//! | random_walk.rs | `KNOTS` | `16` | derived | of one effect of the library |
//! | random_walk.rs | `KNOT_S_LEAST` | `3.0` | convention | as a block |
//! | random_walk.rs | `FINER_GAIN` | `10.0` | convention | 5 nats for twice the knots |
//! | random_walk.rs | `RATE_LEAST` | `1e-3` | convention | the ends of a grid in factors of `sqrt(2)` |
//! | random_walk.rs | `RATES` | `32` | tried | up to 47 noises per root second; 24 at first |
//! | scale.rs | `ORDERS` | `20.0` | convention | more than a factor of ten |
//! | scale.rs | `LOG_STEP` | `0.02` | convention | small beside a length of a curve |
//! | scale.rs | `STEP` | `1e-3` | convention | small beside a range, large beside its rounding |
//! | scale.rs | `LOG_STRIDE_MAX` | `1.5` | convention | a factor of 4.5 in a step |
//! | scale.rs | `STRIDE_MAX` | `0.25` | convention | a quarter of the range |
//! | sparse.rs | `FEW_MAX` | `4` | derived | two knots around a value, of two covariates |
//! | sums.rs | `CHUNK_BINS` | `[64, 256]` | cost | the memory of columns |
//! | sums.rs | `CHUNK_COLUMNS` | `32_768` | cost | the same |
//! | sums.rs | `TILE_BINS` | `4` | cost | the cache of a processor |
//! | sums.rs | `BLOCKS_MAX` | `400` | cost | the memory of flipped sums |
//! | sums.rs | `GAIN_SHARE` | `1e-3` | convention | a small step of a product |
//! | tiles.rs | `PANEL` | `128` | cost | the cache of a processor |

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
mod sparse;
mod sums;
mod tiles;
mod totals;

pub(crate) use folds::{ByFolds, CLIP, FOLDS, FoldsOf, gains_by_folds};
pub(crate) use grams::Grams;
pub(crate) use heldout::LOUD;
pub(crate) use knots::{Hat, of_formulas, places, table_places};
pub(crate) use parameters::{Parameters, Term};
pub(crate) use predictor::Predictor;
pub(crate) use prepare::Prepared;
pub(crate) use problem::{Fitted, Free, Problem, undone};
pub use random_walk::RunWalks;
pub(crate) use random_walk::{RANDOM_WALK, RandomWalk, is_random_walk};
pub(crate) use sparse::{Few, Sparse, in_a_row};
pub(crate) use sums::{BLOCKS_MAX, Direction};
