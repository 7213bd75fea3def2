//! The verdict on a search, and the [`Discovery`] that reports it.

use tactus_model::{Effect, Response};

use crate::discovery::{
    AddedEffect, BaseModel, Discovery, ElementGap, Estimated, Final, GlobalTest, Level, NotShown, Split,
    Unexplained, Verdict,
};
use crate::faulty::MISWIRED;
use crate::fit::{Fitted, Problem};
use crate::locate::Located;
use crate::next::{Explanation, Pair, Planner};
use crate::noise::Noise;
use crate::predictor::{Parameters, Predictor, Term};
use crate::prepare::Prepared;
use crate::random_walk::RandomWalk;
use crate::score::{q_values, sign_flip_p};
use crate::search::{ALPHA, Equivalent, FLIPS, POLISH_ROUNDS, Rivals, Search, Tried, names, without};
use crate::{DiscoverError, Options, Rule, not_shown};

/// Greatest remaining share of the gap for the verdict `Explained`.
const EXPLAINED_SHARE: f64 = 0.1;
/// All added effects are withdrawn if more than this share of the gap certainly remains, or if the remainder depends on a
/// covariate and is more than this share of a gap that is well known,
const UNEXPLAINED_SHARE: f64 = 0.3;
/// or, if the gap is not well known, if the statistic of the dependence exceeds this value and this share of the initial one.
const LEFT_Z: f64 = 5.2;
const LEFT_SHARE: f64 = 0.45;
/// A single effect is also withdrawn if more than this share remains, and certainly more than [`EXPLAINED_SHARE`]. Several
/// correct effects may leave as much together.
const LONE_SHARE: f64 = 0.5;

/// The outcome of a search.
pub(crate) struct SearchOutcome {
    /// Effects that were not tried, because the data cannot show them.
    pub(crate) lacking: Vec<NotShown>,
    pub(crate) base: Fitted,
    pub(crate) grown: Fitted,
    pub(crate) rounds: Vec<Tried>,
    pub(crate) equivalent: Equivalent,
    /// Where the base model and the data disagree, and where the grown model still does.
    pub(crate) before: Located,
    pub(crate) after: Located,
}

/// The residual of a model on the held-out frames.
struct HeldOutResidual {
    level: Level,
    /// Root mean square for each element.
    elements_rms_counts: Vec<f64>,
    /// For all frames, fitted and held out: frame by frame, element by element.
    residual: Vec<f32>,
}

impl HeldOutResidual {
    /// The residual of each element, and that of a grown model.
    fn elements_beside(&self, grown: &Self) -> Vec<ElementGap> {
        let elements = self.elements_rms_counts.iter().zip(&grown.elements_rms_counts);
        elements
            .map(|(before, after)| ElementGap { before_rms_counts: *before, after_rms_counts: *after })
            .collect()
    }
}

