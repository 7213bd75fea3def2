//! A lab's own files become measurement tables.
//!
//! A mapping file (`tactus.mapping/1`, TOML) says which column of a CSV, npz or MCAP file is what: times, positions, counts, and the
//! rig. [`import`] then writes the table that `tactus calibrate` and `tactus discover` read; [`propose()`] writes a mapping to start from.
//! Phases are found from the stage's path unless the file has them. Nothing is guessed that the file cannot show: the mapping is asked for it, by its
//! key. What follows from the readings, or is the paper's, is listed in [`Summary::assumed`].
//!
//! Everything here blocks.

mod columns;
mod error;
mod mapping;
mod phases;
mod propose;
mod rig;
mod runs;

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::Serialize;
use serde_json::json;
use tactus_record::meter;
use tactus_record::table::TableWriter;
use tactus_schema::table::{Phase, RowView};

use columns::Columns;
use mapping::Mapping;
use rig::{CompleteRig, Sketch};
use runs::Run;

pub use error::ImportError;
pub use mapping::SCHEMA;
pub use propose::propose;

/// Key of the table's metadata that says from what it was made.
const METADATA_KEY: &str = "tactus.import";

/// Name of that JSON's form.
const METADATA_SCHEMA: &str = "tactus.import/1";

/// Time to write a frame, in comparison with the time to read it.
const WRITING: f64 = 1.0;

/// The result of an import.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Path of the table.
    pub path: PathBuf,
    /// Number of rows: one per frame.
    pub rows: u64,
    /// The runs, with what was found in each.
    pub runs: Vec<RunSummary>,
    /// What the mapping did not say and the readings or the paper do, a sentence each.
    pub assumed: Vec<String>,
    /// What to look at, a sentence each.
    pub warnings: Vec<String>,
}

/// One imported run.
#[derive(Debug, Clone, Serialize)]
pub struct RunSummary {
    /// Its id.
    pub run: String,
    /// Number of frames.
    pub frames: usize,
    /// Number of presses.
    pub presses: usize,
    /// Number of depths that were held.
    pub holds: usize,
    /// Frames at which nothing touched.
    pub idle: usize,
    /// Depth of the deepest frame.
    pub depth_max_mm: f64,
}

/// Checks a mapping without the files that it is for; returns the rows and columns of its array.
///
/// # Errors
/// As [`import`], for what does not depend on a file.
pub fn check(map: &Path) -> Result<[usize; 2], ImportError> {
    let mapping = Mapping::read(map)?;
    let shape @ [rows, cols] = Sketch::read(map, &mapping.rig)?.shape(map)?;
    mapping.counts.columns.of_array(rows, cols).map_err(|wrong| wrong.in_file(map))?;
    Ok(shape)
}

/// Writes the measurement table of a lab's files, run after run. Without a column of runs, each file is one, with the file's name.
///
/// # Errors
/// [`ImportError`] names the file, and the key of the mapping or the place and the column.
pub fn import<P: AsRef<Path>>(
    map: &Path,
    files: &[P],
    out: impl Into<PathBuf>,
) -> Result<Summary, ImportError> {
    let mapping = Mapping::read(map)?;
    let sketch = Sketch::read(map, &mapping.rig)?;
    let shape @ [rows, cols] = sketch.shape(map)?;
    let elements = mapping.counts.columns.of_array(rows, cols).map_err(|wrong| wrong.in_file(map))?;
    let (mut imported, mut warnings): (Vec<Run>, Vec<String>) = (Vec::new(), Vec::new());
    for cost in [1.0, WRITING] {
        for path in files {
            meter::will_read(path, &[cost]);
        }
    }
    for path in files.iter().map(AsRef::as_ref) {
        let file = runs::of_file(&Columns::read(path, &mapping.form)?, &mapping, &elements)?;
        if file.left_out > 0 {
            warnings.push(format!(
                "{}: {} rows that lack a number are left out",
                path.display(),
                file.left_out
            ));
        }
        if let Some(run) = file.runs.iter().find(|run| imported.iter().any(|known| known.id == run.id)) {
            let problem = format!("run {:?} is in another file, too", run.id);
            return Err(ImportError::File { path: path.to_owned(), problem });
        }
        imported.extend(file.runs);
    }
    let summaries: Vec<RunSummary> = imported.iter().map(RunSummary::of).collect();
    let complete = sketch.complete(map, &mapping, shape, &imported)?;
    warnings.extend(summaries.iter().filter_map(|run| run.doubt(complete.rig.covering.thickness_mm)));
    let out = out.into();
    let rows = write(&out, map, files, &imported, &complete)?;
    Ok(Summary { path: out, rows, runs: summaries, assumed: complete.assumed, warnings })
}

