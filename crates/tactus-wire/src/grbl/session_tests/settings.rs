//! Whether the controller is the rig's, and how its axes lie.

use super::{HOMED, TOLERANCE_MM, check, check_with};
use crate::grbl::{Axis, Config};
use crate::stage::{AxisName, Direction, Session as _};

/// From opening the port to the query for the settings.
const ASKED: &str = "
    0 * start
    10 < Grbl 1.1h ['$' for help]
    10 > ?
    20 < <Alarm|MPos:0.000,0.000,0.000|FS:0,0>
    20 > $I
    21 < ok
    21 > $$
";

/// x is the controller's y and runs against it; z is 0 at its -30.
fn crossed() -> Config {
    let plain = Config::aligned(TOLERANCE_MM);
    let [x, y, z] = plain.axes;
    Config {
        axes: [
            Axis { machine: AxisName::Y, direction: Direction::Negative, ..x },
            Axis { machine: AxisName::X, ..y },
            Axis { origin_mm: -30.0, steps_per_mm: Some(250.0), ..z },
        ],
        ..plain
    }
}

#[test]
fn a_controller_without_homing_or_soft_limits_is_refused() {
    let session = check(&format!(
        "{ASKED}
        22 < $20=1
        22 < $22=0
        22 < ok
        22 = failed: the controller has $22 = 0, but the rig needs 1, homing on: correct the rig file, or the \
         controller's setting by its own tools; nothing was changed"
    ));
    assert_eq!(session.deadline(), None);
    check(&format!(
        "{ASKED}
        22 < $20=0
        22 < $22=1
        22 < $23=3
        22 < ok
        22 = failed: the controller has $20 = 0, but the rig needs 1, soft limits on: correct the rig file, or the \
         controller's setting by its own tools; nothing was changed"
    ));
}

#[test]
fn other_steps_than_the_rigs_are_refused_with_both_values() {
    check_with(
        crossed(),
        &format!(
            "{ASKED}
            22 < $20=1
            22 < $22=1
            22 < $23=3
            22 < $102=80.000
            22 < ok
            22 = failed: the controller has $102 = 80.000, but the rig needs 250 steps/mm of its z for the rig's z: \
             correct the rig file, or the controller's setting by its own tools; nothing was changed"
        ),
    );
}

#[test]
fn settings_that_do_not_come_are_asked_for_again_and_given_up() {
    check(&format!(
        "{ASKED}
        30 < $22=1
        30 < $23=3
        2021 > $$
        2030 < $20=1
        4021 > $$
        6021 = failed: the controller did not answer $$"
    ));
    check(&format!(
        "{ASKED}
        30 < error:8
        30 = failed: the controller refused $$: error 8, the command needs the controller to be idle"
    ));
}

#[test]
fn a_controller_that_has_no_version_to_tell_is_taken() {
    check(
        "0 * start
        10 < Grbl 1.1h ['$' for help]
        10 > ?
        20 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        20 > $I
        21 < error:3
        21 > $$
        22 < $20=1
        22 < $22=1
        22 < $23=3
        22 < ok
        22 = connected Grbl 1.1h ['$' for help]
        22 = Unhomed 0.000 0.000 0.000",
    );
}

#[test]
fn a_stop_or_a_restart_while_the_settings_are_asked_for_begins_anew() {
    check(&format!(
        "{ASKED}
        22 * stop
        22 > ^X
        30 < Grbl 1.1h ['$' for help]
        30 > ?
        40 < <Alarm|MPos:0.000,0.000,0.000|FS:0,0>
        40 > $I
        41 < Grbl 1.1h ['$' for help]
        41 > ?"
    ));
}

#[test]
fn positions_and_moves_are_in_the_stages_frame() {
    let homed = HOMED
        .replace("$100=250.000", "$102=250.000")
        // What the session tells; what the controller says stays as it is.
        .replace("= Unhomed 0.000 0.000 0.000", "= Unhomed 0.000 0.000 30.000")
        .replace("= Homing 0.000 0.000 0.000", "= Homing 0.000 0.000 30.000")
        .replace("= Homing 1.000 1.000 5.000", "= Homing -1.000 1.000 35.000")
        .replace("= Idle 1.000 1.000 5.000", "= Idle -1.000 1.000 35.000")
        .replace("= done 1.000 1.000 5.000", "= done -1.000 1.000 35.000");
    check_with(
        crossed(),
        &format!(
            "{homed}
            950 * move -11 2 1.5 at 1000
            950 > G91G21G94G1F60000
            951 < ok
            951 > $G
            952 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F60000 S0]
            952 < ok
            952 > G53X2Y11Z-28.5
            955 < ok
            955 > ?
            965 < <Run|MPos:1.250,3.500,-3.375|FS:60000,0>
            965 = Moving -3.500 1.250 26.625
            975 > ?
            1015 < <Idle|MPos:2.000,11.000,-28.500|FS:0,0>
            1015 = Idle -11.000 2.000 1.500
            1015 = done -11.000 2.000 1.500
            1020 * look
            1020 > ?
            1025 < <Idle|MPos:2.000,11.000,-28.500|FS:0,0>
            1025 = Idle -11.000 2.000 1.500
            1025 > ?
            1030 < <Idle|MPos:2.000,11.000,-28.500|FS:0,0>
            1030 = Idle -11.000 2.000 1.500
            1030 = done -11.000 2.000 1.500"
        ),
    );
}
