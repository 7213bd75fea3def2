//! A run whose program died goes on from its last confirmed press.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::cell::Cell;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use rustix::process::Signal;
use tactus_e2e::{Process, ServiceUnderTest, tactus, until};
use tactus_record::{Entry, Message, confirmed_presses, rows};
use tactus_schema::pb::{self, run_event::Event};
use tempfile::TempDir;

const PRESSES: &str = "def run(rig):\n    tare()\n    for i in range(5):\n        press(3.0 + 2.0 * i, 5.0, depths_mm = [0.2, 0.4], dwell_s = 2.0)\n";

/// The recording, once it has on disk the first dwell of a press after `confirmed` ones. The second dwell is under way then.
fn in_press(runs: &Path, confirmed: usize) -> Option<PathBuf> {
    let path = recordings(runs).into_iter().next()?;
    // Its first bytes may not be there yet.
    tactus_record::read(&path).ok()?;
    (presses(&path).len() >= confirmed && is_pressing(&path)).then_some(path)
}

/// Of the runs in a folder, in the order of their names, and so of their beginnings.
fn recordings(runs: &Path) -> Vec<PathBuf> {
    let folders = fs::read_dir(runs).into_iter().flatten().flatten();
    let mut paths: Vec<_> =
        folders.map(|run| run.path().join("recording.mcap")).filter(|path| path.is_file()).collect();
    paths.sort();
    paths
}

/// True if there is a dwell of a press that is neither confirmed nor broken off: a busy machine may starve the sensor, and the
/// press is repeated.
fn is_pressing(recording: &Path) -> bool {
    let confirmed = presses(recording).last().map_or(-1, |(press, _)| *press);
    is_pressing_in(confirmed, events(recording))
}

fn is_pressing_in(confirmed: i32, events: impl Iterator<Item = Event>) -> bool {
    let mut held = None;
    for event in events {
        if let Event::DwellDone(dwell) = &event {
            held = Some(dwell.press);
        }
        if let Event::PressRepeated(repeated) = &event
            && held == Some(repeated.press)
        {
            held = None;
        }
    }
    held.is_some_and(|press| press > confirmed)
}

#[test]
fn a_press_that_is_broken_off_is_not_under_way() {
    let held = |press| Event::DwellDone(pb::DwellDone { press, ..pb::DwellDone::default() });
    let repeated = |press| Event::PressRepeated(pb::PressRepeated { press, ..pb::PressRepeated::default() });
    let is_pressing = |events: &[Event]| is_pressing_in(1, events.iter().cloned());
    assert!(is_pressing(&[held(1), held(2)]));
    assert!(!is_pressing(&[held(1), held(1)]));
    assert!(!is_pressing(&[held(2), repeated(2)]));
    assert!(is_pressing(&[held(2), repeated(2), held(3)]));
}

fn events(recording: &Path) -> impl Iterator<Item = Event> {
    tactus_record::read(recording).unwrap().filter_map(|entry| match entry.unwrap() {
        Entry::Message { message: Message::Event(event), .. } => event.event,
        Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => None,
    })
}

/// How a run was started.
fn start_of(recording: &Path) -> pb::RunStarted {
    match events(recording).next() {
        Some(Event::Started(started)) => started,
        other => panic!("{other:?}"),
    }
}

fn id(recording: &Path) -> String {
    recording.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned()
}

/// Index and place of the confirmed presses.
fn presses(recording: &Path) -> Vec<(i32, f64)> {
    let presses = confirmed_presses(recording).unwrap();
    presses.iter().map(|press| (press.press, press.dwells[0].x_mm)).collect()
}

/// Runs and presses of the rows of a table.
fn presses_in(table: &Path) -> BTreeSet<(String, i32)> {
    let mut presses = BTreeSet::new();
    rows::visit(&[table], |_, row| {
        if row.press >= 0 {
            presses.insert((row.run.to_owned(), row.press));
        }
    })
    .unwrap();
    presses
}

/// Number of presses with a dwell, those included that were broken off and repeated: a busy machine may starve the sensor.
fn pressed(recording: &Path) -> usize {
    let press = |event| if let Event::DwellDone(dwell) = event { Some(dwell.press) } else { None };
    events(recording).filter_map(press).filter(|press| *press >= 0).collect::<BTreeSet<_>>().len()
}

/// Both runs together have each press of the script once, and count on.
fn each_once(confirmed: &[(i32, f64)], rest: &[(i32, f64)]) {
    let all = [confirmed, rest].concat();
    assert_eq!(all.iter().map(|(_, x_mm)| *x_mm).collect::<Vec<_>>(), [3.0, 5.0, 7.0, 9.0, 11.0]);
    assert!(all.is_sorted_by(|(press, _), (next, _)| press < next), "{all:?}");
}

