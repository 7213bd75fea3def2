//! A disk that hangs, in the place of the recordings: an ext4 file system in a file, frozen with `fsfreeze`. It needs root and loop
//! devices; without them these tests say so and pass.

use std::path::PathBuf;
use std::process::Command;

use rustix::process::Signal;
use tactus_schema::pb;
use tempfile::TempDir;

use crate::bench::{Bench, Options};

const HOLD: &str = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.2], dwell_s = 600.0)\n";
const PRESS: &str = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.2])\n";

#[test]
fn a_disk_that_hangs_fails_the_run_and_neither_stops_nor_ends_the_service() {
    let mut disk = match Disk::mount() {
        Ok(disk) => disk,
        Err(why) => return eprintln!("not tested: {why}"),
    };
    let mut bench = Bench::start(Options { recordings: Some(disk.path.clone()), ..Options::default() });
    bench.reset();
    bench.run_until_below(HOLD, -0.15);
    disk.hang();
    let reply = bench.until("the run has failed", |reply| {
        reply.state.as_ref().is_some_and(|state| state.phase() == pb::RunPhase::Finished)
    });
    let state = reply.state.unwrap();
    assert_eq!(state.exit_status(), pb::ExitStatus::Failed, "{state:?}");
    assert!(state.message.contains("the disk"), "{state:?}");
    assert!(bench.truth_at_rest()["z_mm"].as_f64().unwrap() > 1.9);
    let frames = reply.health.unwrap().frames;
    bench.until("frames still flow", |reply| {
        reply.health.as_ref().is_some_and(|health| health.frames > frames + 30)
    });
    disk.go_on();

    // It needs neither a restart nor a reset.
    bench.run(PRESS);
    bench.until_finished();
    let state = bench.until("an answer", |_| true).state.unwrap();
    assert_eq!(state.exit_status(), pb::ExitStatus::Done, "{state:?}");
    let daemon = bench.take_daemon();
    daemon.signal(Signal::TERM);
    let (code, said) = daemon.wait();
    assert_eq!(code, Some(0));
    assert!(!said.contains("does not go on"), "the watchdog took the disk for a part of the service: {said}");
}

/// A file system in a file, which can be frozen. It needs root.
pub(crate) struct Disk {
    folder: TempDir,
    pub(crate) path: PathBuf,
    hangs: bool,
}

impl Disk {
    /// An error if this machine does not let it be made.
    pub(crate) fn mount() -> Result<Self, String> {
        let folder = TempDir::new().map_err(|error| error.to_string())?;
        let (image, path) = (folder.path().join("image"), folder.path().join("disk"));
        std::fs::create_dir(&path).map_err(|error| error.to_string())?;
        let [image, place] = [&image, &path].map(|path| path.display().to_string());
        system("truncate", &["--size=2G", &image])?;
        system("mkfs.ext4", &["-q", &image])?;
        system("mount", &["-o", "loop", &image, &place])?;
        Ok(Self { folder, path, hangs: false })
    }

    /// From now on each write waits.
    pub(crate) fn hang(&mut self) {
        system("fsfreeze", &["--freeze", &self.path.display().to_string()]).unwrap();
        self.hangs = true;
    }

    /// The writes go on.
    pub(crate) fn go_on(&mut self) {
        system("fsfreeze", &["--unfreeze", &self.path.display().to_string()]).unwrap();
        self.hangs = false;
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        if self.hangs {
            self.go_on();
        }
        let place = self.path.display().to_string();
        // A process that was killed a moment ago may still have it open.
        if let Err(why) = system("umount", &["--lazy", &place]) {
            eprintln!("{}: {why}", self.folder.path().display());
        }
    }
}

fn system(program: &str, args: &[&str]) -> Result<(), String> {
    let done = Command::new(program).args(args).output().map_err(|error| format!("{program}: {error}"))?;
    if done.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&done.stderr);
    Err(format!("{program}: {}", said.lines().next().unwrap_or_default()))
}
