//! The best fit of each effect of the library to counts without noise: how far a name is from the wrong ones.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::{Definition, ParameterKind, REGISTRY};
use tactus_model::{Effect, Images};

use crate::oracle::SeparationOracle;
use crate::separation::Separation;

/// How far effects of the library, fitted to the counts, stay from them.
///
/// Each is `z_c = sqrt(chi2)` of what the best fit leaves, as [`Separation::z_beyond_spread`]: gains, offsets and spread are
/// fitted too. It is an upper bound, since a search from a few starts may miss the best fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ClassFits {
    /// Of the base model alone.
    pub base: f64,
    /// By the effect's name.
    pub effects: BTreeMap<String, f64>,
}

impl ClassFits {
    /// `min over wrong c of sqrt(max(0, z_c^2 - z_true^2))`: how far the nearest wrong effect fits worse than the true one, of those that
    /// are fitted. An effect that is neutral leaves what the base model leaves, and none fits worse. `None` if the true one is not fitted.
    pub fn z_name(&self, effect: &str) -> Option<f64> {
        let right = self.effects.get(effect)?.min(self.base);
        let wrong = self.effects.iter().filter(|(name, _)| *name != effect).map(|(_, z)| *z);
        Some((wrong.fold(self.base, f64::min).powi(2) - right.powi(2)).max(0.0).sqrt())
    }

    /// The share of what the base model leaves that an effect explains.
    pub fn shrink(&self, effect: &str) -> Option<f64> {
        Some(1.0 - (self.effects.get(effect)? / self.base).powi(2))
    }
}

/// Fits effects to the counts of one set.
pub(crate) struct Fitter<'a> {
    oracle: &'a SeparationOracle<'a>,
    /// The counts to fit.
    with: &'a [f64],
    images: Arc<Images>,
    /// The base model's counts.
    plain: Vec<f64>,
}

/// An effect with its values, and the spread as a multiple of the true one.
#[derive(Debug, Clone)]
struct Guess {
    definition: &'static Definition,
    values: Vec<f64>,
    spread: f64,
    z: f64,
}

/// Wrong effects whose fit goes on after the first linear step: the nearest ones.
const NEAREST: usize = 3;
/// Damped steps of a fit.
const STEPS: usize = 8;
/// A fit ends when a step reduces z by less than this share.
const GAIN_LEAST: f64 = 1e-3;
pub(crate) const IMAGES_MAX: usize = 60_000;
/// Times at which shapes start, in s.
const TIMES_S: [f64; 3] = [0.3, 3.0, 30.0];

impl<'a> Fitter<'a> {
    pub(crate) fn new(oracle: &'a SeparationOracle<'a>, with: &'a [f64]) -> Self {
        let images = Arc::new(Images::new(IMAGES_MAX));
        Self { oracle, with, images, plain: oracle.clean.clone() }
    }

    /// The fits of effects, in full those of the right one and of the nearest others. They end with a wrong one that makes
    /// [`ClassFits::z_name`] less than `enough`: a nearer one would tell nothing more.
    pub(crate) fn until(&self, right: &'static Definition, enough: f64) -> ClassFits {
        let mut fits = self.one(right);
        let is_enough = |fits: &ClassFits| fits.z_name(right.name).is_some_and(|z| z < enough);
        let is_twin = |other: &&Definition| right.near_twins.contains(&other.name);
        let (twins, strangers): (Vec<&'static Definition>, Vec<_>) =
            REGISTRY.iter().copied().partition(is_twin);
        let mut guesses = Vec::new();
        for other in twins.into_iter().chain(strangers).filter(|other| other.name != right.name) {
            if is_enough(&fits) {
                return fits;
            }
            let guess = self.first(other);
            fits.effects.insert(other.name.to_owned(), guess.z);
            guesses.push(guess);
        }
        guesses.sort_by(|one, other| one.z.total_cmp(&other.z));
        for guess in guesses.into_iter().take(NEAREST) {
            if is_enough(&fits) {
                break;
            }
            fits.effects.insert(guess.definition.name.to_owned(), self.polished(guess).z);
        }
        fits
    }

    /// The fit of one effect.
    pub(crate) fn one(&self, definition: &'static Definition) -> ClassFits {
        let z = self.polished(self.first(definition)).z;
        ClassFits { base: self.base_z(), effects: [(definition.name.to_owned(), z)].into() }
    }

    fn base_z(&self) -> f64 {
        self.oracle.separation_of(self.with).z_beyond_spread
    }

    /// The best of the linear steps from all starts.
    fn first(&self, definition: &'static Definition) -> Guess {
        let neutral: Vec<f64> = definition.parameters.iter().map(|one| one.neutral).collect();
        let spread = 1.0;
        let mut best = self.judged(Guess { definition, values: neutral.clone(), spread, z: f64::INFINITY });
        for values in self.starts(definition, neutral) {
            let start = self.judged(Guess { values, ..best.clone() });
            let tried = self.stepped(&start, 1e-9).unwrap_or_else(|| start.clone());
            for guess in [start, tried] {
                if guess.z < best.z {
                    best = guess;
                }
            }
        }
        best
    }

    /// Damped Gauss-Newton steps from a guess (Levenberg and Marquardt).
    fn polished(&self, mut guess: Guess) -> Guess {
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            match self.stepped(&guess, damping) {
                Some(next) if next.z < guess.z => {
                    let is_done = next.z > (1.0 - GAIN_LEAST) * guess.z;
                    guess = next;
                    damping *= 0.1;
                    if is_done {
                        break;
                    }
                }
                _ => damping *= 30.0,
            }
        }
        guess
    }

