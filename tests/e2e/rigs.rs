//! Many rigs on one service: what happens to one does not happen to the others.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_bus::{Client, Endpoint, History, Subscription};
use tactus_e2e::{
    CommandOutput, Process, SmallDisk, free_endpoint, repository, small_rig, tactus, until, within,
};
use tactus_record::{Entry, Message};
use tactus_schema::pb;
use tempfile::TempDir;
use tokio::runtime::Runtime;

/// Frames that the tests see before and after a rig dies.
const FRAMES: usize = 15;
const READS: &str = "def run(rig):\n    tare()\n    wait(8.0)\n";

/// Longer than the tests need.
const READS_ON: &str = "def run(rig):\n    tare()\n    wait(120.0)\n";

/// A service of several rigs, in a folder.
struct Lab {
    folder: TempDir,
    endpoint: String,
}

impl Lab {
    fn new() -> Self {
        let (folder, endpoint) = (TempDir::new().unwrap(), free_endpoint());
        fs::create_dir(folder.path().join("rigs")).unwrap();
        let config = format!("rigs = \"rigs\"\nrecordings = \"runs\"\n[bus]\nlisten = [\"{endpoint}\"]\n");
        fs::write(folder.path().join("tactusd.toml"), config).unwrap();
        Self { folder, endpoint }
    }

    fn write(&self, file: &str, text: &str) {
        fs::write(self.folder.path().join("rigs").join(file), text).unwrap();
    }

    /// A rig at pseudo-terminals of its own.
    fn add(&self, name: &str) {
        let rig = small_rig()
            .replace("name = \"bench\"", &format!("name = \"{name}\""))
            .replace("\"mock/", &format!("\"mock-{name}/"));
        self.write(&format!("{name}.toml"), &rig);
    }

    fn mock(&self, name: &str) -> Process {
        let (rig, links) = (format!("rigs/{name}.toml"), format!("mock-{name}"));
        let args = ["rig", "--config", &rig, "--link-dir", &links];
        let mut mock = Process::start("tactus-mock", self.folder.path(), &args);
        mock.wait_for("stage");
        mock
    }

    /// Kills the devices of a rig, and takes their links away: the system gives the number of a terminal that is gone to the next one, which
    /// may be another test's.
    fn kill(&self, name: &str, mock: &mut Process) {
        mock.kill();
        for link in fs::read_dir(self.folder.path().join(format!("mock-{name}"))).unwrap() {
            fs::remove_file(link.unwrap().path()).unwrap();
        }
    }

    fn serve(&self) -> Process {
        Process::start("tactusd", self.folder.path(), &["--config", "tactusd.toml"])
    }

    fn tactus(&self, args: &[&str]) -> CommandOutput {
        tactus(self.folder.path(), &[&["--endpoint", &self.endpoint], args].concat())
    }

    fn client(&self, runtime: &Runtime, rig: &str) -> Client {
        let endpoint: Endpoint = self.endpoint.parse().unwrap();
        within(runtime, Client::connect(&endpoint, Some(rig))).unwrap()
    }