/// Decides the verdict and builds the report of a search.
pub(crate) fn conclude(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    found: SearchOutcome,
    options: Options,
) -> Result<Discovery, DiscoverError> {
    let Prepared { known, frames, heldout, lattice, faulty, .. } = prepared;
    let SearchOutcome { lacking, base, mut grown, rounds, equivalent, before, after } = found;
    // Two tests: Bonferroni's correction.
    let first = rounds.first();
    let p_value = (2.0 * first.map_or(1.0, |round| round.p_value).min(before.p_value)).min(1.0);
    let share = search.share_left(&base, &grown);
    let left = after.p_value <= ALPHA;
    let count = names(&grown.parameters, search.known_terms).len();
    // Coarse steps scatter only readings that change; this scatter does not count as a remainder.
    let certain = if count > 0 && lattice.is_none() { search.certain_share_left(&base, &grown) } else { 0.0 };
    // A small gap is judged by the dependence on covariates, a large one by the share that remains.
    let clear = after.statistic > LEFT_Z.max(LEFT_SHARE * before.statistic);
    let large = search.problem.heldout_gap(&base.predicted).is_large();
    // The remainder of a single effect that closes most of the gap is an error of its form. Several effects that leave as
    // much are a patchwork.
    let is_form = count == 1 && search.likely_share_left(&base, &grown) <= UNEXPLAINED_SHARE;
    let is_little = count == 1 && share > LONE_SHARE && certain > EXPLAINED_SHARE;
    let leaves_too_much = certain > UNEXPLAINED_SHARE
        || is_little
        || left && if large { share > UNEXPLAINED_SHARE } else { clear && !is_form };
    if leaves_too_much && options.rule == Rule::Protocol {
        // Effects that leave so much are not the explanation.
        grown = base.clone();
    }
    let named = !names(&grown.parameters, search.known_terms).is_empty();
    let missing = p_value <= ALPHA && options.rule == Rule::Protocol;
    let verdict = match (named || lattice.is_some(), missing) {
        (false, false) if !faulty.terms.is_empty() => Verdict::Explained,
        (false, true) if !faulty.terms.is_empty() => Verdict::PartlyExplained,
        (false, false) => Verdict::NothingMissing,
        (false, true) => Verdict::Unexplained,
        (true, _) if certain <= EXPLAINED_SHARE && (share <= EXPLAINED_SHARE || !left) => Verdict::Explained,
        (true, _) => Verdict::PartlyExplained,
    };

    let (of_base, of_grown) = (prepared.held(&base.parameters)?, prepared.held(&grown.parameters)?);
    let floor = prepared.floor_counts(&of_grown);
    let in_noise = |level: Level| Level { heldout_chi2: (level.heldout_rms_counts / floor).powi(2), ..level };
    let squares = |held: &HeldOutResidual| held.level.heldout_rms_counts.powi(2);
    let (gap, closed) = (squares(&of_base) - floor.powi(2), squares(&of_base) - squares(&of_grown));

    let mut not_shown = lacking;
    not_shown.extend(first.map_or_else(Vec::new, |round| not_shown::out_of_sight(&round.screened)));
    let mut steps = search.steps(&grown, &equivalent, &prepared.problem_with_silent())?;
    let mut effects = grown.parameters.effects()?;
    if let Some((step_counts, p_value)) = lattice {
        effects.push(Effect::new("quantisation", [("step_counts", *step_counts)])?);
        steps.push(coarse(*step_counts, *p_value, of_grown.level.heldout_rms_counts));
    }
    let explained =
        |name: &'static str, fitted: &Fitted| Explanation { name, parameters: fitted.parameters.clone() };
    let mut pairs: Vec<Pair> = Vec::new();
    for (name, Rivals { without, same }) in equivalent.iter().filter(|_| named) {
        pairs.extend(same.iter().map(|(rival, fitted)| Pair {
            of: [explained(name, &grown), explained(rival, fitted)],
            without: without.parameters.clone(),
            gain: without.cost - grown.cost,
        }));
    }
    let planner = Planner { known, frames, noise: &prepared.noise };
    let mut next_experiments = planner.propose(&pairs)?;
    next_experiments.extend(planner.show(&not_shown, &grown.parameters)?);

    Ok(Discovery {
        seed: options.seed,
        not_shown,
        warnings: prepared.warnings.clone(),
        split: Split {
            frames: frames.len(),
            train_presses: heldout.train_presses,
            heldout_presses: heldout.presses,
            heldout_depths_mm: heldout.depths_mm.clone(),
            heldout_coverings_mm: heldout.coverings_mm.clone(),
        },
        heldout_frames: heldout.frames.clone(),
        noise_rms_counts: prepared.replicates.then_some(floor),
        faulty: faulty.elements.clone(),
        base: in_noise(of_base.level),
        global: GlobalTest { statistic: before.statistic, p_value },
        gap: before.gap,
        curves: search.curves(&base, &grown)?,
        elements: of_base.elements_beside(&of_grown),
        rounds: rounds.into_iter().map(|tried| tried.round).collect(),
        steps,
        final_: Final {
            level: in_noise(of_grown.level),
            // By chance the remainder may be smaller than the noise.
            shrink: (p_value <= ALPHA && gap > 0.0).then(|| (closed / gap).min(1.0)),
        },
        verdict,
        unexplained: Unexplained {
            depends_on: if left && verdict != Verdict::NothingMissing {
                after.gap.iter().map(|gap| gap.covariate).collect()
            } else {
                Vec::new()
            },
            share: match verdict {
                Verdict::NothingMissing => 0.0,
                Verdict::Unexplained => 1.0,
                // Faulty elements are in the base, so that nothing of its gap is left to close.
                Verdict::Explained if !named && lattice.is_none() => 0.0,
                Verdict::Explained | Verdict::PartlyExplained => share.max(certain),
            },
        },
        next_experiments,
        recalibrated: base_of(prepared, &base.parameters),
        effects,
        grown: base_of(prepared, &grown.parameters),
    })
}

/// The added effect for a converter that is coarser than declared.
fn coarse(step_counts: f64, p_value: f64, heldout_rms_counts: f64) -> AddedEffect {
    AddedEffect {
        effect: "quantisation",
        terms: vec![vec![Estimated { name: "step_counts", value: step_counts, standard_error: None }]],
        p_value,
        q_value: p_value,
        // It does not change a mean.
        heldout_rms_before_counts: heldout_rms_counts,
        heldout_rms_after_counts: heldout_rms_counts,
        equivalent: Vec::new(),
    }
}

fn base_of(prepared: &Prepared<'_>, parameters: &Parameters) -> BaseModel {
    let response = Response {
        sensitivity_counts_per_mm: parameters.sensitivity.clone(),
        baseline_counts: parameters.mean_baseline(),
        ..prepared.known.response.clone()
    };
    BaseModel {
        psf: parameters.psf,
        response,
        run_baselines_counts: parameters.baseline.clone(),
        run_walks: parameters.walk.as_ref().and_then(RandomWalk::apart),
    }
}

