//! Parameters of the whole model during a fit.

use tactus_model::effect::{By, Definition, Knots, ParameterKind, PipelineStage, Table};
use tactus_model::{Effect, Psf};

use super::random_walk::{RandomWalk, is_random_walk};
use crate::data::{DiscoverError, Known, rewired};

/// Parameters of the whole model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameters {
    /// Counts per mm, one per element.
    pub(crate) sensitivity: Vec<f64>,
    /// Factor of all sensitivities in each run.
    pub(crate) run_gain: Vec<f64>,
    /// Baselines, run by run, one per element.
    pub(crate) baseline: Vec<Vec<f64>>,
    /// Random walks of the baselines, if the model has them.
    pub(crate) walk: Option<RandomWalk>,
    pub(crate) psf: Psf,
    pub(crate) terms: Vec<Term>,
}

/// An effect in the model, with the values of its parameters during a fit.
#[derive(Debug, Clone)]
pub(crate) struct Term {
    pub(crate) definition: &'static Definition,
    /// One for each parameter; those that knots or tables replace do not act.
    pub(crate) values: Vec<f64>,
    /// The free curve in place of its formula, if it has one.
    pub(crate) knots: Option<Knots>,
    /// Tables in place of parameters, in their order. A term with a table has nothing else that is fitted.
    pub(crate) tables: Vec<(usize, Table)>,
}

impl PartialEq for Term {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.definition, other.definition)
            && (&self.values, &self.knots, &self.tables) == (&other.values, &other.knots, &other.tables)
    }
}

impl Term {
    pub(crate) fn neutral(definition: &'static Definition) -> Self {
        let values = definition.parameters.iter().map(|one| one.neutral).collect();
        Self { definition, values, knots: None, tables: Vec::new() }
    }

    /// A draft as it was drafted.
    pub(crate) fn of_draft(definition: &'static Definition) -> Self {
        let mut term = Self::neutral(definition);
        term.values[0] = 1.0;
        term
    }

    /// The strength of a draft, and of a tone what is a quarter of a period ahead.
    pub(crate) fn strength_of_draft(&self) -> [f64; 2] {
        [self.values[0], self.values.get(1).copied().unwrap_or(0.0)]
    }

    pub(crate) fn effect(&self) -> Result<Effect, DiscoverError> {
        let known = self.definition.parameters.iter().enumerate();
        let acting = known.filter(|(parameter, _)| self.acts(*parameter));
        let parameters = acting.map(|(parameter, known)| (known.name, self.values[parameter]));
        let tables = self.tables.iter();
        let tables =
            tables.map(|(parameter, table)| (self.definition.parameters[*parameter].name, table.clone()));
        Ok(Effect::with_tables(self.definition, parameters, self.knots.clone(), tables)?)
    }

    pub(crate) fn of(effect: &Effect) -> Self {
        let mut term = Self { knots: effect.knots().cloned(), ..Self::neutral(effect.definition()) };
        for (known, value) in term.definition.parameters.iter().zip(&mut term.values) {
            *value = effect.value(known.name).unwrap_or(known.neutral);
        }
        let index = |name| term.definition.parameters.iter().position(|known| known.name == name);
        let tables = effect.tables().filter_map(|(name, table)| Some((index(name)?, table.clone())));
        term.tables = tables.collect();
        term
    }

    /// True unless knots or a table replace a parameter.
    pub(crate) fn acts(&self, parameter: usize) -> bool {
        let in_knots =
            self.knots.is_some() && self.definition.replaces(self.definition.parameters[parameter].name);
        !in_knots && self.tables.iter().all(|(of, _)| *of != parameter)
    }

    /// True if fits vary a parameter.
    pub(super) fn varies(&self, parameter: usize) -> bool {
        let known = &self.definition.parameters[parameter];
        let is_left_out = known.is_apart && self.values[parameter].to_bits() == known.neutral.to_bits();
        known.kind == ParameterKind::Real && !is_left_out && self.tables.is_empty() && self.acts(parameter)
    }

    /// True if a parameter is one of several whose names differ in their number: a knot of a curve.
    pub(super) fn is_numbered(&self, parameter: usize) -> bool {
        let family = self.family(parameter);
        (0..self.values.len()).any(|other| other != parameter && self.family(other) == family)
    }

