//! A lab with a few recordings, and the program.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::Arc,
};

use serde_json::Value;
use tactus_record::{Header, Recording, Script};
use tactus_schema::{
    WallTime,
    pb::{self, run_event::Event},
};
use tempfile::TempDir;

use crate::synthetic::{Fed, Plan};

/// Noon of 2026-03-25, UTC.
pub(crate) const NOON_NS: i64 = 1_774_440_000_000_000_000;
pub(crate) const DAY_NS: i64 = 86_400_000_000_000;

/// A folder with recordings.
pub(crate) struct Lab {
    folder: TempDir,
}

/// What a recording says of its run.
struct Told {
    experiment: &'static str,
    taken_over: Option<pb::TakenOver>,
}

impl Default for Told {
    fn default() -> Self {
        Self { experiment: "element-centres", taken_over: None }
    }
}

/// What a program said.
#[derive(Debug)]
pub(crate) struct Said {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Lab {
    pub(crate) fn new() -> Self {
        Self { folder: TempDir::new().unwrap() }
    }

    /// Two rigs, the second with runs on two days.
    pub(crate) fn with_three_runs() -> Self {
        let lab = Self::new();
        lab.record("left", "20260325-120000-image", NOON_NS, 1);
        lab.record("right", "20260325-120000-centres", NOON_NS, 2);
        lab.record("right", "20260326-120000-centres", NOON_NS + DAY_NS, 2);
        lab
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Records a run of so many presses into `runs`.
    pub(crate) fn record(&self, rig: &str, run_id: &str, started_ns: i64, presses: usize) -> PathBuf {
        self.record_with_gain(rig, run_id, started_ns, presses, 1.0)
    }

    /// The same with a sensor whose rises are multiplied.
    pub(crate) fn record_with_gain(
        &self,
        rig: &str,
        run_id: &str,
        started_ns: i64,
        presses: usize,
        gain: f64,
    ) -> PathBuf {
        let plan = Plan { run_id: run_id.to_owned(), ..Plan::short(presses) };
        self.record_plan(rig, plan, started_ns, gain)
    }

    /// Records a run that goes on with another one, whose presses from 1 on it does again.
    pub(crate) fn record_continued(
        &self,
        rig: &str,
        run_id: &str,
        started_ns: i64,
        earlier: &str,
    ) -> PathBuf {
        let plan = Plan { run_id: run_id.to_owned(), ..Plan::short(2) };
        let taken_over = pb::TakenOver { run_id: earlier.to_owned(), first_press: 1, ..Default::default() };
        self.record_told(
            rig,
            plan,
            started_ns,
            1.0,
            &Told { taken_over: Some(taken_over), ..Told::default() },
        )
    }

    /// Records what `tactus collect` hears of a rig while it does a few presses.
    pub(crate) fn collect(&self, rig: &str, run_id: &str, started_ns: i64) -> PathBuf {
        let plan = Plan { run_id: run_id.to_owned(), ..Plan::short(2) };
        self.record_told(rig, plan, started_ns, 1.0, &Told { experiment: "collect", ..Told::default() })
    }

    /// Records a run as planned, with a sensor whose rises are multiplied.
    pub(crate) fn record_plan(&self, rig: &str, plan: Plan, started_ns: i64, gain: f64) -> PathBuf {
        self.record_told(rig, plan, started_ns, gain, &Told::default())
    }

    fn record_told(&self, rig: &str, plan: Plan, started_ns: i64, gain: f64, told: &Told) -> PathBuf {
        let mut run = plan.make();
        let run_id = &run.plan.run_id.clone();
        rig.clone_into(&mut run.rig.name);
        let path = self.path(&format!("runs/{run_id}/recording.mcap"));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let versions = BTreeMap::from([("tactus".to_owned(), "0.1.0".to_owned())]);
        let header = Header {
            run_id,
            experiment: told.experiment,
            who: "ada",
            rig: &run.rig,
            rig_toml: None,
            link_toml: None,
            script: Script { name: "element-centres.star", source: "" },
            versions: &versions,
            parameters_json: "{}",
            started: WallTime::from_ns(started_ns),
            simulated: true,
            continues: told.taken_over.as_ref().map(|taken| taken.run_id.as_str()),
        };
        let mut recording = Recording::create(&path, &header).unwrap();
        for fed in &mut run.fed {
            match fed {
                Fed::Frame(frame) => frame.counts = amplified(&frame.counts, gain),
                Fed::Info(info, _) => rig.clone_into(&mut info.rig),
                Fed::Event(pb::RunEvent { event: Some(Event::Started(started)), .. }) => {
                    started.taken_over.clone_from(&told.taken_over);
                }
                Fed::Stage(_) | Fed::Event(_) => {}
            }
            fed.write(&mut recording).unwrap();
        }
        recording.finish().unwrap();
        path
    }

    /// Exports recordings as a measurement table of this name.
    pub(crate) fn export(&self, recordings: &[PathBuf], table: &str) {
        let table = self.path(table);
        fs::create_dir_all(table.parent().unwrap()).unwrap();
        tactus_record::export(recordings, table).unwrap();
    }

    /// Runs the program in the lab's folder.
    pub(crate) fn fleet(&self, args: &[&str]) -> Said {
        let output = self.command(args).output().unwrap();
        Said::of(&output)
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tactus-fleet"));
        command.args(args).current_dir(self.folder.path()).env_remove("TACTUS_FLEET");
        command
    }

    /// Ingests all recordings into `fleet`; what the program said.
    pub(crate) fn ingest(&self) -> Value {
        let said = self.fleet(&["--json", "ingest", "runs", "--to", "fleet"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        said.json()
    }

    /// The files of `fleet`, relative to it.
    pub(crate) fn files(&self) -> Vec<String> {
        let root = self.path("fleet");
        let mut files = Vec::new();
        collect(&root, &root, &mut files);
        files.sort();
        files
    }
}

/// Counts whose rises above the baseline of 100 are multiplied.
fn amplified(counts: &[f32], gain: f64) -> Arc<[f32]> {
    #[expect(clippy::cast_possible_truncation, reason = "counts are of single precision")]
    counts.iter().map(|counts| (100.0 + gain * (f64::from(*counts) - 100.0)) as f32).collect()
}

fn collect(root: &Path, folder: &Path, files: &mut Vec<String>) {
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            files.push(path.strip_prefix(root).unwrap().to_str().unwrap().to_owned());
        }
    }
}

impl Said {
    fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        Self { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }
}
