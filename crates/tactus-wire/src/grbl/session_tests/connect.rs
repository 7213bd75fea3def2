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
fn positions_are_in_the_work_frame_once_it_is_told() {
    homed(
        "1000 > ?
        1010 < <Idle|MPos:1.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,0.000>
        1010 = Idle 1.000 1.000 5.000
        1100 > ?
        1110 < <Idle|MPos:1.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,-2.000>
        1110 = Unhomed 1.000 1.000 7.000",
    );
}

#[test]
fn a_work_frame_that_moves_under_a_move_stops_it() {
    moving(
        "1010 < <Run|MPos:2.000,1.000,5.000|FS:0,0|WCO:0.000,0.000,-2.000>
        1010 = Moving 2.000 1.000 7.000
        1010 > !
        1010 > ?
        1020 < <Hold:0|MPos:2.100,1.000,5.000|FS:0,0>
        1020 = Hold 2.100 1.000 7.000
        1020 > ^X
        1030 < Grbl 1.1h ['$' for help]
        1030 > ?
        1040 < <Idle|MPos:2.100,1.000,5.000|FS:0,0>
        1040 = Unhomed 2.100 1.000 7.000
        1040 = unhomed",
    );
}
