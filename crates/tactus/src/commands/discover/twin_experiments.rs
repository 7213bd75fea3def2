//! The experiments of a rig, each rehearsed on the rig's twin.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use tactus_discover::{Experiments, FaultKind, FaultyElement, Frames, Rehearsal, RehearsalOrder};
use tactus_plan::{Arguments, Evaluate};
use tactus_record::Entry;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::experiments;
use tactus_runner::order::{self, RunRequest};
use tactus_runner::rehearsal;
use tactus_runner::script_process::ScriptProcesses;
use tactus_schema::pb::ExitStatus;
use tactus_schema::rig::{ElementFault, Envelope, Service};
use tactus_schema::{Rig, WallTime};

use super::measurements::Measurements;

/// No experiment is proposed that takes longer.
const LONGEST: Duration = Duration::from_hours(1);

/// Of a rig that is only described, the stage may go this far beyond the array.
const MARGIN_MM: f64 = 5.0;

/// The attachment of a recording that is the rig file as it was read.
const RIG_TOML: &str = "rig.toml";

/// The built-in experiments and the lab's own, on the twin of a rig.
#[derive(Debug)]
pub(super) struct TwinExperiments {
    rig: Rig,
    own: Vec<String>,
    evaluator: Arc<dyn Evaluate>,
}

impl TwinExperiments {
    /// The experiments of the rig `live`, or else of the rig that was measured, with the scripts in a folder.
    ///
    /// Tables and some recordings only describe their rig. It then gets an envelope around the array, and the shipped simulated rig's
    /// motion with the data's speed of loading.
    pub(super) fn of(
        measured: &Measurements,
        live: Option<&Rig>,
        folder: Option<&Path>,
    ) -> anyhow::Result<Self> {
        let own = folder.map(own_scripts).transpose()?.unwrap_or_default();
        let evaluator = Arc::new(ScriptProcesses::of_this_program());
        if let Some(rig) = live {
            return Ok(Self { rig: rig.clone(), own, evaluator });
        }
        let mut rig = rig_file(&measured.files)?.unwrap_or_else(|| measured.rig.clone());
        rig.covering.thickness_mm = measured.covering_mm;
        rig.indenter.clone_from(&measured.indenter);
        if rig.service.is_none() {
            rig.service = Some(service_around(&rig, &measured.frames)?);
        }
        Ok(Self { rig, own, evaluator })
    }

    fn rehearsed(&self, order: RehearsalOrder<'_>) -> anyhow::Result<Rehearsal> {
        let mut arguments = Arguments::default();
        for (name, value) in order.parameters {
            arguments.set(&format!("{name}={value}"))?;
        }
        let request = RunRequest {
            script: experiments::find(order.experiment, None)?,
            arguments,
            seed: Some(order.seed),
            who: "discover".into(),
            evaluator: Arc::clone(&self.evaluator),
            earlier: None,
        };
        let never = || false;
        let faults = order.faulty.iter().map(|one| (one.element, fault(one))).collect();
        let order = order::order(request, &self.rig, WallTime::default(), &never)?;
        let rehearsal = rehearsal::rehearse(&self.rig, faults, order, LONGEST, &never)?;
        let outcome = &rehearsal.outcome;
        anyhow::ensure!(outcome.exit_status == ExitStatus::Done, "{}", outcome.message);
        let mut frames = Frames::new(self.rig.array.elements());
        rehearsal.visit(|row| frames.push(row))?;
        Ok(Rehearsal { frames, duration_s: outcome.duration_s })
    }
}

impl Experiments for TwinExperiments {
    fn covering_mm(&self) -> f64 {
        self.rig.covering.thickness_mm
    }

    fn own(&self) -> &[String] {
        &self.own
    }

    fn rehearse(&self, order: RehearsalOrder<'_>) -> Result<Rehearsal, String> {
        self.rehearsed(order).map_err(|error| crate::exit::in_words(&error))
    }
}

