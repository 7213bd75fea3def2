//! `tactus stage check`: on the embedded rig, on virtual stages at pseudo-terminals, and beside a service.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use tactus_e2e::{CommandOutput, Process, ServiceUnderTest, free_endpoint, repository, tactus, until};
use tempfile::TempDir;

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625, direction = -1, origin_microsteps = 629_921 }
";

/// A shipped rig with another protocol of its stage.
fn rig_file(folder: &Path, shipped: &str, protocol: &str) {
    let rig = fs::read_to_string(repository(shipped)).unwrap();
    fs::write(folder.join("rig.toml"), rig.replace("protocol = \"grbl\"\n", protocol)).unwrap();
}

/// A virtual rig at pseudo-terminals, without a service.
fn served(folder: &Path, protocol: &str) -> Process {
    rig_file(folder, "config/rigs/pty.toml", protocol);
    let mut mock =
        Process::start("tactus-mock", folder, &["rig", "--config", "rig.toml", "--link-dir", "mock"]);
    mock.wait_for("stage");
    mock
}

fn check(folder: &Path, args: &[&str]) -> CommandOutput {
    let endpoint = free_endpoint();
    tactus(folder, &[&["--endpoint", &endpoint, "stage", "check"], args].concat())
}

#[test]
fn a_newcomer_tries_it_on_the_embedded_rig() {
    let folder = TempDir::new().unwrap();
    let said = check(folder.path(), &["--home"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("sim (SIMULATED)") && said.out.contains("Grbl 1.1h"), "{said:?}");
    assert!(said.out.contains("$100") && said.out.contains("verdict"), "{said:?}");
    let rows = said.out.lines().filter(|line| line.ends_with("  ok")).count();
    assert_eq!(rows, 6, "{said:?}");
    let unhomed = check(folder.path(), &[]);
    assert_eq!(unhomed.code, Some(1), "{unhomed:?}");
    assert!(unhomed.out.contains("add --home"), "{unhomed:?}");
}

#[test]
fn a_rig_file_is_named_by_either_option() {
    let folder = TempDir::new().unwrap();
    rig_file(folder.path(), "config/rigs/sim.toml", ZABER);
    for option in ["--rig", "--rig-file"] {
        let said = check(folder.path(), &["--json", "--home", option, "rig.toml"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        let told = said.json();
        assert_eq!(
            (&told["ok"], &told["homed"], &told["simulated"]),
            (&true.into(), &true.into(), &true.into())
        );
        assert_eq!(told["controller"]["identity"], "device 1 firmware 7.38, device 2 firmware 7.38");
        assert_eq!(told["moves"].as_array().unwrap().len(), 6);
    }
    let said = check(folder.path(), &["--rig", "bench"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("--rig RIG.toml"), "{said:?}");
    let said = check(folder.path(), &["--rig", "nothing.toml"]);
    assert_eq!(said.code, Some(2), "{said:?}");
}

#[test]
fn a_stage_at_a_port_is_checked_when_that_is_confirmed() {
    for protocol in ["protocol = \"grbl\"\n", ZABER] {
        let folder = TempDir::new().unwrap();
        let mut mock = served(folder.path(), protocol);
        let unasked = check(folder.path(), &["--rig", "rig.toml", "--home"]);
        assert_eq!(unasked.code, Some(1), "{unasked:?}");
        assert!(unasked.err.contains("nothing was moved") && unasked.err.contains("--yes"), "{unasked:?}");
        let said = check(folder.path(), &["--rig", "rig.toml", "--home", "--yes", "--json"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        let told = said.json();
        assert!(told["stage"].as_str().unwrap().contains("on mock/stage, 115200 baud"), "{told}");
        let moves = told["moves"].as_array().unwrap();
        assert_eq!(moves.len(), 6);
        assert!(moves.iter().all(|one| one["ok"] == true && one["took_ms"].as_f64().unwrap() > 0.0));

        mock.type_line("stage ignore-moves");
        mock.wait_for("ok");
        let said = check(folder.path(), &["--rig", "rig.toml", "--home", "--yes"]);
        assert_eq!(said.code, Some(1), "{said:?}");
        assert!(said.out.contains("has arrived at") && said.out.contains("not good"), "{said:?}");
    }
}

#[test]
fn another_controller_than_the_rigs_and_no_controller_are_told() {
    let folder = TempDir::new().unwrap();
    let _mock = served(folder.path(), "protocol = \"grbl\"\n");
    let rig = fs::read_to_string(folder.path().join("rig.toml")).unwrap();
    let other =
        rig.replace("protocol = \"grbl\"\n", "protocol = \"grbl\"\naxes.z = { steps_per_mm = 80.0 }\n");
    fs::write(folder.path().join("other.toml"), other).unwrap();
    let said = check(folder.path(), &["--rig", "other.toml", "--home", "--yes"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.out.contains("$102 = 1000.000") && said.out.contains("80 steps/mm"), "{said:?}");

    fs::write(folder.path().join("gone.toml"), rig.replace("mock/stage", "mock/nothing")).unwrap();
    let said = check(folder.path(), &["--rig", "gone.toml", "--yes"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.out.contains("there is no such port"), "{said:?}");
}

#[test]
fn a_stage_that_the_service_holds_is_left_alone() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let said = lab.tactus(&["stage", "check", "--rig", "rig.toml", "--home", "--yes"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.err.contains("busy") && said.err.contains("systemctl stop tactusd"), "{said:?}");
    // A service at another endpoint is not found, but its lock on the port is.
    let said = check(lab.folder.path(), &["--rig", "rig.toml", "--home", "--yes"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.out.contains("another program holds the port"), "{said:?}");
}

#[test]
fn a_folder_of_links_belongs_to_one_virtual_rig() {
    let folder = TempDir::new().unwrap();
    let _first = served(folder.path(), "protocol = \"grbl\"\n");
    let links = ["sensor", "stage"].map(|link| folder.path().join("mock").join(link));
    let before = links.clone().map(|link| fs::read_link(link).unwrap());
    let args = ["rig", "--config", "rig.toml", "--link-dir", "mock"];
    let (code, said) = Process::start("tactus-mock", folder.path(), &args).wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("another virtual rig has its links in mock") && said.contains("--link-dir"),
        "{said}"
    );
    assert_eq!(links.map(|link| fs::read_link(link).unwrap()), before);
}

#[test]
fn a_service_of_another_rig_holds_another_stage() {
    let folder = TempDir::new().unwrap();
    let _mock = served(folder.path(), "protocol = \"grbl\"\n");
    // It is never ready, because its devices do not exist; a service that is not ready lists no rig.
    let rig = fs::read_to_string(repository("config/rigs/pty.toml")).unwrap();
    let other = rig.replace("\"mock/", "\"none/").replace("name = \"bench\"", "name = \"other\"");
    fs::write(folder.path().join("other.toml"), other).unwrap();
    let endpoint = free_endpoint();
    let config = format!("rig = \"other.toml\"\nrecordings = \"runs\"\n[bus]\nlisten = [\"{endpoint}\"]\n");
    fs::write(folder.path().join("tactusd.toml"), config).unwrap();
    let mut daemon = Process::start("tactusd", folder.path(), &["--config", "tactusd.toml"]);
    daemon.wait_for("tactusd starts");
    // It answers soon after that line.
    let status = ["--endpoint", &endpoint, "--rig", "other", "status"];
    until("an answer", || (tactus(folder.path(), &status).code == Some(0)).then_some(()));
    let check = ["--endpoint", &endpoint, "stage", "check", "--rig", "rig.toml", "--home", "--yes"];
    let said = tactus(folder.path(), &check);
    assert_eq!(said.code, Some(0), "{said:?}");

    // Who names a rig that is not served learns at once which are.
    let said = tactus(folder.path(), &["--endpoint", &endpoint, "--rig", "nosuch", "status"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("no rig \"nosuch\" at") && said.err.contains("there is: other"), "{said:?}");
}

#[test]
fn a_service_presses_with_a_stage_that_speaks_zaber() {
    let lab = ServiceUnderTest::start(|rig| rig.replace("protocol = \"grbl\"\n", ZABER));
    let script = lab.script(
        "presses.star",
        "def run(rig):\n    tare()\n    for x in (5.0, 9.0):\n        press(x, 5.0, depths_mm = [0.2, 0.4])\n",
    );
    let said = lab.tactus(&["--json", "run", &script, "--no-report"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(said.json()["dwells"], 4);
}
