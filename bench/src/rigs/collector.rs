//! `tactus collect` beside the service: it hears all topics of all rigs, and writes them.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use rustix::process::Signal;
use serde_json::Value;
use tactus_bus::Endpoint;
use tokio::time::sleep;

use super::{PATIENCE, end, processor_s, status};

/// Time between two looks at its folder.
const AGAIN: Duration = Duration::from_millis(100);

/// What a collector of so many rigs took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CollectorMeasured {
    /// Processor time for a frame with all other messages, in microseconds, while the frames were counted.
    pub frame_us: f64,
    /// Share of one processor that it took.
    pub cores: f64,
    /// Memory that is its own (`RssAnon`), in KiB.
    pub memory_kib: u64,
    /// Its open files.
    pub open_files: usize,
    /// What it wrote of each rig, in bytes a second.
    pub bytes_per_s: f64,
    /// Frames that it did not get, by its own account.
    pub frames_lost: u64,
}

/// A collector; it ends with this.
pub(super) struct Collector {
    child: Child,
    folder: PathBuf,
}

/// What it had spent when the measurement began.
pub(super) struct Before {
    at: Instant,
    processor_s: f64,
    bytes: u64,
}

impl Collector {
    /// Starts the program `tactus`. Files go into a folder of `folder`.
    pub(super) fn start(program: &Path, endpoint: &Endpoint, folder: &Path) -> Result<Self> {
        let log = File::create(folder.join("collector.log"))?;
        let folder = folder.join("collected");
        let child = Command::new(program)
            .args(["--json", "--endpoint", &endpoint.to_string(), "collect", "--out"])
            .arg(&folder)
            .env("MALLOC_ARENA_MAX", "2")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .with_context(|| format!("{} does not start", program.display()))?;
        Ok(Self { child, folder })
    }

    /// Waits until it writes a file of each rig.
    pub(super) async fn has_all(&mut self, rigs: usize) -> Result<()> {
        let began = Instant::now();
        while self.files().len() < rigs {
            ensure!(self.child.try_wait()?.is_none(), "the collector has ended");
            ensure!(began.elapsed() < PATIENCE, "the collector writes {} of {rigs} rigs", self.files().len());
            sleep(AGAIN).await;
        }
        Ok(())
    }

    pub(super) fn before(&self) -> Result<Before> {
        Ok(Before { at: Instant::now(), processor_s: processor_s(self.child.id())?, bytes: self.bytes() })
    }

    /// What it has spent since, while so many frames of so many rigs came. Ends it.
    pub(super) fn measured(mut self, before: &Before, frames: u64, rigs: usize) -> Result<CollectorMeasured> {
        let (seconds, pid) = (before.at.elapsed().as_secs_f64(), self.child.id());
        let spent_s = processor_s(pid)? - before.processor_s;
        let (memory_kib, bytes) = (status(pid, "RssAnon:")?, self.bytes() - before.bytes);
        let open_files = fs::read_dir(format!("/proc/{pid}/fd"))?.count();
        end(&self.child, Signal::INT)?;
        let said = std::io::read_to_string(self.child.stdout.take().context("its output")?)?;
        self.child.wait()?;
        let said: Value = serde_json::from_str(&said).with_context(|| said.clone())?;
        let Some(of_rigs) = said["rigs"].as_array() else { bail!("the collector says {said}") };
        Ok(CollectorMeasured {
            frame_us: spent_s * 1e6 / frames as f64,
            cores: spent_s / seconds,
            memory_kib,
            open_files,
            bytes_per_s: bytes as f64 / seconds / rigs as f64,
            frames_lost: of_rigs.iter().filter_map(|rig| rig["frames_lost"].as_u64()).sum(),
        })
    }

    /// The files that it writes.
    fn files(&self) -> Vec<PathBuf> {
        let inside = |folder: &Path| {
            let found = fs::read_dir(folder).into_iter().flatten().flatten();
            found.map(|found| found.path()).collect::<Vec<_>>()
        };
        inside(&self.folder).iter().flat_map(|rig| inside(rig)).filter(|path| path.is_file()).collect()
    }

    fn bytes(&self) -> u64 {
        self.files().iter().filter_map(|file| fs::metadata(file).ok()).map(|file| file.len()).sum()
    }
}

impl Drop for Collector {
    fn drop(&mut self) {
        // It may have ended already.
        if self.child.kill().is_ok() {
            drop(self.child.wait());
        }
    }
}
