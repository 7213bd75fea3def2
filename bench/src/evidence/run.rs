//! Making sets and having the real binary discover.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, ensure};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

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

/// Exit code of a program that was called wrongly.
const USAGE: i32 = 2;

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
/// If a set cannot be made, a file not written or the program not started, or if the results of another build lie there. A run
/// of the program that fails is a result, not an error.
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
    let next = AtomicUsize::new(0);
    let done = Mutex::new(0_usize);
    let work = || -> Result<()> {
        while let Some(set) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
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
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..workflow.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().map_err(|_| anyhow!("a worker panicked"))?)
    })
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
        "{} is the work of another build of `tactus`; give another folder, or remove that one",
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

    // The program sees a number, not the set's name.
    let folder = places.work.join("now").join(format!("{:016x}", set.recipe.seed));
    fs::create_dir_all(&folder).with_context(|| at(&folder))?;
    let table = folder.join("set.parquet");
    made.write(&table).with_context(|| at(&table))?;
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
        .with_context(|| at(&workflow.tactus))?;
    let seconds = started.elapsed().as_secs_f64();
    let told = || String::from_utf8_lossy(&output.stderr).into_owned();
    // A wrong argument says nothing of any set.
    ensure!(output.status.code() != Some(USAGE), "{}: {}", at(&workflow.tactus), told());
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
        told()
    };
    let ran = Ran { program: program.into(), seconds, exit: output.status.code(), said };
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
