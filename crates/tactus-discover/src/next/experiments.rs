//! Experiments as discovery sees them: names, and the motion that each would make.

use tactus_calibrate::FaultyElement;

use crate::data::Frames;

/// The experiments of a rig. Each can be rehearsed: carried out without the rig, by the procedure that would run it.
pub trait Experiments: Sync {
    /// Thickness of the covering in place.
    fn covering_mm(&self) -> f64;

    /// The lab's own experiments, by the names that `tactus run` takes. They are proposed with the defaults of their parameters.
    fn own(&self) -> &[String];

    /// The frames that a run would record, and how long it would take.
    ///
    /// # Errors
    /// Why the rig cannot do it, or why its script failed: one sentence.
    fn rehearse(&self, order: RehearsalOrder<'_>) -> Result<Rehearsal, String>;
}

/// An experiment to rehearse.
#[derive(Debug, Clone, Copy)]
pub struct RehearsalOrder<'a> {
    /// The name that `tactus run` takes.
    pub experiment: &'a str,
    /// The parameters that differ from their defaults.
    pub parameters: &'a [(&'static str, String)],
    /// Seed of the script's random order.
    pub seed: u64,
    /// Elements that calibration finds faulty: a script may avoid them.
    pub faulty: &'a [FaultyElement],
}

/// A rehearsed experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Rehearsal {
    /// When and where the tip would be. The counts mean nothing.
    pub frames: Frames,
    /// From the first step until the tip is retracted.
    pub duration_s: f64,
}
