//! What to measure next, and what cannot be measured.

/// An experiment that would distinguish two explanations.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Name of the experiment for `tactus run`.
    pub experiment: String,
    /// Its parameters and their values for `tactus run --param`.
    pub parameters: Vec<(&'static str, String)>,
    /// The seed of the rehearsal: a run with it has the same random order.
    pub seed: u64,
    /// Duration of the rehearsal.
    pub duration_s: f64,
    /// The two explanations.
    pub separates: [String; 2],
    /// By how many standard errors their predictions would differ; `None` if that cannot be predicted.
    pub expected_z: Option<f64>,
}

/// Two explanations that no experiment would distinguish; the second is `nothing` for an effect that none would show.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenQuestion {
    /// The two explanations.
    pub separates: [String; 2],
    /// The experiment with the greatest difference, which is less than [`WORTH_Z`]; `None` if none could be rehearsed.
    pub best: Option<NextExperiment>,
}

/// An experiment that is not proposed, whatever it would distinguish.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Name of the experiment for `tactus run`.
    pub experiment: String,
    /// Its parameters and their values for `tactus run --param`.
    pub parameters: Vec<(&'static str, String)>,
    /// Why the rig cannot do it, or why its script failed; or in what it goes beyond the data.
    pub reason: String,
}

/// What to measure next.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Experiments that would decide what these data leave open.
    pub next: Vec<NextExperiment>,
    /// What no experiment would decide.
    pub open: Vec<OpenQuestion>,
    /// Experiments that were rehearsed, or would have been, and are not proposed.
    pub left_out: Vec<LeftOut>,
}

/// Least `z` of a proposal.
pub const WORTH_Z: f64 = 2.0;