    /// One damped step of the effect's parameters and the spread, kept within the ranges.
    fn stepped(&self, at: &Guess, damping: f64) -> Option<Guess> {
        let counts = self.counts(at)?;
        let rest: Vec<f64> = self.with.iter().zip(&counts).map(|(with, counts)| with - counts).collect();
        let mut columns = Vec::new();
        let mut moved: Vec<(Option<usize>, f64)> = Vec::new();
        for free in free(at.definition).map(Some).chain([None]) {
            let mut nudged = at.clone();
            let by = nudged.nudge(free);
            let column: Vec<f64> =
                self.counts(&nudged)?.iter().zip(&counts).map(|(more, less)| (more - less) / by).collect();
            if column.iter().any(|slope| *slope != 0.0) {
                columns.push(column);
                moved.push((free, by));
            }
        }
        let count = columns.len();
        let (gram, wanted) = normal(&counts, &rest, &columns, self.oracle.base.rig.array.elements());
        let damped =
            &gram + DMatrix::from_diagonal(&(gram.diagonal() * damping).add_scalar(f64::MIN_POSITIVE));
        let step = damped.cholesky()?.solve(&wanted);
        let mut next = at.clone();
        for place in 0..count {
            next.shift(moved[place].0, step[place]);
        }
        Some(self.judged(next))
    }

    fn judged(&self, mut guess: Guess) -> Guess {
        let sigma_counts = self.oracle.sigma_counts();
        let elements = self.oracle.base.rig.array.elements();
        guess.z = self.counts(&guess).map_or(f64::INFINITY, |counts| {
            Separation::new(&counts, self.with, &counts, elements, sigma_counts).z
        });
        guess
    }

    /// Counts of all frames; `None` where the model refuses a value.
    fn counts(&self, guess: &Guess) -> Option<Vec<f64>> {
        let names = guess.definition.parameters.iter().map(|one| one.name);
        let effect = Effect::of(guess.definition, names.zip(guess.values.iter().copied())).ok()?;
        let base = self.oracle.base.spread_by(guess.spread).ok()?;
        self.oracle.modelled(&base, &effect, &self.images).ok()
    }

    /// Values from which a fit starts: neutral amplitudes at several shapes.
    fn starts(&self, definition: &'static Definition, neutral: Vec<f64>) -> Vec<Vec<f64>> {
        let with = |starts: &[Vec<f64>], place: usize, values: &[f64]| -> Vec<Vec<f64>> {
            let set = |start: &Vec<f64>, value: f64| {
                let mut set = start.clone();
                set[place] = value;
                set
            };
            starts.iter().flat_map(|start| values.iter().map(move |value| set(start, *value))).collect()
        };
        let mut starts = vec![neutral];
        for (place, parameter) in definition.parameters.iter().enumerate() {
            let [least, most] = parameter.range;
            starts = match parameter.name {
                "duration_s" => with(&starts, place, &[self.duration_s().clamp(least, most)]),
                "frequency_hz" => with(&starts, place, &self.tones_hz()),
                "by_depth" | "own_share" if parameter.neutral == 0.0 => with(&starts, place, &[0.0, 1.0]),
                "step_counts" => {
                    let declared = self.oracle.base.rig.array.step_counts();
                    let steps: Vec<f64> = (2..=64).map(|steps| f64::from(steps) * declared).collect();
                    with(&starts, place, &steps)
                }
                name if name.ends_with("_s") && parameter.neutral > 0.0 => {
                    with(&starts, place, &TIMES_S.map(|time_s| time_s.clamp(least, most)))
                }
                _ => starts,
            };
        }
        if definition.parameters.iter().any(|one| one.kind == ParameterKind::Element) {
            starts = self.wired();
        }
        starts
    }

    fn duration_s(&self) -> f64 {
        let frames = self.oracle.planned.iter().map(|run| run.frames).max().unwrap_or(0);
        frames as f64 / self.oracle.base.rig.array.rate_hz()
    }

    /// The strongest lines of the residual's spectrum: of the elements' mean, and of the first element.
    fn tones_hz(&self) -> Vec<f64> {
        let elements = self.oracle.base.rig.array.elements();
        let rate_hz = self.oracle.base.rig.array.rate_hz();
        let rest: Vec<f64> = self.with.iter().zip(&self.plain).map(|(with, plain)| with - plain).collect();
        let mean = |row: &[f64]| row.iter().sum::<f64>() / elements as f64;
        let series: [Vec<f64>; 2] =
            [rest.chunks(elements).map(mean).collect(), rest.chunks(elements).map(|row| row[0]).collect()];
        series.iter().map(|series| strongest_hz(series, rate_hz)).collect()
    }

