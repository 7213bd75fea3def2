//! Finding the controller, and listening to it.

use super::{check, homed, moving};
use crate::stage::Session as _;

#[test]
fn a_banner_that_comes_by_itself_needs_no_reset() {
    check(
        "0 * start
        120 < error:7
        150 < Grbl 1.1h ['$' for help]
        150 > ?
        151 < [MSG:'$H'|'$X' to unlock]
        180 < <Alarm|MPos:0.000,0.000,0.000|FS:0,0>
        180 > $I
        180 < ok
        180 > $$
        180 < $20=1
        180 < $22=1
        180 < $23=3
        180 < ok
        180 = connected Grbl 1.1h ['$' for help]
        180 = Unhomed 0.000 0.000 0.000
        190 * home
        190 > $H
        190 = Homing 0.000 0.000 0.000",
    );
}

#[test]
fn a_silent_port_is_reset_and_given_up_in_the_end() {
    check(
        "0 * start
        500 > ^X
        2500 > ^X
        4500 > ^X
        6500 > ^X
        8500 = failed: no banner came after 4 resets: is this a Grbl controller, and is the bit rate right?",
    );
}

#[test]
fn a_banner_of_its_own_and_the_one_asked_for() {
    check(
        "0 * start
        500 > ^X
        501 < Grbl 1.1h ['$' for help]
        501 > ?
        502 < Grbl 1.1h ['$' for help]
        502 > ?
        510 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        510 > $I
        510 < ok
        510 > $$
        510 < $20=1
        510 < $22=1
        510 < $23=3
        510 < ok
        510 = connected Grbl 1.1h ['$' for help]
        510 = Unhomed 0.000 0.000 0.000",
    );
}

#[test]
fn a_standing_stage_is_asked_ten_times_a_second() {
    homed(
        "1000 > ?
        1030 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1030 = Idle 1.000 1.000 5.000
        1100 > ?
        1160 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1160 = Idle 1.000 1.000 5.000
        1200 > ?",
    );
}

#[test]
fn a_lost_report_is_asked_for_again() {
    moving(
        "1105 > ?
        1110 < <Run|MPos:2.000,1.000,5.000|FS:600,0>
        1110 = Moving 2.000 1.000 5.000
        1125 > ?",
    );
}

#[test]
fn silence_in_motion_holds_the_stage_and_ends_the_session() {
    let session = moving(
        "1105 > ?
        1205 > ?
        1305 > !
        ...
        3205 = failed: the controller did not answer for its status",
    );
    assert_eq!(session.deadline(), None);
}

#[test]
fn noise_and_echoes_are_counted_and_passed_over() {
    let session = moving(
        "1010 < G90 G21 G1 X11.000
        1011 < <Run|MPos:1.4
        1012 < okk
        1013 < error:7
        1014 < ok
        1105 > ?
        1205 > ?",
    );
    // `error:7` and the second `ok` are answers to nothing, but they are known.
    assert_eq!(session.unknown_lines(), 3);
}

#[test]
fn positions_are_those_of_the_machine_frame_in_either_frame() {
    homed(
        "1000 > ?
        1010 < <Idle|MPos:1.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,0.000>
        1010 = Idle 1.000 1.000 5.000
        1100 > ?
        1110 < <Idle|MPos:1.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,-2.000>
        1110 = Idle 1.000 1.000 5.000
        1200 > ?
        1210 < <Idle|WPos:1.000,1.000,7.000|FS:0,0>
        1210 = Idle 1.000 1.000 5.000",
    );
}

#[test]
fn a_controller_with_another_work_frame_is_refused_before_anything_moves() {
    check(
        "0 * start
        150 < Grbl 1.1h ['$' for help]
        150 > ?
        180 < <Alarm|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,-2.000>
        180 > $I
        180 < ok
        180 > $$
        180 < $20=1
        180 < $22=1
        180 < $23=3
        180 < ok
        180 = failed: the controller's work frame is offset by 0.000 0.000 -2.000 mm (G54, G92), and it is not known which frame \
         the rig file means: clear the offset (G10 L2 P1 X0 Y0 Z0, G92.1), and give the rig file's origins in machine coordinates; \
         nothing was changed",
    );
}

#[test]
fn homing_is_not_concluded_with_another_work_frame_or_with_one_that_is_not_known() {
    homed(
        "950 * home
        950 > $H
        950 = Homing 1.000 1.000 5.000
        1300 < ok
        1300 > ?
        1310 < <Idle|MPos:1.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,-2.000>
        1310 = Homing 1.000 1.000 5.000
        1310 > ?
        1320 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1320 = Unhomed 1.000 1.000 5.000
        1320 = refused the controller's work frame is offset by 0.000 0.000 -2.000 mm (G54, G92), and it is not known which frame \
         the rig file means: clear the offset (G10 L2 P1 X0 Y0 Z0, G92.1), and give the rig file's origins in machine coordinates; \
         nothing was changed
        1330 * move 1 1 4 at 1
        1330 = unhomed",
    );
    check(
        "0 * start
        150 < Grbl 1.1h ['$' for help]
        150 > ?
        180 < <Alarm|WPos:0.000,0.000,0.000|FS:0,0>
        180 > $I
        180 < ok
        180 > $$
        180 < $20=1
        180 < $22=1
        180 < $23=3
        180 < ok
        180 = connected Grbl 1.1h ['$' for help]
        180 = Unhomed 0.000 0.000 0.000
        190 * home
        190 > $H
        190 = Homing 0.000 0.000 0.000
        200 < ok
        200 > ?
        210 < <Idle|WPos:1.000,1.000,5.000|FS:0,0>
        210 = Homing 1.000 1.000 5.000
        210 > ?
        220 < <Idle|WPos:1.000,1.000,5.000|FS:0,0>
        220 = Homing 1.000 1.000 5.000
        220 > ?
        230 < <Idle|WPos:1.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,0.000>
        230 = Idle 1.000 1.000 5.000
        230 = done 1.000 1.000 5.000",
    );
}
