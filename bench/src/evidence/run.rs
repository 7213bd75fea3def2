//! Makes sets and runs `tactus discover` on each.

use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use serde_json::json;
use tactus_sets::Label;
use tactus_work::{Now, Stop, Work, Worked, Worker, agree, work, write_whole};
use tempfile::TempDir;

use super::campaign::{Planned, Seeds};
use super::outcome::parsed;
use crate::program::{Watched, digest, watched};

/// The folders of a campaign.
#[derive(Debug, Clone)]
pub struct Places {
    /// Reports and results; a set's table while it is worked on.
    pub work: PathBuf,
    /// Labels: for the scorer only.
    pub labels: PathBuf,
}

/// How `tactus discover` is run.
#[derive(Debug, Clone)]
pub struct Workflow {
    /// Path of the program `tactus`.
    pub tactus: PathBuf,
    /// Further arguments of `tactus discover`.
    pub more: Vec<String>,
    /// Keeps the tables of measurements and of residuals, for the peers.
    pub keeps_tables: bool,
}

/// The result of a run of the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ran {
    /// SHA-256 of the program.
    pub program: String,
    /// Wall time on one thread, while the other jobs run.
    pub seconds: f64,
    /// Time of the processor in s. Other programs hardly change it.
    #[serde(default)]
    pub processor_s: f64,
    /// Greatest resident memory in MiB.
    pub peak_mib: f64,
    /// Exit code; `None` if a signal ended the program.
    pub exit: Option<i32>,
    /// Its standard error, if it made no report.
    pub said: String,
}

/// Seed of every discovery: not of the sets.
const DISCOVERY_SEED: u64 = 1;

/// Exit code of `tactus` after wrong arguments.
const USAGE: i32 = 2;

impl Places {
    /// The report of a set, as `tactus discover` wrote it.
    pub fn report(&self, id: &str) -> PathBuf {
        self.work.join("reports").join(format!("{id}.json"))
    }

    /// The [`Ran`] of a set.
    pub fn ran(&self, id: &str) -> PathBuf {
        self.work.join("ran").join(format!("{id}.json"))
    }

    /// The tables of a set's measurements and residuals, if they are kept.
    pub fn tables(&self, id: &str) -> [PathBuf; 2] {
        ["sets", "residuals"].map(|folder| self.work.join(folder).join(format!("{id}.parquet")))
    }

    /// The draft of a set, if there is one.
    pub fn draft(&self, id: &str) -> PathBuf {
        self.work.join("drafts").join(format!("{id}.toml"))
    }

    /// The grown model of a set that has a draft.
    pub fn model(&self, id: &str) -> PathBuf {
        self.work.join("models").join(format!("{id}.toml"))
    }

    /// When each stage of a set's discovery began.
    pub fn stages(&self, id: &str) -> PathBuf {
        self.work.join("stages").join(format!("{id}.jsonl"))
    }

    /// The label of a set.
    pub fn label(&self, id: &str) -> PathBuf {
        self.labels.join(format!("{id}.json"))
    }

    /// The [`Curve`](super::Curve) of a set's draft.
    pub fn curve(&self, id: &str) -> PathBuf {
        self.labels.join("curves").join(format!("{id}.json"))
    }

    /// The [`Confirmed`](super::Confirmed) of a set's draft.
    pub fn confirmed(&self, id: &str) -> PathBuf {
        self.labels.join("confirmed").join(format!("{id}.json"))
    }
}

/// Makes every set, writes its label and runs the program on its table, each on one thread, with the other workers that have the same folders.
/// Sets that are done already are kept.
///
/// # Errors
/// If a set cannot be made, a file cannot be written or the program cannot be started, or if the folder has results of another
/// build or of other arguments. A run of the program that fails is a result, not an error.
pub fn run(
    sets: &[Planned],
    seeds: Seeds,
    places: &Places,
    workflow: &Workflow,
    worker: &Worker,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked> {
    let discoveries = Discoveries { places, workflow, program: digest(&workflow.tactus)? };
    let path = places.work.join("terms.json");
    if !path.exists() {
        // The folder may have results that are older than terms.
        for set in sets {
            discoveries.is_done(set)?;
        }
    }
    let terms = [
        ("program", json!(discoveries.program)),
        ("arguments", json!(workflow.more)),
        ("seeds", json!(seeds.name())),
        ("frames", json!(sets.first().and_then(|set| set.recipe.frames))),
    ];
    agree(&path, terms)?;
    work(&discoveries, sets, worker, progress)
}

/// The runs of the program on all sets.
struct Discoveries<'a> {
    places: &'a Places,
    workflow: &'a Workflow,
    /// SHA-256 of the program.
    program: String,
}

/// A run of the program, before others see it.
struct Discovery {
    folder: TempDir,
    label: Vec<u8>,
    ran: Ran,
}

impl Discovery {
    /// The measurement table.
    const TABLE: &str = "set.parquet";
    /// The folder of the results.
    const OUT: &str = "out";
    /// The draft in it.
    const DRAFT: &str = "draft-1.toml";
    const STAGES: &str = "stages";

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

impl Work for Discoveries<'_> {
    type Piece = Planned;
    type Made = Discovery;
    type Error = anyhow::Error;

    fn name(&self, set: &Planned) -> String {
        set.id.clone()
    }