fn write<P: AsRef<Path>>(
    out: &Path,
    map: &Path,
    files: &[P],
    runs: &[Run],
    CompleteRig { rig, json, assumed }: &CompleteRig,
) -> Result<u64, ImportError> {
    let mapping = fs::read_to_string(map).map_err(|source| ImportError::Io {
        action: "read",
        path: map.to_owned(),
        source,
    })?;
    let bytes: u64 = files.iter().filter_map(|file| Some(fs::metadata(file).ok()?.len())).sum();
    let frames: u64 = runs.iter().map(|run| run.t_ns.len() as u64).sum();
    let files: Vec<_> = files.iter().filter_map(|file| file.as_ref().file_name()?.to_str()).collect();
    let mut table = TableWriter::create(out, json)?;
    let made_of =
        json!({ "schema": METADATA_SCHEMA, "files": files, "mapping": mapping, "assumed": assumed });
    table.metadata(METADATA_KEY, made_of.to_string());
    let elements = rig.array.elements();
    for run in runs {
        for (frame, counts) in run.counts.chunks_exact(elements).enumerate() {
            let (phase, press) = run.phases[frame];
            let pushed = table.push(RowView {
                run: &run.id,
                press,
                phase,
                t_ns: run.t_ns[frame],
                position_mm: run.position_mm[frame],
                covering_mm: run.covering_mm.as_ref().map_or(rig.covering.thickness_mm, |all| all[frame]),
                indenter: run.indenter.as_ref().map_or(&rig.indenter, |all| &all[frame]),
                temperature_c: run.temperature_c.as_ref().map(|all| all[frame]),
                counts,
            });
            if let Err(error) = pushed {
                table.abandon();
                return Err(error.into());
            }
            meter::count(bytes / frames.max(1));
        }
    }
    Ok(table.finish()?)
}

impl RunSummary {
    fn of(run: &Run) -> Self {
        let is_hold = |frame: usize| run.phases[frame].0 == Phase::Hold;
        let frames = run.t_ns.len();
        Self {
            run: run.id.clone(),
            frames,
            presses: run
                .phases
                .iter()
                .map(|(_, press)| press + 1)
                .max()
                .and_then(|most| usize::try_from(most).ok())
                .unwrap_or(0),
            holds: (0..frames)
                .filter(|frame| is_hold(*frame) && (*frame == 0 || !is_hold(frame - 1)))
                .count(),
            idle: run.phases.iter().filter(|(phase, _)| *phase == Phase::Idle).count(),
            depth_max_mm: -run.position_mm.iter().map(|[_, _, z_mm]| *z_mm).fold(f64::INFINITY, f64::min),
        }
    }

    /// What looks as if the mapping were wrong.
    fn doubt(&self, covering_mm: f64) -> Option<String> {
        let Self { run, presses, depth_max_mm, .. } = self;
        if *presses == 0 {
            return Some(format!(
                "run {run}: no press: the tip's least z is {:.3} mm; see z.origin and z.direction",
                -depth_max_mm
            ));
        }
        (*depth_max_mm >= covering_mm).then(|| {
            format!("run {run}: the deepest frame is {depth_max_mm:.3} mm below the surface of a covering of {covering_mm} mm; see z.unit and z.origin")
        })
    }
}
