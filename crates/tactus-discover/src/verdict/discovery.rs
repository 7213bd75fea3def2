//! The result of a discovery.

use tactus_calibrate::FaultyElement;
use tactus_model::effect::By;
use tactus_model::{Effect, Psf, Response};

use super::closed::Closed;
use super::drafting::DraftedEffect;
use super::structured::Structured;
use crate::data::Floor;
use crate::fit::RunWalks;
use crate::next::Plan;
use crate::search::{Contest, Curve, Gap, GivenUp, NoDraft, NotShown, RefutedFormula, Round};

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
    /// Effects that were fitted and are not in the grown model, and why.
    pub given_up: Vec<GivenUp>,
    /// The residual as the grown model is built up, from the base model; empty if nothing was judged.
    pub staircase: Vec<Stair>,
    /// The effects that were added, in the order in which they were found; one entry for each name.
    pub steps: Vec<AddedEffect>,
    /// Effects that a fit shows, and that fitted presses which their parameters have not seen do not confirm. They are not in the grown model.
    pub tentative: Vec<AddedEffect>,
    /// How far the grown model is from the held-out presses.
    pub final_: Final,
    /// The result in one word.
    pub verdict: Verdict,
    /// What the grown model leaves unexplained.
    pub unexplained: Unexplained,
    /// The effect that was drafted of it, or why there is none; `None` where nothing is left to draft.
    pub draft: Option<Result<Box<DraftedEffect>, NoDraft>>,
    /// Which experiments would decide what these data leave open.
    pub plan: Plan,
    /// The base model, recalibrated without added effects.
    pub recalibrated: BaseModel,
    /// The base of the grown model, recalibrated together with its effects.
    pub grown: BaseModel,
    /// How probable each effect of the library is, the most probable first; those that these data cannot show are left out.
    pub inclusions: Vec<Inclusion>,
    /// The added effects beside rivals without a name, those included that lost against one.
    pub contests: Vec<Contest>,
    /// The effects of the grown model; those that it had before come first. An effect may act more than once.
    pub effects: Vec<Effect>,
}

/// The parameters of a base model.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseModel {
    /// Spread against covering thickness.
    pub psf: Psf,
    /// Response of the elements; its gains and baselines are the means over the runs.
    pub response: Response,
    /// Factor of all sensitivities in each run; their geometric mean is 1.
    pub run_gains: Vec<f64>,
    /// Baselines of each run, one per element, in counts.
    pub run_baselines_counts: Vec<Vec<f64>>,
    /// Random walks of each run's baselines, less the part common to all runs, which the effects contain.
    pub run_walks: Option<RunWalks>,
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

/// A step of the way from the base model to the grown one.
#[derive(Debug, Clone, PartialEq)]
pub struct Stair {
    /// What was added last: `base model`, an effect, or the draft.
    pub with: String,
    /// Root mean square of the residuals on the held-out presses, with all that was added so far.
    pub heldout_rms_counts: f64,
}

/// A Monte-Carlo test for structure of any kind. It stays calibrated under autocorrelated noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalTest {
    /// The largest of all standardised scores.
    pub statistic: f64,
    /// Share of sign-flipped data sets with a larger statistic.
    pub p_value: f64,
}

/// The residual of one element on the held-out presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementGap {
    /// Root mean square of the residual of the recalibrated base model.
    pub before_rms_counts: f64,
    /// The same for the grown model.
    pub after_rms_counts: f64,
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
    /// The same probability on fitted presses, each predicted by a fit to others (five folds). It decides whether the effect is confirmed. `None`
    /// beside a random walk, which folds do not tell: its odds alone decide then.
    pub folds_p_value: Option<f64>,
    /// Root mean square of the held-out residuals of the grown model without this effect, refitted.
    pub heldout_rms_before_counts: f64,
    /// The same for the whole grown model.
    pub heldout_rms_after_counts: f64,
    /// The free curve that it has in place of its formula, and the tables of its parameters.
    pub curves: Vec<FittedCurve>,
    /// Effects that these data cannot distinguish from this one.
    pub equivalent: Vec<&'static str>,
}

/// How probable an effect is, given the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inclusion {
    /// Its name.
    pub effect: &'static str,
    /// Probability that it acts: in the place of an added effect or beside them. An effect of which the data say nothing has that
    /// before the data, 1 in 21.
    pub probability: f64,
}

/// A free curve of an effect, or a table of one of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedCurve {
    /// Key of the places in the model file, with their unit; of a table what it is a function of.
    pub at: &'static str,
    /// Key of the values; of a table the parameter.
    pub of: &'static str,
    /// Its knots, in order of their places.
    pub knots: Vec<FittedKnot>,
    /// The formula that it replaces, if the data refute one.
    pub formula: Option<RefutedFormula>,
}

impl FittedCurve {
    /// True if it is a table of a parameter.
    pub fn is_table(&self) -> bool {
        By::ALL.iter().any(|by| by.name() == self.at)
    }
}

/// A knot of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedKnot {
    /// Its place.
    pub at: f64,
    /// The value there.
    pub value: f64,
    /// `None` where the data do not determine it.
    pub standard_error: Option<f64>,
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
    /// What it closes of the base model's gap; `None` where there is no gap to close.
    pub closed: Option<Closed>,
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
    /// Where the remainder is, strongest first.
    pub gap: Vec<Gap>,
    /// Share of the base model's gap.
    pub share: f64,
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