/// The paths of the scripts in a folder, in order, without those that are built in.
fn own_scripts(folder: &Path) -> anyhow::Result<Vec<String>> {
    let of = || format!("the experiments in {}", folder.display());
    let mut scripts: Vec<PathBuf> = Vec::new();
    for file in fs::read_dir(folder).with_context(of)? {
        let path = file.with_context(of)?.path();
        if path.extension().is_some_and(|extension| extension == "star") && !is_built_in(&path) {
            scripts.push(path);
        }
    }
    scripts.sort();
    Ok(scripts.iter().map(|path| path.display().to_string()).collect())
}

/// True for a copy of a built-in script. One that cannot be read is told of when it is rehearsed.
fn is_built_in(path: &Path) -> bool {
    fs::read(path).is_ok_and(|text| experiments::BUILT_IN.iter().any(|(_, source)| source.as_bytes() == text))
}

/// The rig file in the latest recording that has one.
fn rig_file(files: &[PathBuf]) -> anyhow::Result<Option<Rig>> {
    for path in files.iter().rev() {
        // A table is no recording.
        let Ok(entries) = tactus_record::read(path) else { continue };
        for entry in entries {
            match entry.with_context(|| path.display().to_string())? {
                Entry::Attachment(file) if file.name == RIG_TOML => {
                    // A file of a later version may say what this one does not know; the description does.
                    return Ok(String::from_utf8(file.data).ok().and_then(|text| Rig::from_toml(&text).ok()));
                }
                Entry::Run(_) | Entry::Attachment(_) => {}
                Entry::Message { .. } => break,
            }
        }
    }
    Ok(None)
}

/// A service for a rig that is only described: no limits beside the array's surroundings and the covering's bottom.
fn service_around(rig: &Rig, frames: &Frames) -> anyhow::Result<Service> {
    let mut service = Rig::from_toml(SIMULATED_RIG)?.service.context("the shipped rig has no service")?;
    let [[x0, x1], [y0, y1]] = rig.array.extent_mm();
    let corners = [[x0, y0], [x0, y1], [x1, y0], [x1, y1]].map(|corner| rig.registration.to_robot(corner));
    let around = |axis: usize| {
        let along = corners.map(|corner| corner[axis]);
        [
            along.into_iter().fold(f64::INFINITY, f64::min) - MARGIN_MM,
            along.into_iter().fold(f64::NEG_INFINITY, f64::max) + MARGIN_MM,
        ]
    };
    let all_counts = rig.array.full_scale_counts() * rig.array.elements() as f64;
    let load_mm_per_s = frames.load_speed_mm_per_s().unwrap_or(service.motion.load_speed_mm_per_s);
    service.motion.load_speed_mm_per_s = load_mm_per_s;
    service.envelope = Envelope {
        x_mm: around(0),
        y_mm: around(1),
        depth_share_max: 1.0,
        depth_max_mm: rig.covering.thickness_mm,
        load_speed_max_mm_per_s: service.envelope.load_speed_max_mm_per_s.max(load_mm_per_s),
        element_max_counts: all_counts,
        sum_max_counts: all_counts,
        baseline_band_counts: all_counts,
        unwatched_elements: Vec::new(),
        expects_response: false,
        ..service.envelope
    };
    Ok(service)
}

/// The fault as a virtual sensor has it.
fn fault(faulty: &FaultyElement) -> ElementFault {
    match faulty.kind {
        FaultKind::Dead => ElementFault::Dead,
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        FaultKind::Stuck { counts } => ElementFault::Stuck { counts: counts.round() as u16 },
        FaultKind::CrossWired { answers_for } => ElementFault::Miswired { answers_for },
        FaultKind::Noisy { rms_counts } => ElementFault::Noisy { noise_rms_counts: rms_counts },
    }
}

#[cfg(test)]
#[path = "twin_experiments_tests.rs"]
mod tests;
