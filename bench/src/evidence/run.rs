//! Making sets and having the real binary discover.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use tactus_mock::hidden::HiddenError;
use tactus_record::table::TableError;

use super::campaign::Planned;

/// Where things go.
#[derive(Debug, Clone)]
pub struct Places {
    /// Reports; tables while they are worked on.
    pub work: PathBuf,
    /// Labels: for the scorer only.
    pub sealed: PathBuf,
}

/// What discovers.
#[derive(Debug, Clone)]
pub struct Workflow {
    /// The program `tactus`.
    pub tactus: PathBuf,
    /// Arguments beside those that every run has.
    pub more: Vec<String>,
    /// Seed of the discovery.
    pub seed: u64,
    /// Sets at once; each has one thread.
    pub jobs: usize,
    /// Keep the tables of measurements and of residuals, for programs that work on them.
    pub keeps_tables: bool,
}

/// How far it has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress<'a> {
    /// The set that was done last.
    pub id: &'a str,
    /// Sets done.
    pub done: usize,
    /// Sets in all.
    pub total: usize,
    /// Seconds that the rest will take.
    pub left_s: f64,
}

/// What became of a run of the binary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ran {
    /// SHA-256 of the program.
    pub program: String,
    /// Wall time on one thread, beside as many others as there are jobs.
    pub seconds: f64,
    /// Exit code; none if a signal ended it.
    pub exit: Option<i32>,
    /// What it said on standard error, if it made no report.
    pub said: String,
}

/// Why sets cannot be made or discovered in.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A set cannot be made.
    #[error("{id}: {source}")]
    Make {
        /// Which.
        id: String,
        /// Why.
        source: HiddenError,
    },
    /// A table cannot be written.
    #[error("{}: {source}", path.display())]
    Table {
        /// Which.
        path: PathBuf,
        /// Why.
        source: TableError,
    },
    /// A file cannot be read or written, or a program not started.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A label or a result cannot be written.
    #[error("{}: {source}", path.display())]
    Json {
        /// Which.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// Results of another program lie where this one's would go.
    #[error(
        "{} is the work of another build of `tactus`; give another folder, or remove that one",
        path.display()
    )]
    OtherBuild {
        /// The result.
        path: PathBuf,
    },
    /// A thread panicked.
    #[error("a worker panicked")]
    Panicked,
}

impl Places {
    /// A set's report, as `tactus discover` wrote it.
    pub fn report(&self, id: &str) -> PathBuf {
        self.work.join("reports").join(format!("{id}.json"))
    }

    /// What became of the run.
    pub fn ran(&self, id: &str) -> PathBuf {
        self.work.join("ran").join(format!("{id}.json"))
    }

    /// A set's measurement table and that of its residuals, if they are kept.
    pub fn tables(&self, id: &str) -> [PathBuf; 2] {
        ["sets", "residuals"].map(|folder| self.work.join(folder).join(format!("{id}.parquet")))
    }

    /// A set's truth.
    pub fn label(&self, id: &str) -> PathBuf {
        self.sealed.join(format!("{id}.json"))
    }
}

/// Makes every set, seals its label, and has the program discover in its table; what is done already is left as it is.
///
/// # Errors
/// [`RunError`]. A run of the program that fails is a result, not an error.
pub fn run(
    sets: &[Planned],
    places: &Places,
    workflow: &Workflow,
    progress: &(dyn Fn(Progress<'_>) + Sync),
) -> Result<(), RunError> {
    let program = digest(&workflow.tactus)?;
    let mut open = Vec::new();
    for set in sets {
        if is_done(set, places, &program, workflow.keeps_tables)? {
            continue;
        }
        open.push(set);
    }
    let started = Instant::now();
    let next = AtomicUsize::new(0);
    let done = Mutex::new(0_usize);
    let work = || -> Result<(), RunError> {
        while let Some(set) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            one(set, places, workflow, &program)?;
            let mut done = done.lock().map_err(|_| RunError::Panicked)?;
            *done += 1;
            let per_set_s = started.elapsed().as_secs_f64() / *done as f64;
            progress(Progress {
                id: &set.id,
                done: sets.len() - open.len() + *done,
                total: sets.len(),
                left_s: per_set_s * (open.len() - *done) as f64,
            });
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..workflow.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().map_err(|_| RunError::Panicked)?)
    })
}

fn is_done(set: &Planned, places: &Places, program: &str, wants_tables: bool) -> Result<bool, RunError> {
    let path = places.ran(&set.id);
    if !path.exists() || !places.label(&set.id).exists() {
        return Ok(false);
    }
    let text = fs::read_to_string(&path).map_err(file(&path))?;
    let ran: Ran = serde_json::from_str(&text).map_err(json(&path))?;
    if ran.program != program {
        return Err(RunError::OtherBuild { path });
    }
    Ok(!wants_tables
        || !places.report(&set.id).exists()
        || places.tables(&set.id).iter().all(|table| table.exists()))
}

fn one(set: &Planned, places: &Places, workflow: &Workflow, program: &str) -> Result<(), RunError> {
    let made = set.recipe.make().map_err(|source| RunError::Make { id: set.id.clone(), source })?;
    let label = places.label(&set.id);
    write(&label, &serde_json::to_string_pretty(&made.label).map_err(json(&label))?)?;

    // The program sees a number, not the set's name.
    let folder = places.work.join("now").join(format!("{:016x}", set.recipe.seed));
    fs::create_dir_all(&folder).map_err(file(&folder))?;
    let table = folder.join("set.parquet");
    made.write(&table).map_err(|source| RunError::Table { path: table.clone(), source })?;
    drop(made);
    let out = folder.join("out");
    let started = Instant::now();
    let output = Command::new(&workflow.tactus)
        .args(["--json", "discover", "--threads", "1", "--seed"])
        .arg(workflow.seed.to_string())
        .args(&workflow.more)
        .arg("--out")
        .arg(&out)
        .arg(&table)
        .output()
        .map_err(file(&workflow.tactus))?;
    let seconds = started.elapsed().as_secs_f64();
    let found = out.join("report.json");
    let said = if found.exists() {
        moved(&found, &places.report(&set.id))?;
        if workflow.keeps_tables {
            let [kept_table, residuals] = places.tables(&set.id);
            moved(&table, &kept_table)?;
            moved(&out.join("residuals.parquet"), &residuals)?;
        }
        String::new()
    } else {
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let ran = Ran { program: program.into(), seconds, exit: output.status.code(), said };
    let path = places.ran(&set.id);
    write(&path, &serde_json::to_string_pretty(&ran).map_err(json(&path))?)?;
    fs::remove_dir_all(&folder).map_err(file(&folder))
}

fn digest(program: &Path) -> Result<String, RunError> {
    let bytes = fs::read(program).map_err(file(program))?;
    Ok(Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

fn moved(from: &Path, to: &Path) -> Result<(), RunError> {
    with_folder(to)?;
    fs::rename(from, to).map_err(file(from))
}

fn write(path: &Path, text: &str) -> Result<(), RunError> {
    with_folder(path)?;
    fs::write(path, text).map_err(file(path))
}

fn with_folder(path: &Path) -> Result<(), RunError> {
    path.parent().map_or(Ok(()), |folder| fs::create_dir_all(folder).map_err(file(folder)))
}

fn file(path: &Path) -> impl Fn(io::Error) -> RunError {
    let path = path.to_path_buf();
    move |source| RunError::File { path: path.clone(), source }
}

fn json(path: &Path) -> impl Fn(serde_json::Error) -> RunError {
    let path = path.to_path_buf();
    move |source| RunError::Json { path: path.clone(), source }
}
