//! A whole sensor under a tool, as a value.

use crate::effect::{Effect, EffectError};
use crate::{Covering, ForwardModel, Indenter, Moment, Pipeline, Registration, Trajectory};

/// A sensor with its registration, covering, tool and effects.
///
/// It is a plain value: every clone is another sensor, and every run begins without history.
///
/// ```
/// # use tactus_model::{Array, Covering, ForwardModel, Indenter, Psf, Registration, Response};
/// use tactus_model::{Effect, Simulator, Trajectory};
/// # let covering = Covering { thickness_mm: 1.016 };
/// # let indenter = Indenter::Cylinder { diameter_mm: 1.0 };
/// # let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, Response::uniform(48, 1000.0, 100.0))?;
///
/// let creeping = Simulator {
///     model,
///     registration: Registration { origin_mm: [0.0, 0.0], rotation_deg: 0.0 },
///     surface_mm: 0.0,
///     covering,
///     indenter,
///     effects: vec![Effect::new("relaxation", [("relaxed_share", 0.2), ("time_constant_s", 5.0), ("spread_ratio", 1.0), ("after_release", 0.0), ("recovery_ratio", 1.0)])?],
///     noise_rms_counts: 0.0,
/// };
/// // Down to 0.5 mm upon element 17 within half a second, and held there.
/// let hold = Trajectory::new([(0.0, [2.9, 4.9, 0.0]), (0.5, [2.9, 4.9, -0.5]), (60.0, [2.9, 4.9, -0.5])])?;
/// let images: Vec<_> = creeping.run(&hold, 30.0, 1800, || 0.0)?.collect();
/// assert_eq!(images[15].counts[17], 595.0);
/// assert_eq!(images[1799].counts[17], 500.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Simulator {
    /// The base model of the array.
    pub model: ForwardModel,
    /// Where the sensor lies in the robot's frame.
    pub registration: Registration,
    /// Height of the covering's surface, robot frame.
    pub surface_mm: f64,
    /// The covering in place.
    pub covering: Covering,
    /// The tool on the stage.
    pub indenter: Indenter,
    /// Departures from the base model. Effects of one stage act in this order.
    pub effects: Vec<Effect>,
    /// Standard deviation of an element's noise, in counts.
    pub noise_rms_counts: f64,
}

/// One reading of all elements, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Time on the trajectory's time axis.
    pub t_s: f64,
    /// Counts before noise and converter.
    pub clean_counts: Vec<f64>,
    /// Counts after noise and converter.
    pub counts: Vec<f64>,
}

/// The images of a run, in order.
#[derive(Debug)]
struct ImageSequence<'a, D> {
    pipeline: Pipeline,
    trajectory: &'a Trajectory,
    rate_hz: f64,
    noise_rms_counts: f64,
    draw: D,
}

impl Simulator {
    /// Images at `rate_hz`, the first at the trajectory's start; `frames` of them, also beyond its end.
    ///
    /// `draw` returns standard normal deviates, one for each element of each image: the caller's generator, or `|| 0.0`
    /// for a sensor without noise.
    ///
    /// # Errors
    /// As [`Pipeline::new`].
    pub fn run<'a>(
        &self,
        trajectory: &'a Trajectory,
        rate_hz: f64,
        frames: u32,
        draw: impl FnMut() -> f64 + 'a,
    ) -> Result<impl Iterator<Item = Image> + 'a, EffectError> {
        let noise_rms_counts = self.noise_rms_counts;
        let mut images =
            ImageSequence { pipeline: Pipeline::new(self)?, trajectory, rate_hz, noise_rms_counts, draw };
        Ok((0..frames).map(move |frame| images.image(frame)))
    }
}

impl<D: FnMut() -> f64> ImageSequence<'_, D> {
    fn image(&mut self, frame: u32) -> Image {
        // Computed from the start, so that rounding errors do not accumulate.
        let t_s = self.trajectory.start_s() + f64::from(frame) / self.rate_hz;
        let clean_counts = self.pipeline.step(Moment::at(t_s), self.trajectory).to_vec();
        let read = |clean: &f64| self.pipeline.read(*clean, self.noise_rms_counts * (self.draw)());
        let counts = clean_counts.iter().map(read).collect();
        Image { t_s, clean_counts, counts }
    }
}

#[cfg(test)]
#[path = "simulator_tests.rs"]
mod tests;
