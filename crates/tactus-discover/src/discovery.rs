//! The result of a discovery.

use tactus_calibrate::FaultyElement;
use tactus_model::{Effect, Psf, Response};

/// What the data say about a model, and what they add to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Discovery {
    /// The seed of the split and of the Monte-Carlo tests.
    pub seed: u64,
    /// Which effects these data cannot show, and why. A report states this first.
    pub not_shown: Vec<NotShown>,
    /// What a reader should know about the data or the fit, one sentence each.
    pub warnings: Vec<String>,
    /// How many presses were fitted and how many were held out.
    pub split: Split,
    /// Whether each frame was held out, in the order in which the frames were given.
    pub heldout_frames: Vec<bool>,
    /// The noise of one reading, and where it is known from.
    pub floor: Floor,
    /// The structured residual that the user declared beforehand to be tolerable.
    pub tolerance_counts: Option<f64>,
    /// Elements that calibration finds faulty, with its evidence. Stuck, noisy and dead ones have no weight: no figure here but that
    /// of the step `miswired` contains their readings.
    pub faulty: Vec<FaultyElement>,
    /// How far the recalibrated base model is from the held-out presses. It has the effects of faulty elements.
    pub base: Level,
    /// Whether the residual of the base model has structure beyond noise; `None` without a floor.
    pub global: Option<GlobalTest>,
    /// Where the recalibrated base model and the data disagree, strongest first.
    pub gap: Vec<Gap>,
    /// The gap against each covariate, before and after.
    pub curves: Vec<Curve>,
    /// The gap of each element, row-major, before and after; NaN for elements without weight.
    pub elements: Vec<ElementGap>,
    /// Each round of the search: which effects were tried, and with what result.
    pub rounds: Vec<Round>,
    /// The effects that were added, in the order in which they were found; one entry for each name.
    pub steps: Vec<AddedEffect>,
    /// How far the grown model is from the held-out presses.
    pub final_: Final,
    /// The result in one word.
    pub verdict: Verdict,
    /// What the grown model leaves unexplained.
    pub unexplained: Unexplained,
    /// Experiments that would decide what these data leave open.
    pub next_experiments: Vec<NextExperiment>,
    /// The base model, recalibrated without added effects.
    pub recalibrated: BaseModel,
    /// The base of the grown model, recalibrated together with its effects.
    pub grown: BaseModel,
    /// The effects of the grown model; those that it had before come first. An effect may act more than once.
    pub effects: Vec<Effect>,
}

/// The parameters of a base model.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseModel {
    /// Spread against covering thickness.
    pub psf: Psf,
    /// Response of the elements; its baselines are the mean over the runs.
    pub response: Response,
    /// Baselines of each run, one per element, in counts.
    pub run_baselines_counts: Vec<Vec<f64>>,
    /// Random walks of each run's baselines, less the part common to all runs, which the effects contain.
    pub run_walks: Option<RunWalks>,
}

/// Random walks of the baselines, run by run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunWalks {
    /// Time between knots. The walk is straight between knots and constant after the last.
    pub knot_s: f64,
    /// For each run, knot by knot from its start, one value per element, in counts.
    pub runs_counts: Vec<Vec<f64>>,
}

/// An effect that the data cannot show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotShown {
    /// Name of the effect.
    pub effect: &'static str,
    /// What the data lack.
    pub reason: String,
}

/// How the data were split into fitted and held-out presses. A press is never divided.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// All frames, fitted and held out.
    pub frames: usize,
    /// Number of fitted presses.
    pub train_presses: usize,
    /// Number of held-out presses.
    pub heldout_presses: usize,
    /// Greatest depths at which every press was held out.
    pub heldout_depths_mm: Vec<f64>,
    /// Covering thicknesses under which every press was held out.
    pub heldout_coverings_mm: Vec<f64>,
}

