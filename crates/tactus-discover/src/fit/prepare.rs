//! Preparation of a search: split, noise, bins, recalibrated base model, and lines in the spectrum.

use std::sync::Arc;

use tactus_model::Images;

use super::parameters::{Parameters, Term};
use super::predictor::{Predictor, no_images};
use super::problem::{Fitted, Problem};
use crate::data::{
    Averaged, Bins, Converter, DiscoverError, Faulty, Floor, Frames, HeldOut, Known, Line, Noise, Rounding,
    TooLittle, spectrum, still,
};

/// Least number of fitted presses.
const PRESSES_LEAST: usize = 3;
/// Greatest number of rounds of the base model's fit.
const BASE_ROUNDS: usize = 12;

/// The prepared data.
pub(crate) struct Prepared<'a> {
    pub(crate) known: &'a Known,
    pub(crate) frames: &'a Frames,
    pub(crate) heldout: HeldOut,
    pub(crate) still: Vec<usize>,
    /// The elements that calibration finds faulty.
    pub(crate) faulty: Faulty,
    /// Infinite for elements without weight.
    pub(crate) noise: Noise,
    /// The same with the noise of dead and stuck elements, to show what their effects explain.
    pub(crate) noise_of_silent: Noise,
    pub(crate) floor: Floor,
    /// True if the tip rests long enough to show tones and steps.
    pub(crate) replicates: bool,
    /// Step of the converter: as declared, or wider if the readings show this.
    pub(crate) step_counts: f64,
    /// The converter, if the readings show that it is not as declared.
    pub(crate) converter: Option<Converter>,
    /// One frame in each bin, without counts.
    pub(crate) whole: Bins,
    pub(crate) bins: Bins,
    /// The base model, recalibrated on the bins.
    pub(crate) base: Fitted,
    /// Lines in the spectrum of the base model's residual; a grid of frequencies would miss them.
    pub(crate) lines: Vec<Line>,
    pub(crate) warnings: Vec<String>,
    /// One cache for all predictions of these data.
    images: Arc<Images>,
}

impl<'a> Prepared<'a> {
    pub(crate) fn new(known: &'a Known, frames: &'a Frames, seed: u64) -> Result<Self, DiscoverError> {
        Self::read_by(Converter::seen(frames, known.array.step_counts()), known, frames, seed)
    }

    /// Frames, read by a converter that may not be as declared.
    pub(crate) fn read_by(
        converter: Option<Converter>,
        known: &'a Known,
        frames: &'a Frames,
        seed: u64,
    ) -> Result<Self, DiscoverError> {
        let heldout = HeldOut::choose(frames, seed);
        if heldout.train_presses < PRESSES_LEAST {
            return Err(TooLittle::FewPresses { fitted: heldout.train_presses, least: PRESSES_LEAST }.into());
        }
        let still = still(frames);
        let declared_counts = known.array.step_counts();
        let step_counts = converter.as_ref().map_or(declared_counts, |one| one.step_counts(declared_counts));
        let step_counts = frames.step_of_means(step_counts);
        let (mut noise, floor) = Noise::measured(frames, &still, step_counts);
        let rounds = converter.as_ref().is_some_and(Converter::rounds);
        if rounds {
            // Steps so coarse round small signals the same way in every press.
            noise.repeated_frames = f64::INFINITY;
        }
        let replicates = Noise::of(frames, &frames.counts, &still, step_counts).is_some();
        let mut warnings = Vec::new();
        if frames.joined() > 1 {
            warnings.push(format!(
                "the recording is long and its sensor fast: each {} frames that follow each other are read as their mean, and what is faster is not looked for",
                frames.joined()
            ));
        }
        if frames.left_out() > 0 {
            warnings.push(format!(
                "the recording is long: {} of its {} frames are read, whole presses from all of it, and of the others only the tip's way",
                frames.given() - frames.left_out(),
                frames.given()
            ));
        }
        if matches!(floor, Floor::Repeats { .. }) {
            warnings.push(
                "the tip never rests for some frames: the noise is that between presses that repeat each other, and contains what \
                 differs from press to press"
                    .to_owned(),
            );
        }
        let faulty = Faulty::of(known, frames, &noise)?;
        warnings.extend(faulty.warning.clone());
        let noise_of_silent = noise.clone().without(|element| faulty.noisy.contains(&element));
        let noise = noise.without(|element| faulty.is_weightless(element));
        let floor = floor.with_rms(noise.rms_counts);

        let whole = Bins::of_frames(frames)?;
        // What coarse steps do to a mean depends on how many of them the way crosses.
        let averaged = if rounds { Averaged::Rests } else { Averaged::RestsAndSlowWays(&noise) };
        let mut bins = Bins::of(frames, averaged)?;
        bins.weigh(frames, &noise, &heldout);
        let images = no_images(frames.elements);
        let base_of = |bins: &Bins| {
            recalibrated(&Problem::new(Predictor::with_images(known, frames, bins, &images), &noise), &faulty)
        };
        let mut base = base_of(&bins)?;
        let residual =
            residual_of_frames(&Predictor::with_images(known, frames, &whole, &images), &base, &faulty)?;
        let columns = known.array.cols();
        let lines = spectrum::lines(frames, columns, &residual);
        let averaged_out = bins.averaged_out(residual);
        let has_tone = !spectrum::lines(frames, columns, &averaged_out).is_empty()
            || !spectrum::lines_in_contact(frames, columns, &averaged_out).is_empty();
        if has_tone {
            // Averaging over several frames would remove it.
            bins = Bins::of(frames, Averaged::None)?;
            bins.weigh(frames, &noise, &heldout);
            base = base_of(&bins)?;
        }
        Ok(Self {
            known,
            frames,
            heldout,
            still,
            faulty,
            noise,
            noise_of_silent,
            floor,
            replicates,
            step_counts,
            converter,
            whole,
            bins,
            base,
            lines,
            warnings,
            images,
        })
    }

