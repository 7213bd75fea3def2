//! Makes sets and runs `tactus discover` on each.

use std::fmt::Write;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail, ensure};
use rayon::ThreadPoolBuilder;
use rayon::iter::{ParallelBridge, ParallelIterator};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::campaign::Planned;
use super::timing::{Watched, watched};

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
    /// Sets that run at the same time, each on one thread.
    pub jobs: usize,
    /// Keeps the tables of measurements and of residuals, for the peers.
    pub keeps_tables: bool,
}

/// Progress of a campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress<'a> {
    /// Id of the set that was done last.
    pub id: &'a str,
    /// Sets done.
    pub done: usize,
    /// Sets in all.
    pub total: usize,
    /// Estimate of the remaining time.
    pub left_s: f64,
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

    /// When each stage of a set's discovery began.
    pub fn stages(&self, id: &str) -> PathBuf {
        self.work.join("stages").join(format!("{id}.jsonl"))
    }

    /// The label of a set.
    pub fn label(&self, id: &str) -> PathBuf {
        self.labels.join(format!("{id}.json"))
    }
}

/// Makes every set, writes its label and runs the program on its table. Sets that are done already are skipped.
///
/// # Errors
/// If a set cannot be made, a file cannot be written or the program cannot be started, or if the folder has results of another
/// build. A run of the program that fails is a result, not an error.
pub fn run(
    sets: &[Planned],
    places: &Places,
    workflow: &Workflow,
    progress: &(dyn Fn(Progress<'_>) + Sync),
) -> Result<()> {
    let program = digest(&workflow.tactus)?;
    let mut open = Vec::new();
    for set in sets {
        if is_done(set, places, &program, workflow.keeps_tables)? {
            continue;
        }
        open.push(set);
    }
    let started = Instant::now();
    let done = Mutex::new(0_usize);
    let work = |set: &&Planned| -> Result<()> {
        one(set, places, workflow, &program)?;
        let mut done = done.lock().map_err(|_| anyhow!("a worker panicked"))?;
        *done += 1;
        let per_set_s = started.elapsed().as_secs_f64() / *done as f64;
        progress(Progress {
            id: &set.id,
            done: sets.len() - open.len() + *done,
            total: sets.len(),
            left_s: per_set_s * (open.len() - *done) as f64,
        });
        Ok(())
    };
    let pool = ThreadPoolBuilder::new().num_threads(workflow.jobs.max(1)).build()?;
    pool.install(|| open.iter().par_bridge().try_for_each(work))
}

fn is_done(set: &Planned, places: &Places, program: &str, wants_tables: bool) -> Result<bool> {
    let path = places.ran(&set.id);
    if !path.exists() || !places.label(&set.id).exists() {
        return Ok(false);
    }
    let text = fs::read_to_string(&path).with_context(|| at(&path))?;
    let ran: Ran = serde_json::from_str(&text).with_context(|| at(&path))?;
    ensure!(
        ran.program == program,
        "{} is from another build of `tactus`: give another folder with --work, or remove this one",
        path.display()
    );
    Ok(!wants_tables
        || !places.report(&set.id).exists()
        || places.tables(&set.id).iter().all(|table| table.exists()))
}

fn one(set: &Planned, places: &Places, workflow: &Workflow, program: &str) -> Result<()> {
    let made = set.recipe.make().with_context(|| set.id.clone())?;
    let label = places.label(&set.id);
    write(&label, &serde_json::to_string_pretty(&made.label).with_context(|| at(&label))?)?;

    // The path that the program sees has the seed, not the set's name.
    let folder = places.work.join("now").join(format!("{:016x}", set.recipe.seed));
    fs::create_dir_all(&folder).with_context(|| at(&folder))?;
    let table = folder.join("set.parquet");
    made.write(&table).with_context(|| at(&table))?;
    drop(made);
    let out = folder.join("out");
    let [log, stages] = ["log", "stages"].map(|name| folder.join(name));
    let mut discover = Command::new(&workflow.tactus);
    discover.args(["--json", "discover", "--threads", "1", "--seed"]).arg(DISCOVERY_SEED.to_string());
    discover.arg("--stages").arg(&stages).args(&workflow.more).arg("--out").arg(&out).arg(&table);
    // No effects of the lab take part.
    discover.env("XDG_STATE_HOME", &folder).env_remove("STATE_DIRECTORY");
    discover.stdout(Stdio::null()).stderr(File::create(&log).with_context(|| at(&log))?);
    let Watched { exit, seconds, processor_s, peak_mib } = watched(&mut discover)?;
    let told =
        || fs::read(&log).map(|text| String::from_utf8_lossy(&text).into_owned()).with_context(|| at(&log));
    // Wrong arguments are an error of the campaign, not a result of a set.
    if exit.code() == Some(USAGE) {
        bail!("{}: {}", at(&workflow.tactus), told()?);
    }
    let found = out.join("report.json");
    let said = if found.exists() {
        moved(&found, &places.report(&set.id))?;
        moved(&stages, &places.stages(&set.id))?;
        if workflow.keeps_tables {
            let [kept_table, residuals] = places.tables(&set.id);
            moved(&table, &kept_table)?;
            moved(&out.join("residuals.parquet"), &residuals)?;
        }
        String::new()
    } else {
        told()?
    };
    let ran = Ran { program: program.into(), seconds, processor_s, peak_mib, exit: exit.code(), said };
    let path = places.ran(&set.id);
    write(&path, &serde_json::to_string_pretty(&ran).with_context(|| at(&path))?)?;
    fs::remove_dir_all(&folder).with_context(|| at(&folder))
}

fn digest(program: &Path) -> Result<String> {
    let bytes = fs::read(program).with_context(|| at(program))?;
    let mut digits = String::new();
    for byte in Sha256::digest(bytes) {
        write!(digits, "{byte:02x}")?;
    }
    Ok(digits)
}

fn moved(from: &Path, to: &Path) -> Result<()> {
    with_folder(to)?;
    fs::rename(from, to).with_context(|| at(from))
}

fn write(path: &Path, text: &str) -> Result<()> {
    with_folder(path)?;
    fs::write(path, text).with_context(|| at(path))
}

fn with_folder(path: &Path) -> Result<()> {
    path.parent().map_or(Ok(()), |folder| fs::create_dir_all(folder).with_context(|| at(folder)))
}

fn at(path: &Path) -> String {
    path.display().to_string()
}
