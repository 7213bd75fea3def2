//! Identity, settings and outcome of a run.

use tactus_model::Indenter;
use tactus_record::Timeline;
use tactus_schema::{WallTime, pb};

use super::presses::Presses;

/// Identity, settings and outcome of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSummary {
    /// Id of the run.
    pub run_id: String,
    /// Name of the experiment.
    pub experiment: String,
    /// Name of the rig.
    pub rig: String,
    /// Who started it.
    pub who: String,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// Start time, RFC 3339, UTC.
    pub started: String,
    /// Time from the first message to the last.
    pub duration_s: f64,
    /// Duration of the dry run, if known.
    pub duration_planned_s: Option<f64>,
    /// Exit status, such as `done`; `None` if the recording has none.
    pub exit_status: Option<&'static str>,
    /// The run's final message.
    pub message: String,
    /// Thickness of the covering at the start.
    pub covering_mm: f64,
    /// Id and shape of the indenter.
    pub indenter: String,
    /// Name of the script.
    pub script: String,
    /// Hash of the script.
    pub script_sha256: Option<String>,
    /// Seed of the script's random numbers.
    pub seed: Option<u64>,
    /// The script's parameters and their values.
    pub parameters: Vec<(String, String)>,
    /// Names and versions of the software and devices.
    pub versions: Vec<(String, String)>,
    /// Frames recorded.
    pub frames: u64,
    /// Frames that the sensor took but that never arrived.
    pub frames_lost: u64,
    /// Number of gaps in the sequence of frames.
    pub gaps: u64,
    /// Completed presses with at least one dwell.
    pub presses: u32,
    /// Dwells of these presses.
    pub dwells: u32,
    /// Presses and dwells of the dry run.
    pub planned: Option<[u32; 2]>,
}

impl RunSummary {
    pub(super) fn of(timeline: &Timeline, presses: &Presses) -> Self {
        let (run, rig, tally, started) =
            (timeline.run(), timeline.rig(), timeline.tally(), timeline.started());
        let indenter = timeline.indenter();
        let shape = rig.indenters.get(indenter).map(|shape| format!(", {}", describe(shape)));
        let parameters = match started {
            Some(started) => pairs(started.parameters_json.as_bytes()),
            None => pairs(timeline.attachment("parameters.json").unwrap_or_default()),
        };
        let dwells: usize = presses.done.iter().map(|press| press.dwells.len()).sum();
        Self {
            run_id: run.run_id.clone(),
            experiment: run.experiment.clone(),
            rig: run.rig.clone(),
            who: run.who.clone(),
            simulated: run.simulated,
            started: rfc3339(run.started),
            duration_s: tally.duration().as_secs_f64(),
            duration_planned_s: started.map(|s| s.duration_planned_s).filter(|seconds| *seconds > 0.0),
            exit_status: tally.exit_status().map(pb::ExitStatus::word),
            message: tally.finished().map(|finished| finished.message.clone()).unwrap_or_default(),
            covering_mm: started.map_or(rig.covering.thickness_mm, |started| started.covering_mm),
            indenter: format!("{indenter}{}", shape.unwrap_or_default()),
            script: run.script.clone(),
            script_sha256: started.map(|s| s.script_sha256.clone()).filter(|hash| !hash.is_empty()),
            seed: started.map(|started| started.seed),
            parameters,
            versions: pairs(timeline.attachment("versions.json").unwrap_or_default()),
            frames: tally.frames(),
            frames_lost: tally.frames_lost(),
            gaps: tally.gaps(),
            presses: u32::try_from(presses.done.len()).unwrap_or(u32::MAX),
            dwells: u32::try_from(dwells).unwrap_or(u32::MAX),
            planned: started
                .map(|started| [started.presses_planned, started.dwells_planned])
                .filter(|[presses, _]| *presses > 0),
        }
    }
}

fn describe(indenter: &Indenter) -> String {
    match indenter {
        Indenter::Cylinder { diameter_mm } => format!("cylinder of {diameter_mm} mm"),
        Indenter::Sphere { diameter_mm } => format!("sphere of {diameter_mm} mm"),
        Indenter::Cone { diameter_mm, apex_deg } => {
            format!("cone of {apex_deg} degrees and {diameter_mm} mm")
        }
        Indenter::Mesh(mesh) => format!("mesh of {} triangles", mesh.triangles().len()),
        Indenter::Box { size_mm: [x_mm, y_mm] } => format!("box of {x_mm} x {y_mm} mm"),
    }
}

/// The members of a JSON object as text; empty for anything else.
fn pairs(json: &[u8]) -> Vec<(String, String)> {
    let members: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(json).unwrap_or_default();
    let text = |value: serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    members.into_iter().map(|(name, value)| (name, text(value))).collect()
}

/// UTC, to the second.
fn rfc3339(at: WallTime) -> String {
    jiff::Timestamp::from_second(at.ns().div_euclid(1_000_000_000))
        .map_or_else(|_| format!("{} ns", at.ns()), |time| time.to_string())
}
