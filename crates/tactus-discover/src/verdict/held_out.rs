//! A model's residual: how large it is on the held-out presses, and how much of that is structured.

use std::ops::Range;

use super::closed::{Closed, closed};
use super::discovery::{ElementGap, Level};
use super::structured::{Readings, Structured};
use crate::data::{DiscoverError, Floor, Noise, QUIETEST, turns};
use crate::fit::{Fitted, LOUD, Parameters, Prepared};

/// Upper bound of what is structured, in noise units, for the verdicts `NothingMissing` and `Explained` beside the tests.
pub(super) const SEEN_NOISE: f64 = 2.0;

/// The residual of a model on the held-out frames.
pub(super) struct HeldOutResidual {
    /// Root mean square.
    pub(super) rms_counts: f64,
    /// Root mean square for each element.
    pub(super) elements_rms_counts: Vec<f64>,
    /// For all frames, fitted and held out: frame by frame, element by element.
    pub(super) residual: Vec<f32>,
    /// As predicted, in counts, for the same.
    pub(super) signal: Vec<f32>,
}

/// Share of a residual beyond noise that is closed, in mean squares: from one root mean square to another. `None` where there is nothing
/// beyond noise; by chance what remains may be smaller than the noise.
pub(super) fn closed_share([before, after]: [f64; 2], noise: f64) -> Option<f64> {
    let gap = before * before - noise * noise;
    (gap > 0.0).then(|| ((before * before - after * after) / gap).min(1.0))
}

impl HeldOutResidual {
    /// The residual of each element, and that of a grown model.
    pub(super) fn elements_beside(&self, grown: &Self) -> Vec<ElementGap> {
        let elements = self.elements_rms_counts.iter().zip(&grown.elements_rms_counts);
        elements
            .map(|(before, after)| ElementGap { before_rms_counts: *before, after_rms_counts: *after })
            .collect()
    }
}

impl Prepared<'_> {
    /// The residual of a model on the held-out frames.
    pub(super) fn held(&self, parameters: &Parameters) -> Result<HeldOutResidual, DiscoverError> {
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
        Ok(HeldOutResidual {
            rms_counts: mean.sqrt(),
            elements_rms_counts: (0..elements)
                .map(|element| if weightless(element) { f64::NAN } else { (squares[element] / count).sqrt() })
                .collect(),
            residual,
            signal: signal.into_iter().map(single).collect(),
        })
    }

    /// The floor given the grown model. Before a tone is in the model, it looks like noise.
    pub(super) fn floor_of(&self, grown: &HeldOutResidual) -> Floor {
        let left = Noise::in_time(self.frames, &grown.residual, &self.still, self.step_counts);
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
    pub(super) fn level(&self, held: &HeldOutResidual, floor: Floor) -> Level {
        let in_noise = |noise_counts: f64| (held.rms_counts / noise_counts).powi(2);
        Level {
            heldout_rms_counts: held.rms_counts,
            heldout_chi2: floor.rms_counts().map(in_noise),
            structured: self.structured(held, floor),
        }
    }

    /// The structured part of a residual on held-out presses: among all readings or among those with a signal.
    fn structured(&self, held: &HeldOutResidual, floor: Floor) -> Option<Structured> {
        let (elements, turns) = (self.frames.elements, self.turns());
        let is_known = |place: usize| !turns[place / elements];
        let noise_counts = &self.noise.by_element_counts;
        let has_signal =
            |place: usize| f64::from(held.signal[place].abs()) > LOUD * noise_counts[place % elements];
        let parts = [
            self.structured_among(held, floor, is_known),
            self.structured_among(held, floor, |place| is_known(place) && has_signal(place))
                .map(|part| Structured { with_signal: true, ..part }),
        ];
        parts.into_iter().flatten().max_by(|one, other| one.upper_noise.total_cmp(&other.upper_noise))
    }

    /// A warning if much is structured in the frames that are not judged.
    pub(super) fn not_judged(&self, held: &HeldOutResidual, floor: Floor) -> Option<String> {
        let (elements, turns) = (self.frames.elements, self.turns());
        let part = self.structured_among(held, floor, |place| turns[place / elements])?;
        (part.rms_noise > SEEN_NOISE).then(|| {
            format!(
                "frames at which the stage starts or stops near the surface are not judged, because its position between two reports \
                 is not known: what is structured in them is {:.1} times the noise",
                part.rms_noise
            )
        })
    }

    /// Whether the stage starts or stops near the surface, for each frame.
    fn turns(&self) -> Vec<bool> {
        (0..self.frames.len()).map(|frame| turns(self.frames, frame)).collect()
    }

    /// How much of what a model leaves on held-out presses another model, the fitted one, closes.
    pub(super) fn closed(
        &self,
        [before, after]: [&HeldOutResidual; 2],
        fitted: &Fitted,
        floor: Floor,
    ) -> Result<Option<Closed>, DiscoverError> {
        let (elements, turns) = (self.frames.elements, self.turns());
        let of_estimates = self.problem().estimation_error(fitted)?.unwrap_or(0.0);
        let of_before = |before: &Readings<'_>| {
            let of_both = |after: &Readings<'_>| {
                closed([before, after], of_estimates, |place| !turns[place / elements])
            };
            self.on_readings(after, floor, of_both)?
        };
        Ok(self.on_readings(before, floor, of_before).flatten())
    }

    fn structured_among(
        &self,
        held: &HeldOutResidual,
        floor: Floor,
        among: impl Fn(usize) -> bool,
    ) -> Option<Structured> {
        self.on_readings(held, floor, |readings| readings.structured(among))?
    }

    /// Something of a residual's readings on held-out presses; `None` without a floor.
    fn on_readings<T>(
        &self,
        held: &HeldOutResidual,
        floor: Floor,
        something: impl FnOnce(&Readings<'_>) -> T,
    ) -> Option<T> {
        let rms_counts = floor.rms_counts()?;
        let scale = rms_counts / self.noise.rms_counts;
        let noise_counts: Vec<f64> = self.noise.by_element_counts.iter().map(|rms| rms * scale).collect();
        let lag = self.noise.memory_frames();
        Some(something(&Readings {
            elements: self.frames.elements,
            residual: &held.residual,
            signal: &held.signal,
            presses: &self.heldout_presses(),
            unit_counts: &noise_counts.iter().map(|rms| rms.max(QUIETEST * rms_counts)).collect::<Vec<_>>(),
            noise_counts: &noise_counts,
            lag,
            correlation: self.noise.correlation_at(lag),
            rounding_share: self.noise.rounding_share,
            freedom: floor.freedom()?,
        }))
    }

    /// Frames of each held-out press and of each held-out rest between presses.
    fn heldout_presses(&self) -> Vec<Range<usize>> {
        let (frames, held) = (self.frames, &self.heldout.frames);
        let key = |frame: usize| (held[frame], self.whole.run[frame], frames.press[frame]);
        let all: Vec<usize> = (0..frames.len()).collect();
        let presses = all.chunk_by(|one, next| key(*one) == key(*next));
        presses
            .filter_map(|press| Some(*press.first()?..press.last()? + 1))
            .filter(|press| held[press.start])
            .collect()
    }
}
