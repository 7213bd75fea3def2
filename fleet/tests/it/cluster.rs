//! A cluster of a scheduler and two executors answers as one process does, also if an executor dies.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{fs, net::TcpListener, path::Path};

use rustix::process::Signal;
use tactus_e2e::{Process, free_endpoint, until};

use crate::lab::{DAY_NS, Lab, NOON_NS};

/// Processes of a cluster, which end with it.
struct Cluster {
    scheduler: Process,
    address: String,
    executors: Vec<Process>,
}

/// A query of some seconds, for [`Lab::with_eight_days`].
const PAIRS: &str = "SELECT a.date, a.press, image(a.counts) AS image, count(*) AS pairs FROM frames a
    JOIN frames b ON a.press = b.press AND a.phase = b.phase AND a.date = b.date
    GROUP BY a.date, a.press ORDER BY a.date, a.press";

/// Folders that the executors are in, for parts of answers.
const PARTS: [&str; 2] = ["parts-0", "parts-1"];

impl Cluster {
    fn start(lab: &Lab) -> Self {
        let mut cluster = Self::start_scheduler(lab);
        let scheduler = &cluster.address;
        let executors = PARTS.map(|parts| {
            let folder = lab.path(parts);
            fs::create_dir(&folder).unwrap();
            let endpoint = free_endpoint();
            let at = ["--scheduler", scheduler, "--listen", endpoint.strip_prefix("tcp/").unwrap()];
            let args = [&["--threads", "1", "executor", "--spill", "."], &at[..]].concat();
            let mut executor = Process::start("tactus-fleet", &folder, &args);
            executor.wait_for("executor at ");
            executor
        });
        cluster.executors.extend(executors);
        cluster
    }

    fn start_scheduler(lab: &Lab) -> Self {
        let mut scheduler = start(lab, &["scheduler", "--listen", "127.0.0.1:0", "--lost-s", "10"]);
        let ready = scheduler.wait_for("scheduler at ");
        let address = ready.strip_prefix("scheduler at ").unwrap().split(';').next().unwrap();
        Self { address: address.to_owned(), scheduler, executors: Vec::new() }
    }

    fn ask(&self, lab: &Lab, sql: &str) -> Process {
        start(lab, &["--json", "query", sql, "--at", "fleet", "--cluster", &self.address])
    }
}

impl Lab {
    /// A fleet of one rig with a run on each of eight days.
    fn with_eight_days() -> Self {
        let lab = Self::new();
        for day in 0..8 {
            lab.record("left", &format!("2026032{}-120000-image", 1 + day), NOON_NS + day * DAY_NS, 48);
        }
        lab.ingest();
        lab
    }
}

fn start(lab: &Lab, args: &[&str]) -> Process {
    Process::start("tactus-fleet", &lab.path(""), args)
}

#[test]
fn a_cluster_answers_as_one_process() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    fs::write(lab.path("model.toml"), include_str!("../../../config/models/digitacts.toml")).unwrap();
    let cluster = Cluster::start(&lab);
    for sql in [
        "SELECT rig, date, phase, count(*) AS frames, max(counts[18]) AS largest FROM frames
         GROUP BY rig, date, phase ORDER BY rig, date, phase",
        "SELECT rig, image(counts) AS image FROM frames WHERE phase = 'hold' GROUP BY rig ORDER BY rig",
        "SELECT d.rig, d.run, d.press, depth_mm, rms(response(image, zeros)) AS rise
         FROM dwells d JOIN presses USING (rig, date, run, press) ORDER BY d.rig, d.run, d.press, depth_mm",
        "SELECT rig, run, frames, who, warnings FROM runs ORDER BY rig, run",
        "SELECT rig, run, press, max(rms(residual)) AS rms FROM predicted('model.toml')
         WHERE phase = 'hold' GROUP BY rig, run, press ORDER BY rig, run, press",
    ] {
        let alone = lab.fleet(&["--json", "query", sql]);
        assert_eq!(alone.code, Some(0), "{alone:?}");
        assert!(!alone.out.is_empty());
        assert_eq!(cluster.ask(&lab, sql).wait(), (Some(0), alone.out.trim_end().to_owned()));
    }
}