/// The noise of one reading: the least residual that any model can leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Floor {
    /// From frames that repeat each other in time, while the tip rests.
    Time {
        /// Standard deviation of one reading.
        rms_counts: f64,
        /// Degrees of freedom of the estimate.
        freedom: f64,
    },
    /// From presses that repeat each other: the same run, covering, tool, place (to 20 um), depth (to 5 um) and direction. It
    /// contains what differs from press to press.
    Repeats {
        /// Standard deviation of one reading.
        rms_counts: f64,
        /// Degrees of freedom of the estimate.
        freedom: f64,
    },
    /// Nothing repeats, so noise and missing physics cannot be told apart.
    None,
}

/// How far a model is from the held-out frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Root mean square of the residuals.
    pub heldout_rms_counts: f64,
    /// Mean square of the residuals, in units of the noise variance; `None` without a floor.
    pub heldout_chi2: Option<f64>,
    /// The part of the residuals that is not noise; `None` without a floor.
    pub structured: Option<Structured>,
}

/// The part of a model's residuals on held-out presses that is not noise.
///
/// It is measured among all readings and among those with a signal. The part with the greater bound is given: readings far
/// from the tip would hide what is wrong near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structured {
    /// Root mean square, in standard deviations of the noise.
    pub rms_noise: f64,
    /// Upper 95 % bound of `rms_noise`; infinite with fewer than three held-out presses.
    pub upper_noise: f64,
    /// True if it is that of the readings with a signal.
    pub with_signal: bool,
}

/// A Monte-Carlo test for structure of any kind. It stays calibrated under autocorrelated noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalTest {
    /// The largest of all standardised scores.
    pub statistic: f64,
    /// Share of sign-flipped data sets with a larger statistic.
    pub p_value: f64,
}

/// A covariate on which the residual depends.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Name of the covariate, such as `time since contact`.
    pub covariate: &'static str,
    /// Unit of the covariate, such as `s`.
    pub unit: &'static str,
    /// Range of the covariate in which the residual is largest.
    pub range: [f64; 2],
    /// Root mean square of the dependence, in standard deviations of the noise.
    pub effect_size: f64,
    /// Adjusted for the false-discovery rate (Benjamini and Hochberg).
    pub q_value: f64,
}

/// The residual against a covariate.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name of the covariate.
    pub covariate: &'static str,
    /// Unit of the covariate.
    pub unit: &'static str,
    /// Unit of the residual: `share of the signal` or `counts`.
    pub of: &'static str,
    /// In order of the covariate.
    pub points: Vec<Point>,
}

/// A point of a [`Curve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Value of the covariate.
    pub at: f64,
    /// Mean residual of the recalibrated base model.
    pub before: f64,
    /// Mean residual of the grown model.
    pub after: f64,
    /// Standard error of either mean, from the scatter between blocks.
    pub standard_error: f64,
}

/// The residual of one element on the held-out presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementGap {
    /// Root mean square of the residual of the recalibrated base model.
    pub before_rms_counts: f64,
    /// The same for the grown model.
    pub after_rms_counts: f64,
}

/// A round of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// The effects in the model before this round.
    pub with: Vec<&'static str>,
    /// The effects that were tried, best first.
    pub candidates: Vec<TriedEffect>,
    /// The effect that was added, if any.
    pub taken: Option<&'static str>,
}

/// An effect that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct TriedEffect {
    /// Its name.
    pub effect: &'static str,
    /// Largest standardised score of a first step away from zero effect.
    pub score: f64,
    /// p-value of the score, corrected for all candidates of the round.
    pub p_value: f64,
    /// Root mean square of the held-out residuals of the model with this effect, if it was fitted.
    pub heldout_rms_counts: Option<f64>,
    /// Share of the gap that it closes on the held-out presses, if it was fitted.
    pub shrink: Option<f64>,
}

