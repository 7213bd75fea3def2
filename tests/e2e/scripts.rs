//! Scripts that take more than their share cost an error, never the program that runs them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};

use rustix::process::Signal;
use tactus_e2e::{ServiceUnderTest, Terminal, binary, tactus};
use tactus_plan::{
    Arguments, Call, Evaluate, Exceeded, Host, Refusal, Reply, RigView, Script, ScriptError, ScriptLimits,
    Step,
};
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::script_process::ScriptProcesses;
use tactus_schema::Rig;
use tempfile::TempDir;

/// Each of them gets around the bounds that the evaluator itself has.
const BOMBS: [(&str, &str); 4] = [
    (
        "an error message that quotes a large value",
        "x = 'y' * 60000\nfor _ in range(13):\n    x = [x, x]\n[1].index(x)",
    ),
    (
        "an error message that quotes a deep value",
        "x = [0]\nfor _ in range(99999):\n    x = [x]\nfor _ in range(99999):\n    x = [x]\nfor _ in range(99999):\n    x = [x]\n[1].index(x)",
    ),
    (
        "one operation without an end",
        "a, b = [0], [0]\nfor _ in range(60):\n    a, b = [a, a], [b, b]\nlog('now')\nx = a == b",
    ),
    ("many small operations", "for _ in range(99999):\n    for _ in range(99999):\n        pass"),
];

fn script_of(body: &str) -> Script {
    let source = format!("def run(rig):\n    {}\n", body.trim().replace('\n', "\n    "));
    Script::parse("bomb", &source).unwrap()
}

/// A host that counts steps, and wants no more after some.
struct Counting {
    steps: u64,
    stops: AtomicBool,
    stops_after: u64,
}

impl Host for Counting {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        assert!(call.at.line > 1 && matches!(call.step, Step::Log { .. }));
        self.steps += 1;
        self.stops.store(self.steps >= self.stops_after, Ordering::Relaxed);
        Ok(Reply::Done)
    }

    fn cancelled(&self) -> bool {
        self.stops.load(Ordering::Relaxed)
    }
}

fn execute(body: &str, limits: &ScriptLimits, stops_after: u64) -> (Result<(), ScriptError>, u64) {
    let mut host = Counting { steps: 0, stops: AtomicBool::new(false), stops_after };
    let view = RigView::of(&Rig::from_toml(SIMULATED_RIG).unwrap());
    let processes = ScriptProcesses::of(binary("tactus"));
    let ended = processes.execute(&script_of(body), &Arguments::default(), &view, 1, limits, &mut host);
    (ended.map(drop), host.steps)
}

#[test]
fn every_bomb_names_the_limit_that_it_ran_into() {
    let [memory, stack, stuck, turns] = BOMBS.map(|(_, body)| body);
    let hasty = ScriptLimits {
        think: std::time::Duration::from_millis(100),
        ticks: u64::MAX,
        ..ScriptLimits::default()
    };
    let brief = ScriptLimits {
        processor: std::time::Duration::from_secs(1),
        ticks: u64::MAX,
        ..ScriptLimits::default()
    };
    // However slow the machine is.
    let whole = ScriptLimits { think: std::time::Duration::from_hours(1), ..ScriptLimits::default() };
    for (body, limits, exceeded) in [
        (memory, &whole, Exceeded::Process(whole.process_bytes)),
        (stack, &whole, Exceeded::Stack(64 << 20)),
        (stuck, &hasty, Exceeded::Think(hasty.think)),
        (turns, &hasty, Exceeded::Think(hasty.think)),
        (turns, &brief, Exceeded::Processor(brief.processor)),
        ("for _ in range(2000):\n    log('x' * 60000)", &whole, Exceeded::Log(whole.log_bytes)),
    ] {
        match execute(body, limits, u64::MAX).0 {
            Err(ScriptError::Limit { exceeded: ended, .. }) => assert_eq!(ended, exceeded, "{body}"),
            other => panic!("{body}: {other:?}"),
        }
    }
}

