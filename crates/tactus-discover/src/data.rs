//! The data before any model: frames, where the tip rests and presses, bins of frames, the noise of a reading, faulty elements.
//!
//! Readings are averaged where the tip rests, or goes slowly straight on in contact ([`bins`]). The mean of `n` consecutive readings with the
//! autocorrelation `rho` has the variance
//!
//! ```text
//! noise^2 / n (1 + 2 sum over k of (1 - k / n) rho(k))
//! ```
//!
//! The noise is that of readings that repeat each other ([`noise`]), so it does not depend on the model. One press in three is held out.
//! Blocks of bins that are long beside the memory of the noise count as independent. Elements that calibration finds faulty
//! ([`faulty`]) have no weight, or an effect of their own in the base model.
//!
//! # Constants
//!
//! *Derived*: from other numbers. *Convention*: chosen when it was written, and not changed since; no measurement says how much hangs on it.
//! *Cost*: a bound of time or memory. *Measured*: on sets, as the reason says. *Tried*: changed after runs on tuning sets, of which no recipe is
//! kept. *Default*: that of a script. A test compares the values with the code.
//!
//! | file | constant | value | kind | reason |
//! |---|---|---|---|---|
//! | bins.rs | `GROWTH` | `0.25` | tried | a bin is short where a relaxation is fast; 0.2 at first |
//! | bins.rs | `FRAMES_MAX` | `15` | convention | half a second of the paper's sensor |
//! | bins.rs | `REST_LEAST` | `3` | derived | two are on a straight line |
//! | bins.rs | `BLOCK_S` | `3.0` | convention | long beside a correlation of the noise of some frames |
//! | bins.rs | `STRETCH_S` | `10.0` | convention | as long as a press with its rest |
//! | bins.rs | `HELDOUT_ONE_IN` | `3` | convention | a third judges, two thirds fit |
//! | bins.rs | `SETTINGS_LEAST` | `4` | convention | a middle one of fewer has hardly any on either side |
//! | bins.rs | `OFTEN` | `4` | convention | what occurs less often may be scatter |
//! | bins.rs | `JUDGED_LEAST` | `3` | derived | `PRESSES_LEAST` of `verdict/structured.rs` |
//! | contacts.rs | `SAME_DEPTH_MM` | `0.03` | convention | what differs by less is one setting |
//! | contacts.rs | `SAME_SPEED_RATIO` | `1.5` | convention | the same, of speeds |
//! | contacts.rs | `REST_STRIDES` | `3` | convention | a tenth of a second |
//! | contacts.rs | `BACK_STRIDES` | `600` | cost | twenty seconds |
//! | contacts.rs | `RISES_MM` | `0.005` | convention | as repeats tell depths apart |
//! | contacts.rs | `FRAMES_MANY` | `20` | convention | more than a start and a stop have |
//! | contacts.rs | `VARIED_SPEED_RATIO` | `2.0` | convention | quartiles of one speed are alike |
//! | converter.rs | `READINGS_LEAST` | `20` | convention | fewer may lie on a lattice by chance |
//! | converter.rs | `WIDER` | `1.4` | convention | between the declared step and twice that |
//! | converter.rs | `OFF_MAX` | `0.02` | convention | counts are stored in single precision |
//! | converter.rs | `ROUNDED_MAX` | `0.08` | convention | with `OFF_MAX` a tenth of a step; up to 19 bits that are no whole counts |
//! | converter.rs | `WHOLE_MAX` | `16_777_216.0` | derived | `2^24`: single precision has as many bits |
//! | converter.rs | `GAPS_MAX` | `512` | cost | a loop for each |
//! | converter.rs | `AT_END_LEAST` | `10` | convention | fewer do not tell an end of a gap |
//! | converter.rs | `CHANCE` | `1e-6` | convention | far below any level in use, times what was looked at |
//! | converter.rs | `LN_ENOUGH` | `-100.0` | cost | below `ln` of any level in use |
//! | converter.rs | `SEEN_MOST` | `0.9` | convention | readings jitter in time |
//! | converter.rs | `BESIDE` | `8` | convention | enough to tell how frequent a code is |
//! | converter.rs | `PILED_LEAST` | `0.5` | convention | half of what a gap lacks |
//! | converter.rs | `FAR` | `6.0` | derived | `2e-9` of a normal distribution lies beyond |
//! | excerpt.rs | `READINGS_MOST` | `48 * 24_000` | cost | time and memory of any recording (decisions 0050 and 0053); 48,000 and 42,000 frames at first |
//! | excerpt.rs | `PART_SHARE` | `16` | cost | a part is small beside what may be read |
//! | excerpt.rs | `POINTS_AT_ONCE` | `2048` | cost | time that may grow with their square |
//! | excerpt.rs | `OFF_MM` | `0.02` | convention | as repeats tell places apart |
//! | faulty.rs | `NOISY` | `3.0` | convention | three times the median |
//! | faulty.rs | `CROSS_WIRED_ONE_IN` | `10` | convention | more would be another fault |
//! | faulty.rs | `SHIFTED_LEAST` | `3` | derived | one more than the paper's two faulty elements (Sec. 2.2), which are no shift |
//! | history.rs | `ASIDE_MM` | `0.05` | convention | shorter moves have no direction |
//! | motion.rs | `STILL_MM` | `0.001` | convention | a smaller movement counts as none |
//! | motion.rs | `STRIDE_S` | `1.0 / 30.0` | convention | steps and lags were chosen with the paper's sensor |
//! | motion.rs | `PAUSE` | `2.5` | convention | more than a lost frame |
//! | motion.rs | `JITTER_MOST_MM` | `0.02` | convention | as repeats tell places apart |
//! | motion.rs | `JITTER_LEAST` | `20` | convention | a standard error of some 16 % |
//! | motion.rs | `JITTER_Z` | `6.0` | derived | `2e-9` of a normal distribution lies beyond |
//! | motion.rs | `CLEAR_MM` | `0.25` | convention | above it movements do not affect readings |
//! | motion.rs | `TURN_MM_PER_S` | `1.2` | convention | a change by more is a start or a stop |
//! | noise.rs | `SETTLED_S` | `1.0` | convention | a second after a stop |
//! | noise.rs | `PLATEAU` | `20..=30` | convention | about a second |
//! | noise.rs | `LEVELLED` | `1.3` | derived | from a correlation of `1 / e` at the end of the plateau, in the comment |
//! | noise.rs | `ALIKE_Z` | `3.0` | convention | three standard errors |
//! | noise.rs | `PAIRS_LEAST` | `20` | convention | a standard error of some 16 % |
//! | noise.rs | `FREEDOM_LEAST` | `10.0` | derived | a standard error of 22 % |
//! | noise.rs | `DIFFERENCES_SHARE` | `2.0 / 3.0` | derived | von Neumann et al., in the comment |
//! | noise.rs | `QUIETEST` | `0.7` | convention | below it, rounding looks the same |
//! | noise.rs | `MEDIAN_SIZE` | `0.674_490` | derived | median of `abs` of a normal deviate |
//! | noise.rs | `ALL_ROUNDING` | `0.9` | convention | 0.9 of the noise |
//! | noise/repeats.rs | `PLACE_MM` | `0.02` | convention | places that differ by less are one |
//! | noise/repeats.rs | `DEPTH_MM` | `0.005` | convention | the same, of depths |
//! | noise/repeats.rs | `SECOND_LEAST` | `4` | convention | a second difference takes three |
//! | noise/repeats.rs | `SECOND_SHARE` | `36.0 / 70.0` | derived | from the correlations -4/6 and 1/6 |
//! | noise/repeats.rs | `MOMENTS` | `30` | cost | frames of a dwell that are compared |
//! | noise/stretches.rs | `LONGEST_LEAST` | `4` | convention | a shorter rise shows no autocorrelation |
//! | noise/stretches.rs | `LAGS` | `30` | convention | as the plateau |
//! | noise/stretches.rs | `PHI_STEP` | `0.005` | convention | a fine grid |
//! | noise/stretches.rs | `PHI_STEPS` | `196` | derived | up to 0.975 |
//! | noise/stretches.rs | `NEAR_QUARTILES` | `5.0` | derived | 1.6 to 3.4 standard deviations, in the comment |
//! | noise/stretches.rs | `FRAMES_EACH` | `10.0` | convention | of the greatest autocorrelation that short dwells show |
//! | noise/stretches.rs | `HALVINGS` | `20` | derived | a millionth of the interval |
//! | noise/stretches.rs | `GROUPS` | `20` | convention | of a jackknife |
//! | pace.rs | `APART` | `0.55` | derived | two of half a stride, and a tenth of jitter |
//! | pace.rs | `APART_AT_END` | `0.75` | derived | a full frame and less than half of one |
//! | pace.rs | `DITHERED_STEPS` | `0.577` | derived | root of `1 / 4 + 1 / 12`; `e^-10` of what repeats is left |
//! | pace.rs | `TOLERANCE` | `0.05` | convention | a rate of 60 Hz is never exact |
//! | pace.rs | `USUAL` | `0.25` | convention | variances that differ by a quarter count as one |
//! | slow_ways.rs | `DEPTH_PARTS` | `32.0` | convention | a curve over depth has fewer knots; the response hardly bends on so short a way |
//! | slow_ways.rs | `SHOWS_Z` | `8.0` | derived | `1e-15` of a normal distribution lies beyond: none of all readings does by chance |
//! | slow_ways.rs | `ZERO_FRAMES` | `15` | convention | half a second of the paper's sensor |
//! | spectrum.rs | `STANDS_OUT` | `8.0` | tried | 6 at first; no recipe |
//! | spectrum.rs | `RECORDINGS_PER_FALSE_LINE` | `50.0` | convention | one recording of noise in fifty (decision 0055) |
//! | spectrum.rs | `PHASES_PER_COLUMN` | `2` | derived | so that no phase is more than a quarter of a turn, over all columns, from one looked at |
//! | spectrum.rs | `RHYTHM_STANDS_OUT` | `10.0` | derived | `2^-10` of exponential powers exceed it |
//! | spectrum.rs | `AROUND` | `40` | convention | enough for a median |
//! | spectrum.rs | `FAR_AROUND` | `200` | convention | the same, for a sum that scatters more |
//! | spectrum.rs | `PERIODS_LEAST` | `12.0` | convention | slower is a drift |
//! | spectrum.rs | `LINES_MAX` | `3` | cost | each line makes shapes of a candidate |
//! | spectrum.rs | `FRAMES_LEAST` | `256` | convention | some seconds |
//! | spectrum.rs | `DRIFT_PARTS` | `8` | convention | a drift of a recording bends seldom |

mod bins;
mod contacts;
mod converter;
mod error;
mod excerpt;
mod faulty;
mod floor;
mod frames;
mod history;
mod known;
mod motion;
mod noise;
mod pace;
mod slow_ways;
pub(crate) mod spectrum;
mod way;

pub(crate) use bins::{Averaged, Bins, HeldOut, presses};
pub(crate) use contacts::Contacts;
pub(crate) use converter::{Converter, Fault, Gap, Rounding};
pub use error::{DiscoverError, Mismatch, TooLittle};
pub(crate) use faulty::{Faulty, MISWIRED, rewired};
pub use floor::Floor;
pub use frames::Frames;
pub(crate) use frames::OnWay;
pub(crate) use history::History;
pub use known::Known;
pub(crate) use motion::{interval_s, load_speeds_mm_per_s, still, turns};
pub(crate) use noise::{Noise, QUIETEST};
pub(crate) use spectrum::Line;
