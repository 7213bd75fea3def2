//! The search for effects that, together with the base model, leave only noise.
//!
//! At a model, one [`pass`] over the data gives the products of the derivatives by every shape of every effect ([`candidates`]) and of rivals
//! without a name ([`rivals`]). From the products follow a [`score`] of each effect, whose largest is compared with those of data sets in
//! which the signs of whole blocks are flipped, and the odds of sets of effects ([`evidence`]). The classes of the best sets are fitted, and
//! one is added; in the end each must hold its place against no effect, rivals and other classes ([`grow`]), and then has knots in place of
//! its formula if the data refute that ([`forms`]). Random walks have a score of
//! their own ([`drift`]), and pairs of elements are proposed by the residual ([`wiring`]).
//!
//! What no class explains is drafted as an effect from a small grammar ([`draft`]).
//!
//! [`locate`] applies the same test to covariates in place of effects: it tells where a model and the data disagree, in words that do
//! not depend on the library; [`scatter`] tests whether the noise is the same everywhere. [`not_shown`] lists effects that these data could not show at any size.
//!
//! Each file names its sources.

mod bic;
mod candidates;
mod cells;
mod contests;
mod covariates;
mod draft;
mod drift;
mod evidence;
mod forms;
mod given_up;
mod grow;
mod hold;
mod jumps;
mod locate;
mod memory;
pub(crate) mod not_shown;
mod options;
mod pass;
mod rivals;
mod scatter;
mod score;
mod tones;
mod varying;
mod wiring;

pub(crate) use candidates::Candidate;
pub use contests::{Contest, Rivalry};
pub use draft::NoDraft;
pub(crate) use draft::{Against, Drafted};
pub use forms::RefutedFormula;
pub(crate) use forms::{Formed, Refuted};
pub(crate) use given_up::last_words;
pub use given_up::{Because, GivenUp};
pub(crate) use grow::{
    ALPHA, Alike, Equivalent, FLIPS, Grown, Left, POLISH_ROUNDS, Search, Tried, WORK_MOST, names, without,
};
pub use grow::{Round, TriedEffect};
pub(crate) use locate::Located;
pub use locate::{Curve, Gap, Point};
pub(crate) use memory::Memory;
pub use not_shown::NotShown;
pub use options::{Options, Rule};
pub(crate) use scatter::Scattered;
pub(crate) use score::{q_values, sign_flip_p};
pub(crate) use wiring::Partners;