#[test]
fn steps_and_their_results_go_there_and_back() {
    let (ended, steps) = execute("for n in range(500):\n    log(n)", &ScriptLimits::default(), u64::MAX);
    assert_eq!((ended, steps), (Ok(()), 500));
}

#[test]
fn a_script_is_stopped_in_the_middle_of_one_operation() {
    let [_, _, (_, stuck), _] = BOMBS;
    // Its time is not over for an hour.
    let patient = ScriptLimits { think: std::time::Duration::from_hours(1), ..ScriptLimits::default() };
    let (ended, steps) = execute(stuck, &patient, 1);
    assert!(matches!(ended, Err(ScriptError::Refused { refusal: Refusal::Stopped(_), .. })), "{ended:?}");
    assert_eq!(steps, 1);
}

#[test]
fn the_command_line_refuses_a_bomb_at_the_top_level() {
    let folder = TempDir::new().unwrap();
    let source =
        format!("def boom():\n    {}\nboom()\ndef run(rig):\n    pass\n", BOMBS[0].1.replace('\n', "\n    "));
    fs::write(folder.path().join("bomb.star"), source).unwrap();
    let said = tactus(folder.path(), &["run", "bomb.star", "--embedded"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    // A busy machine does not fill the memory within the time that a script has.
    let limits = ["the script's process needs more than 512 MiB", "the script computed for more than 10.0 s"];
    assert!(limits.iter().any(|limit| said.err.contains(limit)), "{said:?}");
}

/// Resident memory, in KiB.
fn resident_kib(lab: &ServiceUnderTest) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", lab.daemon.id())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

#[test]
fn a_service_refuses_bombs_and_stays_as_it_was() {
    let lab = ServiceUnderTest::start(|rig| rig);
    for (what, body) in [BOMBS[0], BOMBS[1]] {
        let script = lab.script("bomb.star", script_of(body).source());
        let before_kib = resident_kib(&lab);
        let said = lab.tactus(&["--json", "run", &script, "--no-report"]);
        assert_eq!(said.code, Some(1), "{what}: {said:?}");
        assert!(said.out.contains("the script's"), "{what}: {said:?}");
        assert!(resident_kib(&lab) < before_kib + (64 << 10), "{what}");
    }
    let runs = fs::read_dir(lab.folder.path().join("runs")).unwrap();
    assert_eq!(runs.count(), 0, "nothing was run");
    let script = lab.script("good.star", "def run(rig):\n    tare()\n");
    assert_eq!(lab.tactus(&["--json", "run", &script, "--no-report"]).code, Some(0));
}

#[test]
fn everybody_sees_how_far_the_dry_run_of_a_service_is() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("long.star", LONG);
    let phase = || lab.tactus(&["status", "--json"]).json()["run"]["phase"].clone();
    assert_eq!(phase(), "idle");
    let args = ["--endpoint", &lab.endpoint, "run", &script, "--no-report"];
    let mut client = Terminal::start("tactus", lab.folder.path(), &args, [100, 24]);
    client.wait_for(&["dry run ", " %", " left"]);
    assert_eq!(phase(), "preparing");
    assert_eq!(lab.tactus(&["stop", "--reason", "enough"]).code, Some(0));
    client.wait_for(&["enough"]);
    // There was no run.
    assert_eq!(phase(), "idle");
}

/// A long dry run whose script never thinks for long.
const LONG: &str = "def run(rig):\n    for _ in range(90000):\n        wait(1.0)\n";

#[test]
fn a_dry_run_is_stopped_at_once() {
    for body in [LONG, script_of(BOMBS[3].1).source()] {
        let mut lab = ServiceUnderTest::start(|rig| rig);
        let script = lab.script("long.star", body);
        let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
        lab.daemon.wait_for("the dry run begins");
        assert_eq!(lab.tactus(&["stop", "--reason", "enough"]).code, Some(0));
        let (code, said) = client.wait();
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("enough"), "{said}");

        // The end of the service does not wait for a dry run.
        let _client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
        lab.daemon.wait_for("the dry run begins");
        lab.daemon.signal(Signal::TERM);
        assert_eq!(lab.daemon.wait().0, Some(0));
    }
}
