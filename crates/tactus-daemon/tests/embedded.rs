//! The embedded rig: production drivers and engine against virtual devices, in virtual time.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use tactus_daemon::embedded::{self, EmbeddedError, Finished, Pace, SIMULATED_RIG};
use tactus_daemon::experiments;
use tactus_daemon::order::Ask;
use tactus_plan::{Arguments, Script};
use tactus_schema::Rig;
use tactus_schema::pb::ExitStatus;
use tempfile::TempDir;

fn run(script: Script, arguments: Arguments, rig_toml: &str) -> Result<(Finished, TempDir), EmbeddedError> {
    let folder = TempDir::new().unwrap();
    let rig = Rig::from_toml(rig_toml).unwrap();
    let ask = Ask { script, arguments, seed: Some(1), who: "test".into() };
    let finished = embedded::run(&rig, rig_toml, ask, folder.path(), Pace::Virtual, |_, _| {})?;
    Ok((finished, folder))
}

#[test]
fn element_centres_presses_every_element_five_deep() {
    let script = experiments::find("element-centres", None).unwrap();
    let (Finished { outcome, recording }, _folder) =
        run(script, Arguments::default(), SIMULATED_RIG).unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    assert_eq!((outcome.presses, outcome.dwells, outcome.frames_lost), (48, 240, 0));
    assert!((outcome.travel_mm[2][0] + 0.6).abs() < 1e-9, "{:?}", outcome.travel_mm);
    assert!(recording.is_file());
}

#[test]
fn what_the_twin_refuses_leaves_nothing_behind() {
    let script = Script::parse("deep", "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.9])\n").unwrap();
    let Err(EmbeddedError::NotPossible(plan)) = run(script, Arguments::default(), SIMULATED_RIG) else {
        unreachable!("0.9 mm is deeper than the covering allows");
    };
    assert_eq!(plan.outcome.exit_status, ExitStatus::Refused);
    assert!(plan.outcome.message.contains("deep.star:2"), "{}", plan.outcome.message);
}