impl Prepared<'_> {
    /// The residual of a model on the held-out frames.
    fn held(&self, parameters: &Parameters) -> Result<HeldOutResidual, DiscoverError> {
        let Self { known, frames, heldout, noise, whole, .. } = self;
        let predicted = Predictor::new(known, frames, whole).predict(parameters)?;
        let elements = frames.elements;
        let mut squares = vec![0.0; elements];
        let mut count = 0.0_f64;
        for (frame, of) in
            predicted.chunks_exact(elements).enumerate().filter(|(frame, _)| heldout.frames[*frame])
        {
            count += 1.0;
            for ((sum, counts), of) in squares.iter_mut().zip(frames.counts_of(frame)).zip(of) {
                *sum += (f64::from(*counts) - of).powi(2);
            }
        }
        let count = count.max(1.0);
        let weightless = |element: usize| self.faulty.is_weightless(element);
        let weighed: Vec<f64> =
            (0..elements).filter(|element| !weightless(*element)).map(|element| squares[element]).collect();
        let mean = weighed.iter().sum::<f64>() / (count * weighed.len().max(1) as f64);
        #[expect(clippy::cast_possible_truncation, reason = "as precise as counts are")]
        let residual = frames.counts.iter().zip(&predicted).map(|(counts, of)| counts - *of as f32).collect();
        Ok(HeldOutResidual {
            level: Level { heldout_rms_counts: mean.sqrt(), heldout_chi2: mean / noise.rms_counts.powi(2) },
            elements_rms_counts: (0..elements)
                .map(|element| if weightless(element) { f64::NAN } else { (squares[element] / count).sqrt() })
                .collect(),
            residual,
        })
    }

    /// The noise given the grown model. Before a tone is in the model, it looks like noise.
    fn floor_counts(&self, grown: &HeldOutResidual) -> f64 {
        let left = Noise::of_residual(self.frames, &grown.residual, &self.still, self.step_counts);
        let left = left.map(|left| left.without(|element| self.faulty.is_weightless(element)));
        left.map_or(self.noise.rms_counts, |left| left.rms_counts.min(self.noise.rms_counts))
    }
}

impl Search<'_> {
    /// Remaining share of the gap, less the uncertainty of the noise.
    fn share_left(&self, base: &Fitted, grown: &Fitted) -> f64 {
        let left = self.problem.heldout_gap(&grown.predicted).sure();
        self.share_of(base, grown, left)
    }

    /// Remaining share of the gap for the most likely noise.
    fn likely_share_left(&self, base: &Fitted, grown: &Fitted) -> f64 {
        let left = self.problem.heldout_gap(&grown.predicted).value.max(0.0);
        self.share_of(base, grown, left)
    }

    /// Remaining share of the gap from the comparison of readings with and without a signal, which does not need the noise.
    fn certain_share_left(&self, base: &Fitted, grown: &Fitted) -> f64 {
        let left = self.problem.surely_left(grown);
        if left > 0.0 { self.share_of(base, grown, left) } else { 0.0 }
    }

    fn share_of(&self, base: &Fitted, grown: &Fitted, left: f64) -> f64 {
        let [closed, _] = self.problem.heldout_gain(base, grown);
        if closed + left > 0.0 { (left / (closed + left)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// The added effects, those of faulty elements included, each name once. `with_silent` is the problem in which dead and stuck elements
    /// have a weight.
    pub(crate) fn steps(
        &self,
        grown: &Fitted,
        equivalent: &Equivalent,
        with_silent: &Problem<'_>,
    ) -> Result<Vec<AddedEffect>, DiscoverError> {
        let known_terms = self.problem.predictor.known.effects.len();
        let names = names(&grown.parameters, known_terms);
        let mut steps = Vec::new();
        for name in names {
            let problem = if name == MISWIRED { with_silent } else { self.problem };
            let less = without(&grown.parameters, name, known_terms);
            let before = problem.fit_from(less, POLISH_ROUNDS)?;
            let gains = problem.heldout_gains(&before.predicted, &grown.predicted);
            let terms = grown.parameters.terms.iter().zip(&grown.errors).skip(known_terms);
            let estimated = |(term, errors): (&Term, &Vec<f64>)| {
                term.definition
                    .parameters
                    .iter()
                    .zip(&term.values)
                    .zip(errors)
                    .map(|((known, value), error)| Estimated {
                        name: known.name,
                        value: *value,
                        // An error greater than the range means that the data do not determine it.
                        standard_error: Some(*error)
                            .filter(|error| *error <= known.range[1] - known.range[0]),
                    })
                    .collect()
            };
            let p_value = sign_flip_p(&gains, FLIPS, self.options.seed);
            steps.push(AddedEffect {
                effect: name,
                terms: terms.filter(|(term, _)| term.definition.name == name).map(estimated).collect(),
                p_value,
                q_value: p_value,
                heldout_rms_before_counts: problem.heldout_rms_counts(&before.predicted),
                heldout_rms_after_counts: problem.heldout_rms_counts(&grown.predicted),
                equivalent: equivalent
                    .get(name)
                    .into_iter()
                    .flat_map(|rivals| rivals.same.iter().map(|(rival, _)| *rival))
                    .collect(),
            });
        }
        let p_values: Vec<f64> = steps.iter().map(|step| step.p_value).collect();
        for (step, q_value) in steps.iter_mut().zip(q_values(&p_values)) {
            step.q_value = q_value;
        }
        Ok(steps)
    }
}
