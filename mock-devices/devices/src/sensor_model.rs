//! The simulated sensor: from the tip's path to the counts of the elements.

use std::fmt::Debug;

use tactus_model::{Covering, Moment, Pipeline, Trail};

use tactus_hidden::HiddenSensor;

/// A simulated sensor in time: the effects pipeline, or a sensor with hidden physics.
pub(crate) trait SensorModel: Debug + Send {
    /// Advances to a moment. Returns the counts of every element then, row-major, before noise and converter.
    fn step(&mut self, moment: Moment, trail: &Trail) -> &[f64];

    /// Counts at the last moment.
    fn counts(&self) -> &[f64];

    /// The converter's output for clean counts plus noise.
    fn read(&self, counts: f64, noise_counts: f64) -> f64;

    /// Puts another covering in place.
    fn set_covering(&mut self, covering: Covering);

    /// Moves the covering's surface to this height, robot frame.
    fn set_surface_mm(&mut self, surface_mm: f64);

    /// Multiplies every indentation by `stiffness`.
    fn set_stiffness(&mut self, stiffness: f64);
}

impl SensorModel for Pipeline {
    fn step(&mut self, moment: Moment, trail: &Trail) -> &[f64] {
        self.step(moment, trail)
    }

    fn counts(&self) -> &[f64] {
        self.counts()
    }

    fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        self.read(counts, noise_counts)
    }

    fn set_covering(&mut self, covering: Covering) {
        self.set_covering(covering);
    }

    fn set_surface_mm(&mut self, surface_mm: f64) {
        self.set_surface_mm(surface_mm);
    }

    fn set_stiffness(&mut self, stiffness: f64) {
        self.set_stiffness(stiffness);
    }
}

impl SensorModel for HiddenSensor {
    fn step(&mut self, moment: Moment, trail: &Trail) -> &[f64] {
        self.step(moment.t_s, trail)
    }

    fn counts(&self) -> &[f64] {
        self.counts()
    }

    fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        self.read(counts, noise_counts)
    }

    fn set_covering(&mut self, covering: Covering) {
        self.set_covering(covering);
    }

    fn set_surface_mm(&mut self, surface_mm: f64) {
        self.set_surface_mm(surface_mm);
    }

    fn set_stiffness(&mut self, stiffness: f64) {
        self.set_stiffness(stiffness);
    }
}
