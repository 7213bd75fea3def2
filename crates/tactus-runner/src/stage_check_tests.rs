use std::time::Duration;

use tactus_schema::Rig;

use super::{CheckedMove, StageCheck, run};
use crate::embedded::SIMULATED_RIG;

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625, direction = -1 }
";

const STAGES: [&str; 2] = ["protocol = \"grbl\"\n", ZABER];

/// A check of the simulated rig with such a stage, with faults from the start.
fn check(lines: &str, home: bool, faults: &[&str]) -> StageCheck {
    let rig = Rig::from_toml(&SIMULATED_RIG.replace("protocol = \"grbl\"\n", lines)).unwrap();
    run(&rig, home, |control| {
        for fault in faults {
            control.inject(fault.parse().unwrap()).unwrap();
        }
    })
    .unwrap()
}

#[test]
fn a_good_stage_moves_each_axis_there_and_back() {
    for lines in STAGES {
        let checked = check(lines, true, &[]);
        assert!(checked.is_good() && checked.is_homed, "{checked:?}");
        assert!(checked.controller.is_some());
        let axes: Vec<_> = checked.moves.iter().map(|one| one.axis).collect();
        assert_eq!(axes, ["x", "x", "y", "y", "z", "z"]);
        for pair in checked.moves.chunks(2) {
            let way_mm = pair[0].reported_mm.unwrap() - pair[1].reported_mm.unwrap();
            assert!((way_mm.abs() - 0.01).abs() < 0.0045, "{pair:?}");
        }
        assert!(checked.moves.iter().all(|one| one.error_mm.unwrap() < 0.003 && !one.took.is_zero()));
    }
}

#[test]
fn a_stage_that_is_not_homed_is_not_moved() {
    for lines in STAGES {
        let checked = check(lines, false, &[]);
        assert!(!checked.is_good() && !checked.is_homed && checked.moves.is_empty());
        assert!(checked.controller.is_some());
        assert!(checked.trouble.unwrap().contains("--home"));
    }
}

#[test]
fn a_stage_that_does_not_do_what_it_says_is_not_good() {
    for lines in STAGES {
        for (fault, trouble) in [("stage ignore-moves", "has arrived at"), ("stage refuse", "refused")] {
            let checked = check(lines, true, &[fault]);
            assert!(!checked.is_good(), "{fault}: {checked:?}");
            let told = checked.moves.iter().find_map(|one| one.trouble.clone()).unwrap();
            assert!(told.contains(trouble), "{fault}: {told}");
            assert_eq!(checked.moves.iter().filter(|one| one.reported_mm.is_none()).count(), 1);
        }
        // Also one that began before homing: the first move after it is absolute.
        let checked = check(lines, true, &["stage lie -0.05"]);
        assert!(!checked.is_good(), "{checked:?}");
        let checked = check(lines, true, &["stage homing-fails"]);
        assert!(
            checked.moves.is_empty() && checked.trouble.unwrap().starts_with("homing: the stage is in alarm")
        );
        let checked = check(lines, true, &["stage disconnect 60s"]);
        assert!(checked.controller.is_none() && checked.trouble.unwrap().contains("not plugged in"));
    }
}

#[test]
fn a_step_that_was_not_made_is_seen_even_within_the_rigs_tolerance() {
    // 50 um of tolerance: a stage that stays where it is "arrives" 10 um away.
    let wide = SIMULATED_RIG.replace("tolerance_mm = 0.005", "tolerance_mm = 0.05");
    let rig = Rig::from_toml(&wide).unwrap();
    let checked =
        run(&rig, true, |control| control.inject("stage ignore-moves".parse().unwrap()).unwrap()).unwrap();
    assert!(!checked.is_good());
    let troubles: Vec<_> = checked.moves.iter().filter_map(|one| one.trouble.as_deref()).collect();
    assert!(troubles.iter().all(|trouble| trouble.contains("it did not move")), "{troubles:?}");
    assert!(troubles.len() >= 3, "{troubles:?}");
}

#[test]
fn a_move_is_judged_by_its_axis_and_its_place() {
    let judge =
        |reached_mm| CheckedMove::judge(2, [1.0, 2.0, 3.0], [1.0, 2.0, 2.99], Duration::ZERO, Ok(reached_mm));
    assert_eq!(judge([1.0, 2.0, 2.991]).trouble, None);
    assert!(judge([1.0, 2.0, 2.996]).trouble.unwrap().contains("-4.0 um instead of -10.0 um"));
    assert!(judge([1.0, 2.0, 3.01]).trouble.unwrap().contains("or moved the wrong way"));
    let sideways = judge([1.003, 2.0, 2.99]);
    assert!((sideways.error_mm.unwrap() - 0.003).abs() < 1e-12);
}