    /// The rig in the table of `status`.
    fn status(&self, rig: &str) -> Value {
        let said = self.tactus(&["status", "--json"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        let rigs = said.json();
        let of = |one: &&Value| one["rig"] == rig;
        rigs["rigs"].as_array().unwrap().iter().find(of).unwrap_or_else(|| panic!("no {rig}: {rigs}")).clone()
    }
}

/// The simulated rig, which needs no device, under another name.
fn simulated(name: &str) -> String {
    let rig = fs::read_to_string(repository("config/rigs/sim.toml")).unwrap();
    rig.replace("name = \"sim\"", &format!("name = \"{name}\""))
}

async fn frames(subscription: &mut Subscription<pb::Frame>, count: usize) -> Vec<u64> {
    let mut seen = Vec::new();
    while seen.len() < count {
        let frame = subscription.recv().await.expect("frames flow");
        assert_eq!(frame.lost_before, 0);
        seen.push(frame.seq);
    }
    seen
}

fn recorded(recordings: &Path) -> Vec<u64> {
    let runs: Vec<_> = fs::read_dir(recordings).unwrap().map(|run| run.unwrap().path()).collect();
    let run = runs.iter().find(|run| run.is_dir()).unwrap_or_else(|| panic!("{runs:?}"));
    let entries = tactus_record::read(run.join("recording.mcap")).unwrap();
    let frame = |entry| match entry {
        Entry::Message { message: Message::Frame(frame), .. } => Some(frame.seq),
        Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => None,
    };
    entries.filter_map(|entry| frame(entry.unwrap())).collect()
}

#[track_caller]
fn assert_unbroken(seqs: &[u64]) {
    assert!(seqs.len() > FRAMES, "{seqs:?}");
    assert!(seqs.windows(2).all(|pair| pair[1] == pair[0] + 1), "{seqs:?}");
}

#[test]
fn devices_that_die_harm_no_other_rig_and_are_found_again() {
    let lab = Lab::new();
    for name in ["left", "middle", "right"] {
        lab.add(name);
    }
    let (_left, mut middle, _right) = (lab.mock("left"), lab.mock("middle"), lab.mock("right"));
    let mut daemon = lab.serve();
    for _ in 0..3 {
        daemon.wait_for("ready: frames flow");
    }

    // Who names no rig is told which there are, and how to name one.
    let said = lab.tactus(&["pause"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("left, middle, right") && said.err.contains("pause --rig left`"), "{said:?}");

    let script = lab.folder.path().join("reads.star");
    fs::write(&script, READS).unwrap();
    let running = ["left", "right"].map(|rig| {
        let reset = lab.tactus(&["reset", "--rig", rig]);
        assert_eq!(reset.code, Some(0), "{reset:?}");
        let args = ["--endpoint", &lab.endpoint, "run", "reads.star", "--rig", rig, "--no-report"];
        let run = Process::start("tactus", lab.folder.path(), &args);
        daemon.wait_for("run accepted");
        run
    });
    let runtime = Runtime::new().unwrap();
    let clients = ["left", "right", "middle"].map(|rig| lab.client(&runtime, rig));
    let [mut left, mut right] = [&clients[0], &clients[1]]
        .map(|client| within(&runtime, client.subscribe::<pb::Frame>(History::None)).unwrap());
    let mut seen = [&mut left, &mut right].map(|frames_of| within(&runtime, frames(frames_of, FRAMES)));

    lab.kill("middle", &mut middle);
    daemon.wait_until(|line| line.contains("rig{name=\"middle\"}") && line.contains("sensor lost"));
    for (seqs, frames_of) in seen.iter_mut().zip([&mut left, &mut right]) {
        seqs.extend(within(&runtime, frames(frames_of, FRAMES)));
        assert_unbroken(seqs);
    }
    let missed = "sensor and stage do not answer";
    until("both devices are missed", || (lab.status("middle")["problem"] == missed).then_some(()));
    assert_eq!(lab.status("left")["problem"], Value::Null);
    let table = lab.tactus(&["status"]);
    assert!(table.out.contains("middle  OFF") && table.out.contains("left    running"), "{table:?}");
    for run in running {
        let (code, said) = run.wait();
        assert_eq!(code, Some(0), "{said}");
    }
    for rig in ["left", "right"] {
        assert_unbroken(&recorded(&lab.folder.path().join("runs").join(rig)));
    }

    // It is tried again until it is there.
    let _middle = lab.mock("middle");
    let mut health = within(&runtime, clients[2].subscribe::<pb::Health>(History::None)).unwrap();
    within(&runtime, async { while !health.recv().await.expect("the service tells").problem.is_empty() {} });

    // A stop without a name is for all of them.
    let stopped = lab.tactus(&["stop", "--json"]);
    assert_eq!((stopped.code, stopped.out.lines().count()), (Some(0), 3), "{stopped:?}");
    daemon.signal(rustix::process::Signal::TERM);
    let (code, said) = daemon.wait();
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_full_disk_of_one_rig_fails_its_run_and_no_frame_of_the_other_is_lost() {
    let lab = Lab::new();
    let runs = lab.folder.path().join("runs");
    let Some(disk) = SmallDisk::mount(runs.join("left")) else {
        return eprintln!("not tested: this user may not mount a disk");
    };
    let _mocks = ["left", "right"].map(|name| {
        lab.add(name);
        lab.mock(name)
    });
    let mut daemon = lab.serve();
    for _ in 0..2 {
        daemon.wait_for("ready: frames flow");
    }
    fs::write(lab.folder.path().join("reads.star"), READS_ON).unwrap();
    let [left_run, _right_run] = ["left", "right"].map(|rig| {
        let reset = lab.tactus(&["reset", "--rig", rig]);
        assert_eq!(reset.code, Some(0), "{reset:?}");
        let args = ["--endpoint", &lab.endpoint, "run", "reads.star", "--rig", rig, "--no-report"];
        let run = Process::start("tactus", lab.folder.path(), &args);
        daemon.wait_for("run accepted");
        run
    });
    let runtime = Runtime::new().unwrap();
    let right = lab.client(&runtime, "right");
    let mut frames_of = within(&runtime, right.subscribe::<pb::Frame>(History::None)).unwrap();
    let mut seen = within(&runtime, frames(&mut frames_of, FRAMES));

    let fill = disk.fill();
    let (code, said) = left_run.wait();
    assert!(code == Some(1) && said.contains("No space left"), "{code:?}: {said}");
    assert_eq!(lab.status("right")["problem"], Value::Null);
    seen.extend(within(&runtime, frames(&mut frames_of, FRAMES)));
    assert_unbroken(&seen);
    let stopped = lab.tactus(&["stop", "--rig", "right"]);
    assert_eq!(stopped.code, Some(0), "{stopped:?}");
    until("the run is over", || (lab.status("right")["run"]["phase"] == "finished").then_some(()));
    let right = recorded(&runs.join("right"));
    assert_unbroken(&right);
    assert!(seen.iter().all(|seq| right.contains(seq)), "{seen:?} are not all in {right:?}");

    // What the left one has is whole up to the failure, and with room it records again.
    assert_unbroken(&recorded(&runs.join("left")));
    fs::remove_file(fill).unwrap();
    fs::write(lab.folder.path().join("reads.star"), "def run(rig):\n    tare()\n").unwrap();
    let again = lab.tactus(&["run", "reads.star", "--rig", "left", "--no-report"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    daemon.signal(rustix::process::Signal::TERM);
    let (code, said) = daemon.wait();
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_rig_file_that_cannot_be_used_is_named_and_served_once_it_is_right() {
    let lab = Lab::new();
    lab.write("good.toml", &simulated("good"));
    let broken = simulated("broken").replace("rows = 6", "rows = six");
    let line = 1 + broken.lines().position(|line| line.contains("six")).unwrap();
    lab.write("broken.toml", &broken);
    for file in ["one.toml", "other.toml"] {
        lab.write(file, &simulated("twin"));
    }
    for name in ["thief", "victim"] {
        let port = "transport = { kind = \"serial\", path = \"shared/port\", baud = 115200 }";
        let rig = simulated(name).replacen("transport = { kind = \"embedded\" }", port, 1);
        lab.write(&format!("{name}.toml"), &rig);
    }
    let wanted = [
        ("broken", vec!["rigs/broken.toml".to_owned(), format!("line {line}")]),
        ("twin", vec!["rigs/one.toml".to_owned(), "rigs/other.toml".to_owned(), "one name".to_owned()]),
        (
            "thief",
            vec!["rigs/thief.toml".to_owned(), "rigs/victim.toml".to_owned(), "shared/port".to_owned()],
        ),
        (
            "victim",
            vec!["rigs/thief.toml".to_owned(), "rigs/victim.toml".to_owned(), "one device".to_owned()],
        ),
    ];
    for args in [["validate", "rigs"], ["validate", "tactusd.toml"]] {
        let checked = lab.tactus(&args);
        assert_eq!(checked.code, Some(1), "{checked:?}");
        let missing = wanted.iter().flat_map(|(_, words)| words).find(|words| !checked.err.contains(*words));
        assert_eq!(missing, None, "{checked:?}");
    }
    let devices = lab.tactus(&["devices", "--config", "tactusd.toml"]);
    assert!(devices.err.contains("rigs/broken.toml") && devices.err.contains("one name"), "{devices:?}");

    let mut daemon = lab.serve();
    daemon.wait_for("ready: frames flow");
    assert_eq!(lab.status("good")["problem"], Value::Null);
    for (rig, words) in &wanted {
        let status = lab.status(rig);
        let problem = status["problem"].as_str().unwrap();
        assert!(words.iter().all(|words| problem.contains(words)), "{problem}");
    }
    let refused = lab.tactus(&["reset", "--rig", "broken"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.err.contains("rigs/broken.toml"), "{refused:?}");

    lab.write("broken.toml", &simulated("broken"));
    daemon.wait_until(|line| line.contains("broken") && line.contains("ready: frames flow"));
    assert_eq!(lab.status("broken")["problem"], Value::Null);
    daemon.signal(rustix::process::Signal::TERM);
    let (code, said) = daemon.wait();
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_service_of_which_no_rig_can_be_served_does_not_start() {
    let lab = Lab::new();
    lab.write("one.toml", &simulated("twin"));
    lab.write("other.toml", &simulated("twin"));
    let (code, said) = lab.serve().wait();
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("rigs/one.toml") && said.contains("rigs/other.toml"), "{said}");
}