    /// True if the steps of the converter are wider than declared.
    pub(crate) fn rounds(&self) -> bool {
        self.converter.as_ref().is_some_and(Converter::rounds)
    }

    /// Readings without what a converter that is not as declared does to the base model's counts, which repeats wherever signals do: frame by
    /// frame, element by element.
    pub(crate) fn without(&self, rounding: &Rounding, readings: &[f32]) -> Result<Vec<f32>, DiscoverError> {
        let expected = self.predictor(&self.whole).predict(&self.base.parameters)?;
        let of_steps = self.step_counts.powi(2) / 12.0;
        let of_element = |rms: &f64| (rms.powi(2) - of_steps).max(0.0).sqrt();
        let noise_counts: Vec<f64> = self.noise.by_element_counts.iter().map(of_element).collect();
        let without = |((reading, expected), noise_counts): ((&f32, &f64), &f64)| {
            // Elements without weight have any noise.
            if !noise_counts.is_finite() {
                return *reading;
            }
            #[expect(clippy::cast_possible_truncation, reason = "counts are stored in single precision")]
            let without = rounding.without(f64::from(*reading), *expected, *noise_counts) as f32;
            without
        };
        Ok(readings.iter().zip(&expected).zip(noise_counts.iter().cycle()).map(without).collect())
    }

    /// Predictions for some bins.
    pub(crate) fn predictor<'b>(&'b self, bins: &'b Bins) -> Predictor<'b> {
        Predictor::with_images(self.known, self.frames, bins, &self.images)
    }

    /// The least-squares problem of the bins.
    pub(crate) fn problem(&self) -> Problem<'_> {
        Problem::new(self.predictor(&self.bins), &self.noise)
    }

    /// The same, with dead and stuck elements weighted as the others.
    pub(crate) fn problem_with_silent(&self) -> Problem<'_> {
        Problem::new(self.predictor(&self.bins), &self.noise_of_silent)
    }
}

/// The base model with the effects of faulty elements, fitted to the bins.
fn recalibrated(problem: &Problem<'_>, faulty: &Faulty) -> Result<Fitted, DiscoverError> {
    let Predictor { known, bins, .. } = problem.predictor;
    let mut start = Parameters::declared(known, bins.paths.len());
    start.terms.extend(faulty.effects.iter().map(Term::of));
    problem.fit_from(start, BASE_ROUNDS)
}

/// A model's residual, frame by frame, element by element; 0 for faulty elements.
fn residual_of_frames(
    whole: &Predictor<'_>,
    base: &Fitted,
    faulty: &Faulty,
) -> Result<Vec<f64>, DiscoverError> {
    let predicted = whole.predict(&base.parameters)?;
    let mut residual: Vec<f64> =
        whole.frames.counts.iter().zip(&predicted).map(|(counts, of)| f64::from(*counts) - of).collect();
    for element in (0..whole.frames.elements).filter(|element| faulty.is_weightless(*element)) {
        residual.iter_mut().skip(element).step_by(whole.frames.elements).for_each(|residual| *residual = 0.0);
    }
    Ok(residual)
}
