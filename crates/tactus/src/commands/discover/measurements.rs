//! The frames that a discovery analyses.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use anyhow::bail;
use tactus_discover::Frames;
use tactus_record::rows;
use tactus_report::discovery::DataSource;
use tactus_schema::Rig;

use crate::sha256;

/// Frames, and where they came from.
pub(super) struct Measurements {
    pub(super) files: Vec<PathBuf>,
    pub(super) rig: Rig,
    /// A warning if the files give the rig several names.
    pub(super) renamed: Option<String>,
    pub(super) simulated: bool,
    pub(super) data: Vec<DataSource>,
    /// Defects of the files.
    pub(super) notes: Vec<String>,
    pub(super) frames: Frames,
    /// Thickness of the covering in the last frame.
    pub(super) covering_mm: f64,
    /// Id of the tool in the last frame.
    pub(super) indenter: String,
}

impl Measurements {
    pub(super) fn read(files: &[PathBuf]) -> anyhow::Result<Self> {
        let mut frames: Option<Frames> = None;
        let mut runs: BTreeMap<String, (u64, BTreeSet<i32>)> = BTreeMap::new();
        let mut covering_mm = 0.0;
        let mut indenter = String::new();
        let source = rows::visit(files, |rig, row| {
            covering_mm = row.covering_mm;
            if indenter != row.indenter {
                row.indenter.clone_into(&mut indenter);
            }
            frames.get_or_insert_with(|| Frames::new(rig.array.elements())).push(row);
            if !runs.contains_key(row.run) {
                runs.insert(row.run.to_owned(), Default::default());
            }
            if let Some((frames, presses)) = runs.get_mut(row.run) {
                *frames += 1;
                presses.extend((row.press >= 0).then_some(row.press));
            }
        })?;
        let Some(frames) = frames else { bail!("the files hold no frame") };
        let mut hashes = BTreeMap::new();
        for run in &source.runs {
            if !hashes.contains_key(&run.path) {
                hashes.insert(&run.path, sha256::of_file(&run.path)?);
            }
        }
        let data = source.runs.iter().map(|run| {
            let (frames, presses) = runs.remove(&run.run).unwrap_or_default();
            let sha256 = hashes[&run.path].clone();
            DataSource { id: run.run.clone(), sha256, frames, presses: presses.len() as u64 }
        });
        let data = data.collect();
        let simulated = source.rig.simulated || source.runs.iter().any(|run| run.simulated);
        let renamed = source.renamed();
        let (rig, notes) = (source.rig, [source.warnings, source.notes].concat());
        Ok(Self {
            files: files.to_owned(),
            rig,
            renamed,
            simulated,
            data,
            notes,
            frames,
            covering_mm,
            indenter,
        })
    }

    /// The run ids, as evidence names them.
    pub(super) fn id(&self) -> String {
        let ids: Vec<&str> = self.data.iter().map(|source| source.id.as_str()).collect();
        ids.join(", ")
    }
}
