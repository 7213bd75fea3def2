//! What a discovery found.

use tactus_model::{Effect, Psf, Response};

/// What the data say of a model, and what they add to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Discovery {
    /// The seed of the split and of the Monte-Carlo tests.
    pub seed: u64,
    /// Which effects these data cannot show, and why; to be told before all else.
    pub not_shown: Vec<NotShown>,
    /// What a reader should know of the data or of the fit, a sentence each.
    pub warnings: Vec<String>,
    /// Which presses were fitted and which were held out.
    pub split: Split,
    /// Of each frame, in the order in which they were given, whether it was held out.
    pub heldout_frames: Vec<bool>,
    /// Standard deviation of one reading, from frames that repeat each other; none where no frames do.
    pub noise_rms_counts: Option<f64>,
    /// The base model after its own recalibration, on the held-out presses.
    pub base: Level,
    /// Is there structure beyond noise?
    pub global: GlobalTest,
    /// Where the recalibrated base model and the data disagree, strongest first.
    pub gap: Vec<Gap>,
    /// The gap against each covariate, before and after.
    pub curves: Vec<Curve>,
    /// The gap of each element, row-major, before and after.
    pub elements: Vec<ElementGap>,
    /// Each round of the search: what was tried, and how it fared.
    pub rounds: Vec<Round>,
    /// What was added, in the order in which it was found; one step for each name.
    pub steps: Vec<Step>,
    /// The grown model on the held-out presses.
    pub final_: Final,
    /// In one word.
    pub verdict: Verdict,
    /// What is left.
    pub unexplained: Unexplained,
    /// What to measure next.
    pub next_experiments: Vec<NextExperiment>,
    /// The base model, recalibrated alone.
    pub recalibrated: Base,
    /// The base of the grown model, recalibrated jointly with its effects.
    pub grown: Base,
    /// The effects of the grown model, those that it had before first; an effect may act more than once.
    pub effects: Vec<Effect>,
}

/// The parameters of a base model.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Spread against covering thickness.
    pub psf: Psf,
    /// How the elements answer; the baselines are the mean over the runs.
    pub response: Response,
    /// Baselines of each run, one per element, in counts.
    pub run_baselines_counts: Vec<Vec<f64>>,
    /// What the zeros of the runs wander beside the effects, which hold what they have in common.
    pub run_wander: Option<RunWander>,
}

/// How the zeros of each run wander.
#[derive(Debug, Clone, PartialEq)]
pub struct RunWander {
    /// Time from knot to knot; straight between them, and constant after the last.
    pub knot_s: f64,
    /// Of each run, knot by knot from its start on, one per element, in counts.
    pub runs_counts: Vec<Vec<f64>>,
}

/// An effect that the data cannot show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotShown {
    /// Its name.
    pub effect: &'static str,
    /// What the data lack.
    pub reason: String,
}

/// Which presses were fitted and which were held out, whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// Frames in all.
    pub frames: usize,
    /// Presses that were fitted.
    pub train_presses: usize,
    /// Presses that were held out.
    pub heldout_presses: usize,
    /// Greatest depths of presses that were held out as a whole.
    pub heldout_depths_mm: Vec<f64>,
    /// Coverings that were held out as a whole.
    pub heldout_coverings_mm: Vec<f64>,
}

/// How far a model is from the held-out frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Root mean square of the residuals.
    pub heldout_rms_counts: f64,
    /// Their mean square in units of the noise's.
    pub heldout_chi2: f64,
}

/// A Monte-Carlo test for any structure, which stays calibrated under autocorrelated noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalTest {
    /// The largest of all standardised scores.
    pub statistic: f64,
    /// Share of sign-flipped data sets with a larger one.
    pub p_value: f64,
}

/// A covariate on which the residual depends.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Name of the covariate, such as `time since contact`.
    pub covariate: &'static str,
    /// Unit of the covariate, such as `s`.
    pub unit: &'static str,
    /// Where the residual is largest.
    pub range: [f64; 2],
    /// Root mean square of the dependence, in units of the noise.
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
    /// What the residual is measured in, such as `share of the signal` or `counts`.
    pub of: &'static str,
    /// Along the covariate.
    pub points: Vec<Point>,
}

/// A point of a [`Curve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The covariate.
    pub at: f64,
    /// Mean residual of the recalibrated base model.
    pub before: f64,
    /// Mean residual of the grown model.
    pub after: f64,
    /// Standard error of both, from whole blocks.
    pub standard_error: f64,
}

/// The gap of one element on the held-out presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementGap {
    /// Root mean square of the residual of the recalibrated base model.
    pub before_rms_counts: f64,
    /// The same of the grown model.
    pub after_rms_counts: f64,
}

/// A round of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// What was in the model before it.
    pub with: Vec<&'static str>,
    /// What was tried, best first.
    pub candidates: Vec<Candidate>,
    /// What was taken.
    pub taken: Option<&'static str>,
}

/// An effect that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its name.
    pub effect: &'static str,
    /// Largest standardised score of its first steps away from nothing.
    pub score: f64,
    /// The score's p-value, corrected for all candidates of the round.
    pub p_value: f64,
    /// Root mean square of the held-out residuals with it, if it was fitted.
    pub heldout_rms_counts: Option<f64>,
    /// What share of the gap it closes on the held-out presses, if it was fitted.
    pub shrink: Option<f64>,
}

/// An effect that was added.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Its name.
    pub effect: &'static str,
    /// Its terms: more than one where it acts more than once, each with its parameters.
    pub terms: Vec<Vec<Estimated>>,
    /// Of the paired comparison, block by block, on the held-out presses: the chance of such a gain by noise.
    pub p_value: f64,
    /// Adjusted for the false-discovery rate over all candidates of its round.
    pub q_value: f64,
    /// Root mean square of the held-out residuals of the grown model without it, the rest fitted anew.
    pub heldout_rms_before_counts: f64,
    /// The same of the grown model.
    pub heldout_rms_after_counts: f64,
    /// Effects that these data cannot tell from it.
    pub equivalent: Vec<&'static str>,
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimated {
    /// Its name, with the unit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error; none where it was not estimated, such as the index of an element.
    pub standard_error: Option<f64>,
}

/// The grown model on the held-out presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Final {
    /// How far it is from the frames.
    pub level: Level,
    /// `(MSE_base - MSE_final) / (MSE_base - noise^2)`; none where there is no gap to close.
    pub shrink: Option<f64>,
}

/// A discovery in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing beyond noise.
    NothingMissing,
    /// What was missing has been named.
    Explained,
    /// Part of it has been named.
    PartlyExplained,
    /// There is structure, and no known effect is it.
    Unexplained,
}

/// What is left between the grown model and the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// The covariates on which it depends, strongest first; none where nothing beyond noise is left.
    pub depends_on: Vec<&'static str>,
    /// Share of the base model's gap.
    pub share: f64,
}

/// An experiment that would tell two explanations apart.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Name of the experiment, as `tactus run` takes it.
    pub experiment: &'static str,
    /// Its parameters, each with its value as `tactus run --param` takes it.
    pub parameters: Vec<(&'static str, String)>,
    /// How long it takes on the rig, roughly.
    pub duration_s: f64,
    /// The explanations.
    pub separates: [String; 2],
    /// By how many standard errors they would differ.
    pub expected_z: f64,
}

impl Verdict {
    /// The word in the report.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NothingMissing => "nothing-missing",
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unexplained => "unexplained",
        }
    }
}
