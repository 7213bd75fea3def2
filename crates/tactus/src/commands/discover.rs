//! `discover`: finds what a model is missing; writes a report, its numbers, the grown model and the residuals.

mod active;
mod measurements;
mod model;
mod print;
mod residuals;
mod settled;
mod stages;
mod twin_experiments;
mod unfinished;

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{Context, anyhow, bail};
use tactus_discover::{DiscoverError, Discovery, Known, Options, Rule};
use tactus_model::Array;
use tactus_model::effect::Definition;
use tactus_report::discovery::{
    ActiveRun, DataSource, DiscoveryReport, LabEffect, discovery_html, discovery_json, draft_status,
};
use tactus_schema::draft::{DraftEvidence, DraftFile, DraftStatus, Nearest};
use tactus_schema::{Model, Rig};

use crate::cli::{Ablation, Common, DiscoverArgs};
use crate::commands::library::Held;
use crate::exit::{Exit, Failure};
use crate::output;
use crate::progress::{Busy, DiscoveryProgress};
use measurements::Measurements;
use stages::StageLog;
use twin_experiments::TwinExperiments;
use unfinished::UnfinishedFolder;

pub(in crate::commands) use settled::confirm;

/// What a discovery writes: the report, its numbers, the grown model and the residuals.
const FILES: [&str; 4] = ["report.html", "report.json", "model.toml", "residuals.parquet"];

/// What follows the name of a draft in that of its file, if it was refuted.
const REFUTED: &str = "-refuted";

/// A discovery with its data and its model.
struct Discovered {
    measured: Measurements,
    /// The model that the data were compared with.
    model: Model,
    known: Known,
    discovery: Discovery,
    /// The lab's own effects that were tried.
    lab: Vec<LabEffect>,
    /// Experiments that `--active` ran.
    active: Vec<ActiveRun>,
    /// Why `--active` ran no further experiment, although there was a round for it.
    active_ended: Option<String>,
    /// Drafts of this discovery of which an experiment of `--active` has told whether they hold.
    settled: Vec<DraftFile>,
    /// The same of the lab's library, whose files are written at the end.
    remeasured: Vec<Held>,
    /// A sentence on each.
    settled_in_words: Vec<String>,
}

/// The rig on which experiments would run.
#[derive(Debug)]
struct LiveRig {
    name: String,
    /// Its file; `None` of a service's rig.
    rig: Option<Rig>,
}

pub(crate) fn discover(common: &Common, args: &DiscoverArgs) -> anyhow::Result<Exit> {
    if let Some(counts) = args.tolerance.filter(|counts| !(*counts > 0.0 && counts.is_finite())) {
        let error = format!("--tolerance must be above 0 counts, not {counts}");
        return Err(Failure::new(Exit::Usage, error).into());
    }
    let declared = args.model.as_deref().map(declared).transpose()?;
    let folder = UnfinishedFolder::create(&args.out)?;
    let stages = StageLog::default();
    let library = args.library.in_use()?;
    let analyse = |files: &[PathBuf], live: Option<&LiveRig>, drafts: &[&'static Definition]| {
        analysed(common, args, declared.clone(), files, live, drafts, &stages)
    };
    let mut discovered = if args.active {
        active::discover(common, args, &library, analyse)?
    } else {
        let drafts = library.iter().map(|one| one.draft.define()).collect::<Result<Vec<_>, _>>()?;
        analyse(&args.files, None, &drafts)?
    };
    let mut warnings: Vec<String> = args.library.is_missing().into_iter().collect();
    for one in &library {
        if let Some(warning) = one.of_another_array(&discovered.measured.rig.array) {
            warnings.push(warning);
            continue;
        }
        // As it is after the experiments of `--active`.
        let now = discovered.remeasured.iter().find(|other| other.path == one.path).unwrap_or(one);
        discovered.lab.push(now.for_report()?);
    }
    discovered.discovery.warnings.extend(warnings);
    let busy = Busy::with("writing", common.json);
    discovered.write(folder.path())?;
    let is_library = args.library.folder().is_some_and(|library| is_same_folder(&library, &args.out));
    folder.finish(|name| is_name_of_draft(name) && !is_library)?;
    discovered.remeasured.iter().try_for_each(Held::write)?;
    drop(busy);
    args.stages.as_deref().map(|path| stages.finish(path)).transpose()?;
    let drafts = discovered.drafts()?;
    let names = FILES.into_iter().chain(drafts.iter().map(|(name, _)| name.as_str()));
    let paths = names.map(|name| std::path::absolute(args.out.join(name))).collect::<Result<Vec<_>, _>>()?;
    if common.json {
        output::write(&discovery_json(&discovered.report()))?;
    } else {
        print::discovered(&discovered.report(), &paths);
    }
    Ok(if discovered.measured.notes.is_empty() { Exit::Done } else { Exit::Degraded })
}

