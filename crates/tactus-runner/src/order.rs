//! From a request to a checked order for the engine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use jiff::Timestamp;
use tactus_engine::{EarlierRun, RunOrder};
use tactus_plan::{Arguments, Evaluate, RigView, Script, ScriptError, ScriptLimits};
use tactus_record::{Header, RecordError, Recording, space, sync_folder_of};
use tactus_schema::{Rig, WallTime};

/// A request for a run.
#[derive(Debug, Clone)]
pub struct RunRequest {
    /// The experiment script.
    pub script: Script,
    /// The parameters that differ from their defaults.
    pub arguments: Arguments,
    /// Seed of the script's random numbers; derived from the time if `None`.
    pub seed: Option<u64>,
    /// The person or program that requests the run.
    pub who: String,
    /// Where the script is evaluated.
    pub evaluator: Arc<dyn Evaluate>,
    /// The earlier run that it goes on with ([`crate::continuation`]).
    pub earlier: Option<Arc<EarlierRun>>,
}

/// Texts of the rig's files for a recording.
#[derive(Debug, Clone, Copy)]
pub struct Texts<'a> {
    /// The rig file; `None` if its `[simulation]` does not hold for the run.
    pub rig_toml: Option<&'a str>,
    /// The description of the sensor's frames, if the rig file names one.
    pub link_toml: Option<&'a str>,
}

/// Makes the order, with a new run id, and checks the parameters. Blocks while the script's top level is evaluated; ends
/// early once `stopped` is true.
///
/// # Errors
/// [`ScriptError`] names the parameter or the script's line.
pub fn order(
    request: RunRequest,
    rig: &Rig,
    at: WallTime,
    stopped: &dyn Fn() -> bool,
) -> Result<RunOrder, ScriptError> {
    let RunRequest { script, arguments, seed, who, evaluator, earlier } = request;
    let limits = ScriptLimits::default();
    // The earlier run's covering at its start: defaults may depend on it.
    let mut rig = rig.clone();
    if let Some(earlier) = &earlier {
        rig.covering.thickness_mm = earlier.covering_mm;
    }
    let arguments = evaluator.resolve(&script, &arguments, &RigView::of(&rig), &limits, stopped)?;
    let seed = seed.unwrap_or_else(|| mix(at.ns().unsigned_abs()));
    let run_id =
        format!("{}-{}-{:04x}", timestamp(at), script.name(), mix(at.ns().unsigned_abs() ^ seed) & 0xffff);
    let versions = BTreeMap::from([
        ("tactus".into(), env!("CARGO_PKG_VERSION").into()),
        ("schema".into(), "tactus.v1".into()),
    ]);
    Ok(RunOrder {
        run_id,
        script,
        arguments,
        seed,
        who,
        limits,
        evaluator,
        earlier,
        planned: None,
        versions,
        recording: String::new(),
        resets: false,
    })
}

/// Opens the recording of an order: `recording.mcap` in a new folder of the run, below `folder`. It contains the texts of
/// the rig's files. The disk must have room for the planned duration, with a margin.
///
/// # Errors
/// [`RecordError`] names the path. Nothing is left behind then.
pub fn recording(
    order: &RunOrder,
    rig: &Rig,
    texts: Texts<'_>,
    folder: &Path,
    started: WallTime,
) -> Result<(Recording, PathBuf), RecordError> {
    let error = |action, path: &Path| {
        let path = path.to_owned();
        move |source| RecordError::Io { action, path, source }
    };
    std::fs::create_dir_all(folder).map_err(error("create", folder))?;
    space::check_free(folder, rig, order.planned.map(|planned| planned.duration_s))?;
    let folder = folder.join(&order.run_id);
    std::fs::create_dir(&folder).map_err(error("create", &folder))?;
    sync_folder_of(&folder).map_err(error("sync the folder of", &folder))?;
    let path = folder.join("recording.mcap");
    let created = Recording::create(
        &path,
        &Header {
            run_id: &order.run_id,
            experiment: order.script.name(),
            who: &order.who,
            rig,
            rig_toml: texts.rig_toml,
            link_toml: texts.link_toml,
            script: tactus_record::Script {
                name: &format!("{}.star", order.script.name()),
                source: order.script.source(),
            },
            versions: &order.versions,
            parameters_json: &order.arguments.to_json(),
            started,
            simulated: rig.simulated,
            continues: order.earlier.as_ref().map(|earlier| earlier.run_id.as_str()),
        },
    );
    if created.is_err() {
        // An error of the removal would hide the one that matters.
        drop(std::fs::remove_dir(&folder));
    }
    Ok((created?, path))
}

/// `20260131-142530`, UTC: how the ids of runs begin.
pub fn timestamp(at: WallTime) -> String {
    Timestamp::from_nanosecond(at.ns().into())
        .map_or_else(|_| "undated".into(), |time| time.strftime("%Y%m%d-%H%M%S").to_string())
}

/// Spreads the bits of a number (the finaliser of `SplitMix64`, Steele et al. 2014).
fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}