    /// A parameter's name without digits.
    pub(super) fn family(&self, parameter: usize) -> String {
        self.definition.parameters[parameter].name.replace(|letter: char| letter.is_ascii_digit(), "")
    }

    /// Number of real numbers that make it.
    pub(crate) fn numbers(&self) -> usize {
        (0..self.values.len()).filter(|parameter| self.varies(*parameter)).count() + self.listed()
    }

    /// Number of values of its knots and tables.
    pub(crate) fn listed(&self) -> usize {
        let of_knots = self.knots.as_ref().map_or(0, |knots| knots.values.len());
        of_knots + self.tables.iter().map(|(_, table)| table.values.len()).sum::<usize>()
    }

    /// The element whose signal this term replaces, if it is a term of that kind.
    pub(crate) fn rewires(&self) -> Option<usize> {
        rewired(self.definition, self.values.iter().copied())
    }
}

impl Parameters {
    /// The declared parameters, for a number of runs.
    pub(crate) fn declared(known: &Known, runs: usize) -> Self {
        Self {
            sensitivity: known.response.sensitivity_counts_per_mm.clone(),
            run_gain: vec![1.0; runs],
            baseline: vec![known.response.baseline_counts.clone(); runs],
            walk: None,
            psf: known.psf,
            terms: known.effects.iter().map(Term::of).collect(),
        }
    }

    /// True if the terms are those of another model in the same order, whatever their values.
    pub(crate) fn has_terms_like(&self, other: &Self) -> bool {
        type Kind = (&'static str, bool, Vec<(usize, By)>);
        let kind = |term: &Term| -> Kind {
            let tables = term.tables.iter().map(|(parameter, table)| (*parameter, table.by));
            (term.definition.name, term.knots.is_some(), tables.collect())
        };
        let kinds = |of: &Self| -> Vec<Kind> { of.terms.iter().map(kind).collect() };
        kinds(self) == kinds(other)
    }

    /// The same with one more term.
    pub(crate) fn with(&self, term: Term) -> Self {
        let mut with = self.clone();
        with.terms.push(term);
        with
    }

    /// After how many effects of the covering this model first differs from another; `None` if it differs before the signal that
    /// reaches the elements.
    pub(crate) fn shared(&self, other: &Self) -> Result<Option<usize>, DiscoverError> {
        let before = |of: &Self| -> Result<Vec<Term>, DiscoverError> {
            let mut before = Vec::new();
            for term in &of.terms {
                if term.effect()?.acts_before_signal() {
                    before.push(term.clone());
                }
            }
            Ok(before)
        };
        if self.psf != other.psf || before(self)? != before(other)? {
            return Ok(None);
        }
        let covering = |of: &'_ Self| -> Vec<Term> {
            let terms = of.terms.iter();
            terms.filter(|term| term.definition.stage() == PipelineStage::Covering).cloned().collect()
        };
        let both = covering(self).into_iter().zip(covering(other));
        Ok(Some(both.take_while(|(one, other)| one == other).count()))
    }

    /// The same gains with run factors of which the geometric mean is 1.
    pub(crate) fn centred(&self) -> (Vec<f64>, Vec<f64>) {
        let runs = self.run_gain.len().max(1) as f64;
        let mean = (self.run_gain.iter().map(|gain| gain.ln()).sum::<f64>() / runs).exp();
        let times = |of: &[f64], factor: f64| of.iter().map(|gain| gain * factor).collect();
        (times(&self.sensitivity, mean), times(&self.run_gain, 1.0 / mean))
    }

    /// Baselines of the elements, the mean over the runs.
    pub(crate) fn mean_baseline(&self) -> Vec<f64> {
        let runs = self.baseline.len().max(1) as f64;
        let mean = |element: usize| self.baseline.iter().map(|run| run[element]).sum::<f64>() / runs;
        (0..self.sensitivity.len()).map(mean).collect()
    }

    /// The effects as effects of the library; a random walk becomes several.
    pub(crate) fn effects(&self) -> Result<Vec<Effect>, DiscoverError> {
        let terms = self.terms.iter().filter(|term| !is_random_walk(term));
        let mut effects = terms.map(Term::effect).collect::<Result<Vec<_>, _>>()?;
        if let Some(walk) = &self.walk {
            effects.extend(walk.effects(self.sensitivity.len())?);
        }
        Ok(effects)
    }
}