#[test]
fn after_kill_9_in_a_press_the_run_goes_on_and_each_press_is_in_the_table_once() {
    let mut lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("five.star", PRESSES);
    let _client = lab.start_tactus(&["run", &script, "--seed", "3"]);
    let runs = lab.folder.path().join("runs");
    let mut viewer = lab.start_tactus(&["watch", "--json"]);
    // Two looks a second: the machine has better to do.
    let frames = Cell::new(0);
    viewer.wait_until(|_| {
        frames.set(frames.get() + 1);
        frames.get() % 15 == 0 && in_press(&runs, 2).is_some()
    });
    let first = in_press(&runs, 2).unwrap();
    let run_id = id(&first);
    let busy = lab.tactus(&["run", "--continue", &run_id]);
    assert_eq!(busy.code, Some(5), "one run at a time, and the lease is held: {busy:?}");
    lab.daemon.kill();
    assert!(lab.truth()["z_mm"].as_f64().unwrap() < 0.0, "the tip stands in contact");

    lab.daemon = Process::start("tactusd", lab.folder.path(), &["--config", "tactusd.toml"]);
    lab.daemon.wait_for("ready");
    let confirmed = presses(&first);
    assert!((2..5).contains(&confirmed.len()), "{confirmed:?}");
    let refused = lab.tactus(&["run", "--continue", &run_id]);
    assert_eq!(refused.code, Some(4), "nothing moves before a reset: {refused:?}");
    assert_eq!(lab.tactus(&["reset"]).code, Some(0));
    for strange in ["../runs", "none", &format!("../runs/{run_id}"), ""] {
        let unknown = lab.tactus(&["run", "--continue", strange]);
        assert_eq!(unknown.code, Some(2), "{strange}: {unknown:?}");
    }
    // The file has changed meanwhile.
    lab.script("five.star", "def run(rig):\n    press(3.0, 5.0, depths_mm = [0.5])\n");
    let done = lab.tactus(&["run", "--continue", &run_id, "--no-report"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let words = format!("continues {run_id}, {} of 5 presses taken over", confirmed.len());
    assert!(done.out.contains(&words), "{done:?}");

    let both = recordings(&runs);
    assert_eq!((both.len(), &both[0]), (2, &first));
    let rest = presses(&both[1]);
    each_once(&confirmed, &rest);
    let info = lab.tactus(&["--json", "record", "info", &both[1].display().to_string()]).json();
    assert_eq!((&info["continues"], &info["presses"]), (&run_id.as_str().into(), &pressed(&both[1]).into()));
    let started = start_of(&both[1]);
    let taken = started.taken_over.unwrap();
    let next = confirmed.last().unwrap().0 + 1;
    assert_eq!((started.seed, taken.presses as usize, taken.first_press), (3, confirmed.len(), next));

    let table = lab.folder.path().join("both.parquet");
    let files = both
        .iter()
        .map(|path| path.display().to_string())
        .chain(["--out".into(), table.display().to_string()]);
    let args: Vec<_> = ["export".to_owned()].into_iter().chain(files).collect();
    let exported = lab.tactus(&args.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(exported.code, Some(0), "{exported:?}");
    assert!(exported.err.contains("are left out"), "{exported:?}");
    let of = |recording: &Path, presses: &[(i32, f64)]| -> Vec<_> {
        presses.iter().map(|(press, _)| (id(recording), *press)).collect()
    };
    let of_table = presses_in(&table);
    let of_both = [of(&both[0], &confirmed), of(&both[1], &rest)].concat();
    assert!(of_both.iter().all(|press| of_table.contains(press)), "{of_table:?}");
    let indices: BTreeSet<i32> = of_table.iter().map(|(_, press)| *press).collect();
    assert_eq!(indices.len(), of_table.len(), "a press is in one run only: {of_table:?}");

    // Nothing is left to do.
    let over = lab.tactus(&["run", "--continue", &id(&both[1])]);
    assert_eq!(over.code, Some(2), "{over:?}");
    assert!(over.err.contains("nothing to continue"), "{over:?}");
}

#[test]
fn a_killed_run_of_the_embedded_rig_goes_on_in_its_folder() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("five.star"), PRESSES).unwrap();
    let embedded =
        Process::start("tactus", folder.path(), &["run", "five.star", "--embedded", "--real-time"]);
    let runs = folder.path().join("runs");
    let first = until("a press", || in_press(&runs, 1));
    embedded.signal(Signal::KILL);
    assert_eq!(embedded.wait().0, None);
    let confirmed = presses(&first);
    assert!((1..5).contains(&confirmed.len()), "{confirmed:?}");

    fs::write(folder.path().join("five.star"), PRESSES.replace("0.4", "0.5")).unwrap();
    let run_id = id(&first);
    let go_on = |args: &[&str]| {
        tactus(folder.path(), &[&["--json", "run", "--embedded", "--continue", &run_id], args].concat())
    };
    for (args, says) in [
        (&["five.star"][..], "cannot be used with"),
        (&["--seed", "1"], "cannot be used with"),
        (&["-p", "a=1"], "cannot be used with"),
        (&["--out", "elsewhere"], "no run"),
    ] {
        let refused = go_on(args);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(format!("{refused:?}").contains(says), "{says}: {refused:?}");
    }
    let done = go_on(&["--no-report"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(done.err.contains("has changed since"), "{done:?}");
    let summary = done.json();
    let recording = Path::new(summary["recording"].as_str().unwrap());
    each_once(&confirmed, &presses(recording));
    assert_eq!(
        (&summary["presses"], &summary["presses_taken_over"], &summary["dwells_taken_over"]),
        (&pressed(recording).into(), &confirmed.len().into(), &(2 * confirmed.len()).into())
    );
    assert_eq!(summary["continues"], run_id.as_str());
}
