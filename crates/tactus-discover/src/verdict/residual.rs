//! A model's residual: how large it is on presses, and how much of that is structured.
//!
//! What is decided is decided by the fitted presses, and the held-out ones are opened for the figures. Where a decision needs presses that a fit
//! has not seen, each fold of the fitted presses is predicted by a fit to the others ([`Prepared::by_folds`]).

use std::ops::Range;

use super::closed::{Closed, closed};
use super::discovery::{ElementGap, Level};
use super::structured::{Readings, Structured};
use crate::data::{DiscoverError, Floor, Noise, QUIETEST, turns};
use crate::fit::{ByFolds, Fitted, LOUD, Parameters, Prepared};

/// Upper bound of what is structured, in noise units, for the verdicts `NothingMissing` and `Explained` beside the tests.
pub(super) const SEEN_NOISE: f64 = 2.0;

/// Presses of which a residual is examined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Presses {
    Fitted,
    HeldOut,
}

/// The residual of a model.
pub(super) struct Residual {
    /// Root mean square on the held-out frames.
    pub(super) heldout_rms_counts: f64,
    /// The same for each element.
    pub(super) elements_rms_counts: Vec<f64>,
    /// For all frames, fitted and held out: frame by frame, element by element.
    pub(super) counts: Vec<f32>,
    /// As predicted, in counts, for the same.
    pub(super) signal: Vec<f32>,
}

/// Share of a residual beyond noise that is closed, in mean squares: from one root mean square to another. `None` where there is nothing
/// beyond noise; by chance what remains may be smaller than the noise.
pub(super) fn closed_share([before, after]: [f64; 2], noise: f64) -> Option<f64> {
    let gap = before * before - noise * noise;
    (gap > 0.0).then(|| ((before * before - after * after) / gap).min(1.0))
}

impl Residual {
    /// The residual of each element, and that of a grown model.
    pub(super) fn elements_beside(&self, grown: &Self) -> Vec<ElementGap> {
        let elements = self.elements_rms_counts.iter().zip(&grown.elements_rms_counts);
        elements
            .map(|(before, after)| ElementGap { before_rms_counts: *before, after_rms_counts: *after })
            .collect()
    }
}