    /// For the element that the base model fits worst: dead, answering for each neighbour, and neutral with each.
    fn wired(&self) -> Vec<Vec<f64>> {
        let array = &self.oracle.base.rig.array;
        let (elements, cols) = (array.elements(), array.cols());
        let mut worst = vec![0.0; elements];
        for (with, plain) in self.with.chunks(elements).zip(self.plain.chunks(elements)) {
            worst.iter_mut().zip(with.iter().zip(plain)).for_each(|(sum, (a, b))| *sum += (a - b).powi(2));
        }
        let element = (0..elements).max_by(|one, other| worst[*one].total_cmp(&worst[*other])).unwrap_or(0);
        let is_beside = |other: &usize| {
            let rows_apart = (other / cols).abs_diff(element / cols);
            let cols_apart = (other % cols).abs_diff(element % cols);
            rows_apart + cols_apart == 1
        };
        let own = element as f64;
        let mut starts = vec![vec![own, own, 0.0, 0.0]];
        for other in (0..elements).filter(is_beside) {
            starts.push(vec![own, other as f64, 0.0, 1.0]);
            starts.push(vec![own, other as f64, 1.0, 0.0]);
        }
        starts
    }
}

impl Guess {
    /// Moves one parameter, or the spread, by a small step within its range, and tells the step.
    fn nudge(&mut self, free: Option<usize>) -> f64 {
        let Some(place) = free else {
            self.spread *= 1.0 + 1e-3;
            return 1e-3 * self.spread / (1.0 + 1e-3);
        };
        let [least, most] = self.definition.parameters[place].range;
        let value = self.values[place];
        let by = (1e-3 * value.abs()).max(1e-4 * (most - least).min(1.0));
        let by = if value + by > most { -by } else { by };
        self.values[place] += by;
        by
    }

    fn shift(&mut self, free: Option<usize>, by: f64) {
        match free {
            None => self.spread = (self.spread + by).clamp(0.5, 2.0),
            Some(place) => {
                let [least, most] = self.definition.parameters[place].range;
                self.values[place] = (self.values[place] + by).clamp(least, most);
            }
        }
    }
}

/// The normal equations of columns for a rest, each element's gain on the counts and offset projected out.
fn normal(
    counts: &[f64],
    rest: &[f64],
    columns: &[Vec<f64>],
    elements: usize,
) -> (DMatrix<f64>, DVector<f64>) {
    let free = columns.len();
    let mut gram = DMatrix::zeros(free, free);
    let mut wanted = DVector::zeros(free);
    let all: Vec<&[f64]> = [counts, rest].into_iter().chain(columns.iter().map(Vec::as_slice)).collect();
    for element in 0..elements {
        let centred: Vec<Vec<f64>> = all
            .iter()
            .map(|series| {
                let own = series.iter().skip(element).step_by(elements);
                let mean = own.clone().sum::<f64>() / (series.len() / elements) as f64;
                own.map(|value| value - mean).collect()
            })
            .collect();
        let product = |one: usize, other: usize| -> f64 {
            centred[one].iter().zip(&centred[other]).map(|(a, b)| a * b).sum()
        };
        let clean = product(0, 0);
        let on_clean: Vec<f64> =
            (0..all.len()).map(|of| if clean > 0.0 { product(0, of) / clean } else { 0.0 }).collect();
        let rest_of =
            |one: usize, other: usize| product(one, other) - on_clean[one] * on_clean[other] * clean;
        for one in 0..free {
            wanted[one] += rest_of(one + 2, 1);
            for other in 0..=one {
                let both = rest_of(one + 2, other + 2);
                gram[(one, other)] += both;
                if one != other {
                    gram[(other, one)] += both;
                }
            }
        }
    }
    (gram, wanted)
}

/// Frequency of the strongest line of a series, by its periodogram in steps of half a line's width.
fn strongest_hz(series: &[f64], rate_hz: f64) -> f64 {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let power = |line: usize| {
        let (sin, cos) = (TAU * line as f64 / (2 * series.len()) as f64).sin_cos();
        let (mut re, mut im, mut a, mut b) = (0.0, 0.0, 1.0, 0.0);
        for value in series {
            re += (value - mean) * a;
            im += (value - mean) * b;
            (a, b) = (a * cos - b * sin, a * sin + b * cos);
        }
        re * re + im * im
    };
    let lines = (4..series.len()).map(|line| (line, power(line)));
    let (line, _) = lines.max_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((4, 0.0));
    line as f64 * rate_hz / (2 * series.len()) as f64
}

/// Parameters that a fit varies.
fn free(definition: &'static Definition) -> impl Iterator<Item = usize> {
    let parameters = definition.parameters.iter().enumerate();
    parameters
        .filter(|(_, one)| one.kind == ParameterKind::Real && one.name != "duration_s")
        .map(|(place, _)| place)
}

#[cfg(test)]
#[path = "nearest_tests.rs"]
mod tests;