/// An effect that was added.
#[derive(Debug, Clone, PartialEq)]
pub struct AddedEffect {
    /// Its name.
    pub effect: &'static str,
    /// The parameters of each of its terms; an effect that acts more than once has several terms.
    pub terms: Vec<Vec<Estimated>>,
    /// Probability that noise alone gives such a gain on the held-out presses, from a paired comparison of blocks.
    pub p_value: f64,
    /// p-value, adjusted for the false-discovery rate over all added effects.
    pub q_value: f64,
    /// Root mean square of the held-out residuals of the grown model without this effect, refitted.
    pub heldout_rms_before_counts: f64,
    /// The same for the whole grown model.
    pub heldout_rms_after_counts: f64,
    /// Effects that these data cannot distinguish from this one.
    pub equivalent: Vec<&'static str>,
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimated {
    /// Name of the parameter, with its unit.
    pub name: &'static str,
    /// In the unit that the name ends with.
    pub value: f64,
    /// `None` where no error was estimated, such as for the index of an element.
    pub standard_error: Option<f64>,
}

/// The grown model on the held-out presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Final {
    /// Its distance from the held-out frames.
    pub level: Level,
    /// `(MSE_base - MSE_final) / (MSE_base - noise^2)`; `None` where there is no gap to close.
    pub shrink: Option<f64>,
}

/// The result of a discovery in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// No noise floor, or too few presses to see a residual of twice the noise.
    CannotJudge,
    /// No test finds structure beyond noise, and there is certainly less than twice the noise.
    NothingMissing,
    /// With the added effects no test finds structure, and there is certainly less than twice the noise; or there is certainly
    /// less than half the noise, or than the tolerance that was declared beforehand.
    Explained,
    /// The added effects explain part of the gap.
    PartlyExplained,
    /// There is structure that no effect of the library explains.
    Unexplained,
}

/// What remains between the grown model and the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// The covariates on which the remainder depends, strongest first; empty if only noise remains.
    pub depends_on: Vec<&'static str>,
    /// Share of the base model's gap.
    pub share: f64,
}

/// An experiment that would distinguish two explanations.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Name of the experiment for `tactus run`.
    pub experiment: &'static str,
    /// Its parameters and their values for `tactus run --param`.
    pub parameters: Vec<(&'static str, String)>,
    /// Approximate duration on the rig.
    pub duration_s: f64,
    /// The two explanations.
    pub separates: [String; 2],
    /// By how many standard errors their predictions would differ; `None` if that cannot be predicted.
    pub expected_z: Option<f64>,
}

impl Verdict {
    /// The word in the report.
    pub const fn name(self) -> &'static str {
        match self {
            Self::CannotJudge => "cannot-judge",
            Self::NothingMissing => "nothing-missing",
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unexplained => "unexplained",
        }
    }
}

impl Floor {
    /// Standard deviation of one reading.
    pub const fn rms_counts(self) -> Option<f64> {
        match self {
            Self::Time { rms_counts, .. } | Self::Repeats { rms_counts, .. } => Some(rms_counts),
            Self::None => None,
        }
    }

    /// The same with the noise of fewer elements.
    pub(crate) const fn with_rms(self, rms_counts: f64) -> Self {
        match self {
            Self::Time { freedom, .. } => Self::Time { rms_counts, freedom },
            Self::Repeats { freedom, .. } => Self::Repeats { rms_counts, freedom },
            Self::None => Self::None,
        }
    }

    /// Degrees of freedom of the estimate.
    pub const fn freedom(self) -> Option<f64> {
        match self {
            Self::Time { freedom, .. } | Self::Repeats { freedom, .. } => Some(freedom),
            Self::None => None,
        }
    }

    /// 90 % interval of the standard deviation of one reading.
    ///
    /// # Source
    /// Quantiles of chi-square: E. B. Wilson and M. M. Hilferty, *Proc. Natl. Acad. Sci.* 17 (1931) 684.
    pub fn interval90_counts(self) -> Option<[f64; 2]> {
        let (rms_counts, spread) = (self.rms_counts()?, 2.0 / (9.0 * self.freedom()?));
        // The square root of chi-square over its degrees of freedom.
        let root = |z: f64| (1.0 - spread + z * spread.sqrt()).max(0.0).powf(1.5);
        Some([Z_95, -Z_95].map(|z| rms_counts / root(z)))
    }

    /// What the noise is known from, in a report.
    pub const fn source(self) -> &'static str {
        match self {
            Self::Time { .. } => "repeats in time",
            Self::Repeats { .. } => "repeats of a place",
            Self::None => "none",
        }
    }
}

/// The 95 % quantile of the standard normal distribution.
pub(crate) const Z_95: f64 = 1.644_854;