impl Prepared<'_> {
    /// The residual of a model.
    pub(super) fn residual(&self, parameters: &Parameters) -> Result<Residual, DiscoverError> {
        let Self { frames, heldout, whole, .. } = self;
        let predicted = self.predictor(whole).predict(parameters)?;
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
        let single = |counts: f64| counts as f32;
        let residual =
            frames.counts.iter().zip(&predicted).map(|(counts, of)| counts - single(*of)).collect();
        let mut signal = predicted;
        if let Some(walk) = &parameters.walk {
            walk.add(whole, -1.0, &mut signal);
        }
        let baselines = whole.run.iter().flat_map(|run| &parameters.baseline[*run]);
        signal.iter_mut().zip(baselines).for_each(|(of, zero)| *of -= zero);
        Ok(Residual {
            heldout_rms_counts: mean.sqrt(),
            elements_rms_counts: (0..elements)
                .map(|element| if weightless(element) { f64::NAN } else { (squares[element] / count).sqrt() })
                .collect(),
            counts: residual,
            signal: signal.into_iter().map(single).collect(),
        })
    }

    /// The residual of a fitted model whose fitted presses are predicted by fits to other presses, and the mean square that the errors of their
    /// numbers leave there. `None` if the model has a random walk, which has a state of its own in every press.
    pub(super) fn by_folds(&self, fitted: &Fitted) -> Result<Option<(Residual, f64)>, DiscoverError> {
        let Some(ByFolds { moved, estimation_error }) = self.problem().by_folds(fitted)? else {
            return Ok(None);
        };
        let mut residual = self.residual(&fitted.parameters)?;
        let elements = self.frames.elements;
        for (frames, moved) in self.bins.first.windows(2).zip(moved.chunks_exact(elements)) {
            let readings = &mut residual.counts[frames[0] * elements..frames[1] * elements];
            for (left, moved) in readings.iter_mut().zip(moved.iter().cycle()) {
                #[expect(clippy::cast_possible_truncation, reason = "as precise as counts are")]
                let single = *moved as f32;
                *left -= single;
            }
        }
        Ok(Some((residual, estimation_error)))
    }

    /// The floor given the grown model. Before a tone is in the model, it looks like noise.
    pub(super) fn floor_of(&self, grown: &Residual) -> Floor {
        let left = Noise::in_time(self.frames, &grown.counts, &self.still, self.step_counts);
        let is_weightless = |element| self.faulty.is_weightless(element);
        let left = left.map(|(left, freedom)| (left.without(is_weightless), freedom));
        match (self.floor, left) {
            (Floor::Time { rms_counts, .. }, Some((left, freedom))) if left.rms_counts < rms_counts => {
                Floor::Time { rms_counts: left.rms_counts, freedom }
            }
            (floor, _) => floor,
        }
    }

    /// How far a model is from the held-out frames.
    pub(super) fn level(&self, of: &Residual, floor: Floor) -> Level {
        let in_noise = |noise_counts: f64| (of.heldout_rms_counts / noise_counts).powi(2);
        Level {
            heldout_rms_counts: of.heldout_rms_counts,
            heldout_chi2: floor.rms_counts().map(in_noise),
            structured: self.structured(of, Presses::HeldOut, floor),
        }
    }

    /// The structured part of a residual on presses: among all readings or among those with a signal.
    pub(super) fn structured(&self, of: &Residual, presses: Presses, floor: Floor) -> Option<Structured> {
        let (elements, turns) = (self.frames.elements, turns(self.frames));
        let is_known = |place: usize| !turns[place / elements];
        let noise_counts = &self.noise.by_element_counts;
        let has_signal =
            |place: usize| f64::from(of.signal[place].abs()) > LOUD * noise_counts[place % elements];
        let parts = [
            self.structured_among(of, presses, floor, is_known),
            self.structured_among(of, presses, floor, |place| is_known(place) && has_signal(place))
                .map(|part| Structured { with_signal: true, ..part }),
        ];
        parts.into_iter().flatten().max_by(|one, other| one.upper_noise.total_cmp(&other.upper_noise))
    }

    /// A warning if much is structured in the frames that are not judged.
    pub(super) fn not_judged(&self, of: &Residual, floor: Floor) -> Option<String> {
        let (elements, turns) = (self.frames.elements, turns(self.frames));
        let part = self.structured_among(of, Presses::HeldOut, floor, |place| turns[place / elements])?;
        (part.rms_noise > SEEN_NOISE).then(|| {
            format!(
                "frames at which the stage starts or stops near the surface are not judged, because its position between two reports \
                 is not known: what is structured in them is {:.1} times the noise",
                part.rms_noise
            )
        })
    }

    /// How much of what a model leaves on held-out presses another model, the fitted one, closes.
    pub(super) fn closed(
        &self,
        both: [&Residual; 2],
        fitted: &Fitted,
        floor: Floor,
    ) -> Result<Option<Closed>, DiscoverError> {
        let of_estimates = self.problem().estimation_error(fitted)?.unwrap_or(0.0);
        Ok(self.closed_on(both, Presses::HeldOut, of_estimates, floor))
    }

    /// The same on presses; `of_estimates` is what the errors of the second model's numbers leave there.
    pub(super) fn closed_on(
        &self,
        [before, after]: [&Residual; 2],
        presses: Presses,
        of_estimates: f64,
        floor: Floor,
    ) -> Option<Closed> {
        let (elements, turns) = (self.frames.elements, turns(self.frames));
        let of_before = |before: &Readings<'_>| {
            let of_both = |after: &Readings<'_>| {
                closed([before, after], of_estimates, |place| !turns[place / elements])
            };
            self.on_readings(after, presses, floor, of_both)?
        };
        self.on_readings(before, presses, floor, of_before).flatten()
    }

    fn structured_among(
        &self,
        of: &Residual,
        presses: Presses,
        floor: Floor,
        among: impl Fn(usize) -> bool,
    ) -> Option<Structured> {
        self.on_readings(of, presses, floor, |readings| readings.structured(among))?
    }

    /// Something of a residual's readings on presses; `None` without a floor.
    fn on_readings<T>(
        &self,
        of: &Residual,
        presses: Presses,
        floor: Floor,
        something: impl FnOnce(&Readings<'_>) -> T,
    ) -> Option<T> {
        let rms_counts = floor.rms_counts()?;
        let scale = rms_counts / self.noise.rms_counts;
        let noise_counts: Vec<f64> = self.noise.by_element_counts.iter().map(|rms| rms * scale).collect();
        let lag = self.noise.memory_frames();
        Some(something(&Readings {
            elements: self.frames.elements,
            residual: &of.counts,
            signal: &of.signal,
            presses: &self.frames_of(presses),
            unit_counts: &noise_counts.iter().map(|rms| rms.max(QUIETEST * rms_counts)).collect::<Vec<_>>(),
            noise_counts: &noise_counts,
            lag,
            correlation: self.noise.correlation_at(lag),
            rounding_share: self.noise.rounding_share,
            freedom: floor.freedom()?,
        }))
    }

    /// Frames of each press, and of each rest between presses.
    fn frames_of(&self, which: Presses) -> Vec<Range<usize>> {
        let (frames, held) = (self.frames, &self.heldout.frames);
        let is_among = |press: &Range<usize>| held[press.start] == (which == Presses::HeldOut);
        let key = |frame: usize| (held[frame], self.whole.run[frame], frames.press[frame]);
        let all: Vec<usize> = (0..frames.len()).collect();
        let presses = all.chunk_by(|one, next| key(*one) == key(*next));
        presses.filter_map(|press| Some(*press.first()?..press.last()? + 1)).filter(is_among).collect()
    }
}
