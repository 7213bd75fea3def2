//! What makes an earlier run again.

use std::path::Path;

use tactus_record::Timeline;

use crate::RunsError;

/// The script, the parameters and the seed of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Again {
    /// Name of the experiment.
    pub experiment: String,
    /// File name of the script.
    pub script: String,
    /// Its text.
    pub source: String,
    /// The parameters as the script saw them, as a JSON object.
    pub parameters_json: String,
    /// Seed of its random numbers.
    pub seed: u64,
    /// True if it was simulated with a hidden truth, which the recording does not have.
    pub had_truth: bool,
}

/// Reads from a recording what makes its run again.
///
/// # Errors
/// If it cannot be read, or lacks the script or the start.
pub fn again(recording: &Path) -> Result<Again, RunsError> {
    let timeline = Timeline::read(recording)?;
    let lacks = |what| RunsError::Lacks { path: recording.to_owned(), what };
    let run = timeline.run();
    let source = timeline.attachment(&run.script).ok_or_else(|| lacks("script"))?;
    let source = std::str::from_utf8(source).map_err(|_| lacks("script as text"))?;
    let started = timeline.started().ok_or_else(|| lacks("start, with parameters and seed"))?;
    Ok(Again {
        experiment: run.experiment.clone(),
        script: run.script.clone(),
        source: source.to_owned(),
        parameters_json: started.parameters_json.clone(),
        seed: started.seed,
        had_truth: run.simulated && timeline.attachment("rig.toml").is_none(),
    })
}