#[test]
fn an_executor_that_dies_in_a_query_costs_nothing_but_time() {
    let lab = Lab::with_eight_days();
    let alone = lab.fleet(&["--json", "query", PAIRS]);
    assert_eq!(alone.code, Some(0), "{alone:?}");
    let mut cluster = Cluster::start(&lab);
    let mut query = cluster.ask(&lab, PAIRS);
    let at = until("an executor that has done a part", || {
        (0..PARTS.len()).find(|&at| has_file(&lab.path(PARTS[at])))
    });
    cluster.executors[at].kill();
    assert!(query.is_running());
    assert_eq!(query.wait(), (Some(0), alone.out.trim_end().to_owned()));
}

#[test]
fn a_query_whose_executors_all_die_fails_in_words() {
    let lab = Lab::with_eight_days();
    let mut cluster = Cluster::start(&lab);
    let mut query = cluster.ask(&lab, PAIRS);
    until("a part that is done", || PARTS.iter().any(|parts| has_file(&lab.path(parts))).then_some(()));
    cluster.executors.iter_mut().for_each(Process::kill);
    assert!(query.is_running());
    let (code, said) = query.wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("all executors were lost"), "{said}");
}

#[test]
fn scheduler_and_executors_end_when_they_are_told_to_and_leave_nothing_behind() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let cluster = Cluster::start(&lab);
    let sql = "SELECT rig, count(*) FROM frames GROUP BY rig";
    assert_eq!(cluster.ask(&lab, sql).wait().0, Some(0));
    assert!(PARTS.iter().any(|parts| has_file(&lab.path(parts))));
    for (executor, signal) in cluster.executors.into_iter().zip([Signal::INT, Signal::TERM]) {
        executor.signal(signal);
        assert_eq!(executor.wait().0, Some(0));
    }
    for parts in PARTS {
        assert_eq!(fs::read_dir(lab.path(parts)).unwrap().count(), 0);
    }
    cluster.scheduler.signal(Signal::TERM);
    assert_eq!(cluster.scheduler.wait().0, Some(0));
}

#[test]
fn a_scheduler_that_is_not_there_is_said() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let endpoint = free_endpoint();
    let address = endpoint.strip_prefix("tcp/").unwrap();
    let query = start(&lab, &["query", "SELECT 1", "--at", "fleet", "--cluster", address]);
    for process in [query, start(&lab, &["executor", "--scheduler", address, "--listen", "127.0.0.1:0"])] {
        let (code, said) = process.wait();
        assert_eq!(code, Some(1), "{said}");
        let expected =
            format!("no scheduler answers at {address}: `tactus fleet scheduler --listen {address}`");
        assert!(said.contains(&expected), "{said}");
    }
}

#[test]
fn a_fleet_in_an_object_store_is_refused() {
    let lab = Lab::new();
    let query = ["query", "SELECT 1", "--at", "memory:///fleet", "--cluster", "127.0.0.1:50050"];
    let (code, said) = start(&lab, &query).wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("memory:///fleet is in an object store"), "{said}");
}

#[test]
fn an_address_that_is_taken_is_said() {
    let lab = Lab::new();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    // To an executor, whoever listens there is its scheduler.
    for args in [
        &["scheduler", "--listen", &address][..],
        &["executor", "--listen", &address, "--scheduler", &address],
    ] {
        let (code, said) = start(&lab, args).wait();
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains(&format!("{address} cannot be listened on")), "{said}");
    }
}

#[test]
fn a_scheduler_without_executors_is_said() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let cluster = Cluster::start_scheduler(&lab);
    let (code, said) = cluster.ask(&lab, "SELECT count(*) FROM frames").wait();
    assert_eq!(code, Some(1), "{said}");
    let expected = format!(
        "the scheduler at {0} has no executor: `tactus fleet executor --scheduler {0}`",
        cluster.address
    );
    assert!(said.contains(&expected), "{said}");
}

/// True if there is a file in a folder or in the folders in it.
fn has_file(folder: &Path) -> bool {
    fs::read_dir(folder).into_iter().flatten().flatten().any(|entry| {
        let path = entry.path();
        if path.is_dir() { has_file(&path) } else { path.is_file() }
    })
}
