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
//! # Sources
//! Methods that others have published name them in their file: `bic`, [`drift`], [`evidence`], `jumps`, [`scatter`], [`score`], `tones`.
//! [`locate`] is the test of [`score`] with the false-discovery rate of Y. Benjamini and Y. Hochberg, *J. R. Stat. Soc. B* 57 (1995) 289.
//! [`forms`] takes the mean and the variance of a chi-squared sum. The rest is ours: [`candidates`], `cells`, `contests`, `covariates`, [`draft`]
//! with its parts, `given_up`, [`grow`], `hold`, `memory`, [`not_shown`], `pass`, [`rivals`], `varying`, [`wiring`]. That physics is told from
//! its rivals by odds has many sources; that a name must also beat rivals beside it (`contests`) has none that we know.
//!
//! # Constants
//!
//! *Derived*: from other numbers. *Convention*: chosen when it was written, and not changed since; no measurement says how much hangs on it.
//! *Cost*: a bound of time or memory. *Measured*: on sets, as the reason says. *Tried*: changed after runs on tuning sets, of which no recipe is
//! kept. *Default*: that of a script. A test compares the values with the code.
//!
//! | file | constant | value | kind | reason |
//! |---|---|---|---|---|
//! | candidates.rs | `VALUES_MANY` | `5` | cost | shapes of a grid; a fit finds what is between |
//! | candidates.rs | `VALUES_FEW` | `3` | cost | the same |
//! | candidates.rs | `SHORTEST_S` | `0.02` | convention | less than a frame of the paper's sensor |
//! | candidates.rs | `CROSSED_SHARE` | `0.5` | convention | half of a signal is more another's |
//! | contests.rs | `TAKEN_SHARE` | `0.3` | measured | `evidence contests`: 11 right and 4 wrong names at a z of 40 (page of `contests`) |
//! | contests.rs | `BESIDE_SHARE` | `0.17` | measured | the geometric mean of 0.144, beside a right name of a real sensor, and 0.20, beside wrong ones; 0.1 before the real one |
//! | covariates.rs | `LOOK_MM` | `0.3` | convention | a depth that presses have |
//! | covariates.rs | `LOW_MM` | `2.0` | convention | from which something may be felt without contact |
//! | covariates.rs | `ELEMENTS_MAX` | `48` | cost | the paper's 48 |
//! | covariates.rs | `ELEMENT_DEPTHS` | `3` | cost | shallow, middle, deep |
//! | covariates.rs | `CENTRED_MM` | `0.02` | convention | places that differ by less are one |
//! | draft.rs | `WEIGHED_MAX` | `12` | cost | of a second pass |
//! | draft.rs | `COLUMNS_MAX` | `512` | cost | the memory of a pass; 200 at first |
//! | draft.rs | `PARTS_MAX` | `2 * COLUMNS_MAX * 48 * BLOCKS_MAX` | cost | 160 MB, which the paper's sensor never takes (decision 0062) |
//! | draft.rs | `TRIED_MAX` | `3` | cost | of fits |
//! | draft.rs | `KNOTS` | `7` | cost | straight lines over six parts of the range |
//! | draft.rs | `KNOTS_OF_SECOND` | `4` | cost | a table of 7 x 4 values, of 14 x 8 at most |
//! | draft.rs | `KNOTS_OF_DISTANCE` | `12` | tried | with wide knots: what acts on every element, near or far |
//! | draft.rs | `AHEAD_LN_ODDS` | `5.0` | convention | `LN_ODDS_LEAST` |
//! | draft.rs | `OWN_LEAST` | `0.05` | tried | 0.3 and 0.1 at first |
//! | draft.rs | `FOLDS_LEAST` | `4` | convention | all but one |
//! | draft/curves.rs | `SHAPES` | `60` | cost | a step of a grid; refined after |
//! | draft/curves.rs | `FREE_COST` | `1.0` | convention | half a nat |
//! | draft/curves.rs | `HELD` | `1e3` | convention | holds a mean and leaves the sum regular |
//! | draft/curves.rs | `RIDGE` | `1e-9` | convention | keeps 0 what the data do not show |
//! | draft/curves.rs | `REFINEMENTS` | `8` | derived | `2^-8` of a step |
//! | draft/form.rs | `MISSED_SHARE` | `0.01 / 3.0` | derived | a curve within 10 % has a hundredth of the squares beside it, which three choices share (decision 0061) |
//! | draft/form.rs | `MISSED_LN_ODDS` | `5.0` | convention | `LN_ODDS_LEAST` |
//! | draft/form.rs | `FINER` | `[2, 4]` | cost | 14 and 28 knots |
//! | draft/form.rs | `FINER_OF_SECOND` | `2` | cost | 8 knots |
//! | draft/grammar.rs | `JUMP_SHARE` | `1.0 / jumps::CELLS as f64` | derived | a cell of those among which it was found |
//! | draft/sight.rs | `LOUD_SHARE` | `0.02` | convention | readings without a signal place no knots |
//! | draft/sight.rs | `APART_SHARE` | `0.01` | convention | nearer knots see the same |
//! | draft/sight.rs | `FINE_SHARE` | `0.2` | convention | a fifth of the time since the event (decision 0035) |
//! | draft/sight.rs | `KNOTS_OF_ELEMENTS` | `3` | cost | weights come from a coarse curve |
//! | drift.rs | `FORGOTTEN` | `0.01` | convention | one in a hundred |
//! | drift.rs | `KERNELS_S` | `[10.0, 40.0, 160.0]` | convention | factors of four over minutes |
//! | drift.rs | `BLOCKS_MAX` | `600` | cost | a product of all with all |
//! | evidence.rs | `ODDS_AGAINST` | `20.0` | convention | about one of the 26 classes (decision 0026) |
//! | evidence.rs | `ODDS_AGAINST_AGAIN` | `4.0` | convention | a second term of a class that is there is less of a surprise |
//! | evidence.rs | `TAU_LEAST` | `1e-5` | convention | the ends of a grid in factors of two |
//! | evidence.rs | `TAUS` | `18` | derived | up to 1.3 ranges |
//! | evidence.rs | `BEAM` | `6` | cost | of sets |
//! | evidence.rs | `SIZE_MAX` | `6` | cost | one more than `NAMES_MAX` |
//! | evidence.rs | `EXCUSED_SHARE` | `0.075` | measured | `evidence contests --size glance`, 133 sets: rivals are ahead of right classes by up to 0.05, of wrong ones that lose by 0.11 and more |
//! | evidence.rs | `EXCUSED_LN_ODDS` | `5.0` | convention | `LN_ODDS_LEAST` |
//! | evidence.rs | `PARTS_MAX` | `3` | cost | of one class |
//! | evidence.rs | `GAIN_LEAST` | `1.0` | convention | a nat |
//! | forms.rs | `REFUTED_Z` | `2.0` | convention | two standard deviations of a chi-squared sum |
//! | grow.rs | `FLIPS` | `1999` | convention | gives p down to `5e-4` |
//! | grow.rs | `ALPHA` | `0.005` | tried | 0.01 on the first day gave too many false alarms under coloured noise |
//! | grow.rs | `NAMES_MAX` | `5` | cost | 4 at first |
//! | grow.rs | `WORK_MOST` | `3_000_000_000` | cost | half a minute or so; five of 42 sets reach it (decision 0068); 4,000 million at first (decision 0053) |
//! | grow.rs | `FIRST_ROUNDS` | `2` | cost | of a fit |
//! | grow.rs | `TRIAL_ROUNDS` | `6` | cost | of a fit; 7 and 5 at first |
//! | grow.rs | `POLISH_ROUNDS` | `8` | cost | of a fit |
//! | grow.rs | `FITTED_MAX` | `5` | cost | of a round; 6, 8 and 7 at first |
//! | grow.rs | `FINISHED_MAX` | `2` | cost | of a round; 4 at first |
//! | grow.rs | `PROMISE_SHARE` | `0.3` | convention | a first step is linear, and may promise too little; not measured |
//! | grow.rs | `LN_ODDS_LEAST` | `5.0` | convention | odds of 150 to 1 (Kass and Raftery: very strong) |
//! | grow.rs | `LN_ODDS_CERTAIN` | `30.0` | derived | Markov's inequality, twice the variance (decision 0048) |
//! | grow.rs | `MISFIT_SHARE` | `0.02` | measured | `just discovery-constants`: the share of sets that hold the hidden class |
//! | grow.rs | `LEFT_SHARE` | `1.0 / 3.0` | derived | `1 / ln 20`; 0.1 before (decision 0030) |
//! | grow.rs | `FORM_SHARE` | `0.07` | measured | `just discovery-constants`: 95 % of wrong classes beside a right one |
//! | hold.rs | `BETTER_LN_ODDS` | `3.0` | convention | odds of 20 to 1, so that classes do not take turns; not measured |
//! | hold.rs | `EXCHANGES_MAX` | `4` | cost | of rounds; 3 at first |
//! | hold.rs | `HARDLY_ANYTHING` | `0.25` | convention | half of the rms (decision 0055) |
//! | hold.rs | `OTHERS_MAX` | `4` | cost | of fits |
//! | hold.rs | `SET_PROBABILITY` | `0.95` | convention | 19 in 20 |
//! | hold.rs | `SET_UNITS` | `3.0` | derived | `exp(-3)` is 5 % |
//! | jumps.rs | `CELLS` | `1024` | cost | of a place |
//! | jumps.rs | `SHARE_LEAST` | `0.005` | convention | the readings of a few presses make no jump |
//! | locate.rs | `Q_MAX` | `0.05` | convention | a false-discovery rate of 5 % |
//! | locate.rs | `OWN_LEAST` | `1e-3` | convention | recalibration takes up the rest |
//! | memory.rs | `MODELS_MAX` | `8` | cost | 5 MB each |
//! | memory.rs | `DRAFTED_MAX` | `2` | cost | up to 50 MB each |
//! | not_shown.rs | `REACH_LEAST` | `15.0` | convention | a whole range of 15 standard errors; not measured |
//! | not_shown.rs | `MOVING_LEAST` | `20` | convention | fewer frames are the ends of moves |
//! | pass.rs | `FREE_SHARE` | `0.4` | measured | on tuning sets of 2026-11-25: right classes 0.83 and more, wrong ones 0.21; no recipe is kept, since reports do not have it |
//! | rivals.rs | `KNOTS` | `5` | cost | straight lines over four parts of the range |
//! | rivals.rs | `JITTER` | `1e-3` | convention | a stage holds a micrometre |
//! | rivals.rs | `SIGNAL_SHARE` | `0.02` | convention | readings without a signal place no knots |
//! | scatter.rs | `REST_FRAMES` | `3` | derived | a line through them takes two |
//! | scatter.rs | `NOISE_STEPS` | `0.7` | convention | below it, rounding is no dither |
//! | scatter.rs | `FLIPS` | `9999` | convention | gives p down to `1e-4`, corrected for many tests |
//! | score.rs | `MEDIAN_SQUARE` | `0.454_936` | derived | of a chi-squared deviate |
//! | score.rs | `BLOCKS_LEAST` | `8` | convention | fewer give no scatter |
//! | score.rs | `EXCESS_OF_FEW` | `1.5` | convention | assumed where it cannot be measured |
//! | score.rs | `PANEL` | `256` | cost | the cache of a processor |
//! | tones.rs | `CELLS` | `8192` | cost | of a transform |
//! | tones.rs | `FINER` | `4` | derived | so that no tone lies between two frequencies |
//! | tones.rs | `HALVINGS` | `8` | derived | a thousandth of a period over all the data |
//! | tones.rs | `PAUSE` | `2.5` | convention | more than a lost frame |
//! | tones.rs | `RHYTHM_STANDS_OUT` | `10.0` | derived | powers without a rhythm are distributed exponentially: `2^-10` of them exceed so much |
//! | tones.rs | `AROUND` | `10 * FINER` | convention | ten periods |
//! | tones.rs | `PERIODS_LEAST` | `3` | convention | slower is a smooth function |
//! | tones.rs | `CELLS_LEAST` | `4` | derived | a tone of two cells is none |
//! | tones.rs | `STEPS_LEAST` | `2.0` | derived | the codes of a converter show nothing shorter (decision 0048) |
//! | wiring.rs | `GAIN_LEAST` | `30.0` | tried | 20 at first |
//! | wiring.rs | `STANDS_OUT` | `6.0` | convention | six times the typical reduction |
//! | wiring.rs | `PAIRS_MAX` | `4` | cost | of shapes |
//! | wiring.rs | `DEAD_SHARE` | `0.3` | convention | of a declared gain |
//! | wiring.rs | `TOLD` | `0.95` | convention | 19 in 20 |

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
pub use contests::{Contest, Rivalry, TAKEN_SHARE};
pub use draft::NoDraft;
pub(crate) use draft::{Against, Drafted, Outcome};
pub use forms::RefutedFormula;
pub(crate) use forms::{Formed, Refuted};
pub(crate) use given_up::last_words;
pub use given_up::{Because, GivenUp, rival_in_words};
pub use grow::{ALPHA, FORM_SHARE, LEFT_SHARE, MISFIT_SHARE, Round, TriedEffect};
pub(crate) use grow::{
    Alike, Equivalent, FLIPS, Grown, Left, POLISH_ROUNDS, Search, Tried, WORK_MOST, names, without,
};
pub use hold::SET_PROBABILITY;
pub(crate) use locate::Located;
pub use locate::{Curve, Gap, Point};
pub(crate) use memory::Memory;
pub use not_shown::NotShown;
pub use options::{Options, Rule};
pub(crate) use scatter::Scattered;
pub(crate) use score::{q_values, sign_flip_p};
pub(crate) use wiring::Partners;