/// Analyses files, which must be of the rig `live` if that is given.
fn analysed(
    common: &Common,
    args: &DiscoverArgs,
    declared: Option<Model>,
    files: &[PathBuf],
    live: Option<&LiveRig>,
    drafts: &[&'static Definition],
    stages: &StageLog,
) -> anyhow::Result<Discovered> {
    let busy = Busy::with("reading", common.json);
    let measured = busy.reads(|| Measurements::read(files))?;
    drop(busy);
    if let Some(live) = live.filter(|live| live.name != measured.rig.name) {
        let error = format!(
            "the data are of rig {:?}, but experiments would run on rig {:?}: name the rig of the data with --rig or --rig-file",
            measured.rig.name, live.name
        );
        return Err(Failure::new(Exit::Usage, error).into());
    }
    let model = match declared {
        Some(model) => of_array(model, args.model.as_deref(), &measured.rig.array)?,
        None => {
            Model::of_rig(&measured.rig).context("the rig's reference indenter is not among its tools")?
        }
    };
    let drafts = of_this_array(drafts, &measured.rig.array);
    let known = known(&measured.rig, &model, drafts);
    let threads = args.threads.map_or_else(cores, usize::from);
    let rule = match args.ablation {
        None => Rule::Protocol,
        Some(Ablation::Bic) => Rule::Bic,
    };
    let options = Options { seed: args.seed, threads, rule, tolerance_counts: args.tolerance };
    let live = live.and_then(|live| live.rig.as_ref());
    let experiments = TwinExperiments::of(&measured, live, args.experiments.as_deref())?;
    let progress = DiscoveryProgress::new(common.json);
    let found = tactus_discover::discover(&known, &measured.frames, options, &experiments, &|now| {
        progress.show(&now);
        if args.stages.is_some() {
            stages.note(&now);
        }
    });
    drop(progress);
    let mut discovery = found.map_err(|error| match error {
        DiscoverError::TooLittle(_) => {
            anyhow!("{error}; `tactus run diagnose` measures enough; give its recording beside these data")
        }
        DiscoverError::Model(_) | DiscoverError::Effect(_) | DiscoverError::Threads { .. } => error.into(),
    })?;
    discovery.warnings.extend(measured.renamed.clone());
    Ok(Discovered {
        lab: Vec::new(),
        measured,
        model,
        known,
        discovery,
        active: Vec::new(),
        active_ended: None,
        settled: Vec::new(),
        remeasured: Vec::new(),
        settled_in_words: Vec::new(),
    })
}

impl Discovered {
    /// Writes report, numbers, model and residuals.
    fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let report = self.report();
        let grown = model::grown(&self.model, &self.discovery, &self.measured.id());
        let texts =
            [discovery_html(&report), discovery_json(&report), grown.to_toml().context("the grown model")?];
        let [html, json, model, residuals] = FILES.map(|name| folder.join(name));
        for (path, text) in [html, json, model].iter().zip(texts) {
            fs::write(path, text).with_context(|| path.display().to_string())?;
        }
        for (name, file) in self.drafts()? {
            let path = folder.join(name);
            let text = file.to_toml().context("a draft")?;
            fs::write(&path, text).with_context(|| path.display().to_string())?;
        }
        residuals::write(self, &residuals)
    }

    /// The files of all drafts, with their names.
    fn drafts(&self) -> anyhow::Result<Vec<(String, DraftFile)>> {
        let named = |file: &DraftFile| {
            let refuted = if file.status == DraftStatus::Refuted { REFUTED } else { "" };
            (format!("{}{refuted}.toml", file.draft.name), file.clone())
        };
        Ok(self.settled.iter().chain(&self.draft()?).map(named).collect())
    }

    /// The draft with what speaks for it, if there is one.
    fn draft(&self) -> anyhow::Result<Option<DraftFile>> {
        let Some(Ok(found)) = &self.discovery.draft else { return Ok(None) };
        let hash = |source: &DataSource| (source.id.clone(), source.sha256.clone());
        let nearest = found.nearest.iter();
        Ok(Some(DraftFile {
            draft: found.draft.clone(),
            status: draft_status(found),
            was: None,
            // That of a law is no number where the data do not determine it.
            covariance: Some(&found.covariance)
                .filter(|rows| rows.iter().flatten().all(|number| number.is_finite()))
                .cloned()
                .unwrap_or_default(),
            nearest: nearest
                .map(|(class, behind)| Nearest { class: (*class).to_owned(), ln_odds_behind: *behind })
                .collect(),
            evidence: Some(DraftEvidence {
                data: self.measured.data.iter().map(hash).collect(),
                seed: self.discovery.seed,
                p_value: found.p_value,
                ln_odds: found.ln_odds,
                folds: u32::try_from(found.folds)?,
                closed_share: found.closed.map(|closed| closed.share),
                closed_share_se: found.closed.and_then(|closed| closed.standard_error),
            }),
            confirmation: None,
        }))
    }

    fn report(&self) -> DiscoveryReport<'_> {
        DiscoveryReport {
            rig: &self.measured.rig.name,
            simulated: self.measured.simulated,
            array: &self.measured.rig.array,
            data: &self.measured.data,
            notes: &self.measured.notes,
            active: &self.active,
            active_ended: self.active_ended.as_deref(),
            settled: &self.settled_in_words,
            lab: &self.lab,
            discovery: &self.discovery,
        }
    }
}

