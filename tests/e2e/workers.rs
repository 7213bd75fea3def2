//! Workers of one folder share its sets, whatever happens to one of them: `tactus-bench evidence run`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{
    collections::BTreeMap,
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use rustix::process::Signal;
use serde_json::Value;
use tactus_e2e::{Process, binary, computed, files};
use tempfile::TempDir;

/// Sets of [`evidence`].
const SETS: usize = 3;

/// The command of a worker: some small sets in the folders `NAME/work` and `NAME/labels`, one at a time.
fn evidence(name: &str, more: &[&str]) -> Vec<String> {
    evidence_with("600", &binary("tactus"), name, more)
}

fn evidence_with(frames: &str, tactus: &Path, name: &str, more: &[&str]) -> Vec<String> {
    let [work, labels] = ["work", "labels"].map(|folder| format!("{name}/{folder}"));
    let which = ["evidence", "run", "--size", "quick", "--only", "false-alarms/white", "--frames", frames];
    let places = ["--tactus", tactus.to_str().unwrap(), "--work", &work, "--labels", &labels, "--jobs", "1"];
    [&which[..], &places, more].concat().into_iter().map(str::to_owned).collect()
}

fn start(folder: &Path, args: &[String]) -> Process {
    Process::start_computing("tactus-bench", folder, &args.iter().map(String::as_str).collect::<Vec<_>>())
}

fn run(folder: &Path, args: &[String]) -> (Option<i32>, String) {
    let said = computed("tactus-bench", folder, &args.iter().map(String::as_str).collect::<Vec<_>>());
    (said.code, said.out + &said.err)
}

/// What does not differ from worker to worker: times and memory do.
fn results(folder: &Path, name: &str) -> [BTreeMap<PathBuf, Vec<u8>>; 2] {
    ["work/reports", "labels"].map(|part| files(&folder.join(name).join(part)))
}

/// Claims, as paths in their folder.
fn claims(folder: &Path, name: &str) -> Vec<PathBuf> {
    files(&folder.join(name).join("work/claims/discovery")).into_keys().collect()
}

/// Holds a worker while it has a set that is not done.
fn hold_at_work(worker: &Process, folder: &Path, name: &str) {
    let ran = folder.join(name).join("work/ran");
    let is_at_work =
        || claims(folder, name).first().is_some_and(|claim| !ran.join(claim.with_extension("json")).exists());
    worker.hold_when("a worker that is held while it has a set", is_at_work);
}

/// The numbers of `sets: 3 done, 5 by other workers, 0 before`.
fn told(said: &str) -> [usize; 3] {
    let line = said.lines().find(|line| line.starts_with("sets: ")).unwrap_or_else(|| panic!("{said}"));
    let numbers: Vec<usize> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().unwrap()
}

/// The results of one worker.
static ALONE: LazyLock<[BTreeMap<PathBuf, Vec<u8>>; 2]> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let (code, said) = run(folder.path(), &evidence("alone", &[]));
    assert_eq!((code, told(&said)), (Some(0), [SETS, 0, 0]), "{said}");
    results(folder.path(), "alone")
});

#[test]
fn two_workers_share_the_sets_and_find_what_one_finds() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let args = evidence("shared", &["--lease-s", "3600"]);
    let first = start(folder, &args);
    hold_at_work(&first, folder, "shared");
    let mut second = start(folder, &args);
    second.wait_for(&format!("{}/{SETS} ", SETS - 1));
    // It waits for the last set, which the first one has.
    assert_eq!(claims(folder, "shared").len(), 1);
    first.signal(Signal::CONT);
    let [(first_code, first_said), (second_code, second_said)] = [first.wait(), second.wait()];
    assert_eq!((first_code, second_code), (Some(0), Some(0)), "{first_said}{second_said}");
    let [first_told, second_told] = [told(&first_said), told(&second_said)];
    // Each set was done once.
    assert!(first_told[0] >= 1 && second_told[0] >= 1, "{first_told:?} {second_told:?}");
    assert_eq!(first_told[0] + second_told[0], SETS);
    for worker in [first_told, second_told] {
        assert_eq!(worker.iter().sum::<usize>(), SETS);
    }
    assert!(claims(folder, "shared").is_empty());
    assert_eq!(results(folder, "shared"), *ALONE);
}

#[test]
fn the_set_of_a_killed_worker_is_taken_over() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let args = evidence("shared", &["--lease-s", "1"]);
    let mut first = start(folder, &args);
    hold_at_work(&first, folder, "shared");
    first.kill();
    let done = files(&folder.join("shared/work/ran")).len();
    let (code, said) = start(folder, &args).wait();
    assert_eq!((code, told(&said)), (Some(0), [SETS - done, 0, done]), "{said}");
    assert!(claims(folder, "shared").is_empty());
    assert_eq!(results(folder, "shared"), *ALONE);
}

#[test]
fn a_stopped_worker_leaves_nothing_half_done_and_the_next_goes_on() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let args = evidence("shared", &[]);
    let worker = start(folder, &args);
    hold_at_work(&worker, folder, "shared");
    worker.signal(Signal::INT);
    worker.signal(Signal::CONT);
    let (code, said) = worker.wait();
    let [done, ..] = told(&said);
    assert_eq!(code, Some(1), "{said}");
    let left = SETS - done;
    assert!(said.contains(&format!("stopped; {left} sets are not done: the same command goes on")), "{said}");
    assert!(claims(folder, "shared").is_empty() && files(&folder.join("shared/work/now")).is_empty());
    let ran = files(&folder.join("shared/work/ran"));
    assert_eq!(ran.len(), done);
    for (path, content) in ran {
        assert!(serde_json::from_slice::<Value>(&content).is_ok(), "{}", path.display());
    }
    let (code, said) = run(folder, &args);
    assert_eq!((code, told(&said)), (Some(0), [left, 0, done]), "{said}");
    assert_eq!(results(folder, "shared"), *ALONE);
}

#[test]
fn a_folder_of_another_build_or_of_other_arguments_is_refused() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let (code, said) = run(folder, &evidence("shared", &[]));
    assert_eq!(code, Some(0), "{said}");
    let ran = files(&folder.join("shared/work/ran"));
    let refused = |args: &[String], expected: &str| {
        let (code, said) = run(folder, args);
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains(expected), "{said}");
        assert_eq!(files(&folder.join("shared/work/ran")), ran);
    };
    let other_method = evidence("shared", &["--with=--ablation", "--with=bic"]);
    refused(&other_method, r#"are of arguments [], not of ["--ablation","bic"]"#);
    refused(&evidence_with("700", &binary("tactus"), "shared", &[]), "are of frames 600, not of 700");
    // Another build is another file.
    let other = folder.join("tactus");
    fs::copy(binary("tactus"), &other).unwrap();
    fs::OpenOptions::new().append(true).open(&other).unwrap().write_all(&[0]).unwrap();
    let other_build = evidence_with("600", &other, "shared", &[]);
    refused(&other_build, "are of program");
    // Folders may be older than their terms.
    fs::remove_file(folder.join("shared/work/terms.json")).unwrap();
    refused(&other_build, "is from another build of `tactus`");
}
