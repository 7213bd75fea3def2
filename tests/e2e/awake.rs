//! The lock against sleep, with a program in the place of logind's client.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::thread;

use tactus_e2e::{ServiceUnderTest, until};

const CLIENT: &str = "#!/bin/sh
echo \"$@\" >> inhibitor
cat
echo released >> inhibitor
";

#[test]
fn the_machine_is_kept_awake_during_a_run_and_only_then() {
    let mut lab = ServiceUnderTest::start(|rig| rig);
    let (bin, told) = (lab.folder.path().join("bin"), lab.folder.path().join("inhibitor"));
    let script = lab.script("short.star", "def run(rig):\n    tare()\n");

    // Nothing is there: the run does not mind.
    fs::create_dir(&bin).unwrap();
    let absent = bin.join("systemd-inhibit");
    fs::write(&absent, "no program").unwrap();
    assert_eq!(lab.tactus(&["run", &script, "--no-report"]).code, Some(0));
    lab.daemon.wait_for("the machine can go to sleep during a run");
    assert!(!told.exists());

    fs::write(&absent, CLIENT).unwrap();
    fs::set_permissions(&absent, fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(lab.tactus(&["run", &script, "--no-report"]).code, Some(0));
    let said = until("the client is released", || {
        thread::yield_now();
        fs::read_to_string(&told).ok().filter(|said| said.contains("released"))
    });
    assert_eq!(said, "--what=sleep --mode=block --who=tactusd --why=a run is in progress cat\nreleased\n");
}