/// True of the name of a draft's file as a discovery gives it: `draft-1.toml`, or `draft-1-refuted.toml`.
fn is_name_of_draft(name: &str) -> bool {
    let number = name.strip_prefix("draft-").and_then(|rest| rest.strip_suffix(".toml"));
    let number = number.map(|rest| rest.strip_suffix(REFUTED).unwrap_or(rest));
    number.is_some_and(|number| !number.is_empty() && number.chars().all(|digit| digit.is_ascii_digit()))
}

/// True if both are there and are one folder.
fn is_same_folder(one: &Path, other: &Path) -> bool {
    let [one, other] = [one, other].map(|path| path.canonicalize().ok());
    one.is_some() && one == other
}

/// Reads a model file.
pub(crate) fn declared(path: &Path) -> anyhow::Result<Model> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let refused = |error| Failure::new(Exit::Usage, format!("{}: {error}", path.display()));
    Ok(Model::from_toml(&text).map_err(refused)?)
}

/// Reads the start model: the given model file, or the base model of the rig file.
///
/// # Errors
/// If it is of another array than the data.
fn of_array(model: Model, path: Option<&Path>, measured: &Array) -> anyhow::Result<Model> {
    let declared = &model.base.array;
    if !declared.is_like(measured) {
        let path = path.unwrap_or(Path::new("the model")).display();
        bail!(
            "{path} is a model of another array than the data: the model has {}, the data have {}",
            described(declared),
            described(measured)
        );
    }
    Ok(model)
}

fn described(array: &Array) -> String {
    format!(
        "{:?} ({} rows of {}, {} mm apart, {} Hz, {} to {} counts in steps of {})",
        array.name(),
        array.rows(),
        array.cols(),
        array.pitch_mm(),
        array.rate_hz(),
        array.least_counts(),
        array.full_scale_counts(),
        array.step_counts()
    )
}

/// The drafts that are of the data's array. The lab's library may hold those of its other sensors too.
fn of_this_array(drafts: &[&'static Definition], array: &Array) -> Vec<&'static Definition> {
    let is_of = |one: &&&'static Definition| one.draft().is_none_or(|draft| draft.fits(array).is_ok());
    drafts.iter().filter(is_of).copied().collect()
}

fn known(rig: &Rig, model: &Model, drafts: Vec<&'static Definition>) -> Known {
    Known {
        array: rig.array.clone(),
        psf: model.base.psf,
        response: model.base.response.clone(),
        registration: rig.registration,
        indenters: rig.indenters.clone(),
        effects: model.effects.iter().map(|known| known.effect.clone()).collect(),
        drafts,
    }
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