    fn is_done(&self, set: &Planned) -> Result<bool> {
        let Self { places, workflow, program } = self;
        let path = places.ran(&set.id);
        if !path.exists() || !places.label(&set.id).exists() {
            return Ok(false);
        }
        let text = fs::read_to_string(&path).with_context(|| at(&path))?;
        let ran: Ran = serde_json::from_str(&text).with_context(|| at(&path))?;
        ensure!(
            ran.program == *program,
            "{} is from another build of `tactus`: give another folder with --work, or remove this one",
            path.display()
        );
        Ok(!workflow.keeps_tables
            || !places.report(&set.id).exists()
            || places.tables(&set.id).iter().all(|table| table.exists()))
    }

    fn make(&self, set: &Planned, stop: &Stop) -> Result<Option<Discovery>> {
        let made = set.recipe.make().with_context(|| set.id.clone())?;
        let label = self.label(set, &made.label)?;
        let now = self.now(set);
        fs::create_dir_all(&now).with_context(|| at(&now))?;
        let folder = TempDir::new_in(&now).with_context(|| at(&now))?;
        let [table, out, stages, log] =
            [Discovery::TABLE, Discovery::OUT, Discovery::STAGES, "log"].map(|name| folder.path().join(name));
        made.write(&table).with_context(|| at(&table))?;
        drop(made);
        let mut discover = Command::new(&self.workflow.tactus);
        discover.args(["--json", "discover", "--threads", "1", "--seed"]).arg(DISCOVERY_SEED.to_string());
        discover.arg("--stages").arg(&stages).args(&self.workflow.more).arg("--out").arg(&out).arg(&table);
        // No effects of the lab take part.
        discover.env("XDG_STATE_HOME", folder.path()).env_remove("STATE_DIRECTORY");
        discover.stdout(Stdio::null()).stderr(File::create(&log).with_context(|| at(&log))?);
        // A terminal's Ctrl-C is for the worker alone, which ends the program.
        discover.process_group(0);
        let Some(Watched { exit, seconds, processor_s, peak_mib }) = watched(&mut discover, stop)? else {
            drop(folder);
            self.clear(set);
            return Ok(None);
        };
        let told = || {
            fs::read(&log).map(|text| String::from_utf8_lossy(&text).into_owned()).with_context(|| at(&log))
        };
        // Wrong arguments are an error of the campaign, not a result of a set.
        if exit.code() == Some(USAGE) {
            bail!("{}: {}", at(&self.workflow.tactus), told()?);
        }
        let said = if out.join("report.json").exists() { String::new() } else { told()? };
        let program = self.program.clone();
        let ran = Ran { program, seconds, processor_s, peak_mib, exit: exit.code(), said };
        Ok(Some(Discovery { folder, label, ran }))
    }

    fn keep(&self, set: &Planned, discovery: Discovery) -> Result<()> {
        let Self { places, workflow, .. } = self;
        write(&places.label(&set.id), &discovery.label)?;
        let out = discovery.path(Discovery::OUT);
        let found = out.join("report.json");
        if found.exists() {
            moved(&found, &places.report(&set.id))?;
            moved(&discovery.path(Discovery::STAGES), &places.stages(&set.id))?;
            if out.join(Discovery::DRAFT).exists() {
                moved(&out.join(Discovery::DRAFT), &places.draft(&set.id))?;
                moved(&out.join("model.toml"), &places.model(&set.id))?;
            }
            if workflow.keeps_tables {
                let [kept_table, residuals] = places.tables(&set.id);
                moved(&discovery.path(Discovery::TABLE), &kept_table)?;
                moved(&out.join("residuals.parquet"), &residuals)?;
            }
        }
        // This one says that the set is done.
        let path = places.ran(&set.id);
        write(&path, &serde_json::to_vec_pretty(&discovery.ran).with_context(|| at(&path))?)?;
        drop(discovery);
        self.clear(set);
        Ok(())
    }
}

impl Discoveries<'_> {
    /// The text of a set's label, with the fits of the one that is there if both are of the same set: to fit takes longer than to run.
    fn label(&self, set: &Planned, label: &Label) -> Result<Vec<u8>> {
        let text = serde_json::to_vec_pretty(label).with_context(|| set.id.clone())?;
        let path = self.places.label(&set.id);
        if !path.exists() {
            return Ok(text);
        }
        // Both as they are read, in which a number may differ in its last bit from what was written.
        let mut label: Label = serde_json::from_slice(&text).with_context(|| set.id.clone())?;
        label.adopt_fits(&parsed(&path)?);
        serde_json::to_vec_pretty(&label).with_context(|| set.id.clone())
    }

    /// Folder of what is in work on a set: each worker has its own in it. The path that the program sees has the seed, not the set's name.
    fn now(&self, set: &Planned) -> PathBuf {
        self.places.work.join("now").join(format!("{:016x}", set.recipe.seed))
    }

    /// Removes it, with what workers have left that died in the set.
    fn clear(&self, set: &Planned) {
        // The program of a dead worker may still write.
        drop(fs::remove_dir_all(self.now(set)));
    }
}

fn moved(from: &Path, to: &Path) -> Result<()> {
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder).with_context(|| at(folder))?;
    }
    fs::rename(from, to).with_context(|| at(from))
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, bytes).with_context(|| at(path))
}

fn at(path: &Path) -> String {
    path.display().to_string()
}
