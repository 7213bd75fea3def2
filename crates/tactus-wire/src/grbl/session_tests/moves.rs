//! When a move is done, and when it is not.

use super::{homed, moving};
use crate::stage::Session as _;

#[test]
fn a_move_is_done_when_idle_at_the_target() {
    moving(
        "1020 < <Run|MPos:5.000,1.000,5.000|FS:600,0>
        1020 = Moving 5.000 1.000 5.000
        1055 > ?
        1120 < <Idle|MPos:10.998,1.003,5.000|FS:0,0>
        1120 = Idle 10.998 1.003 5.000
        1120 = done 10.998 1.003 5.000
        1155 > ?",
    );
}

#[test]
fn a_report_asked_for_before_the_ok_proves_nothing() {
    // The stage stands within tolerance of the target already; the report is of before the move.
    homed(
        "1000 > ?
        1005 * move 1.004 1 5 at 1
        1005 > G90 G21 G1 X1.004 Y1.000 Z5.000 F60.000
        1010 < ok
        1030 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1030 = Idle 1.000 1.000 5.000
        1030 > ?
        1040 < <Idle|MPos:1.003,1.000,5.000|FS:0,0>
        1040 = Idle 1.003 1.000 5.000
        1040 = done 1.003 1.000 5.000",
    );
}

#[test]
fn a_late_report_is_not_taken_for_the_answer_to_the_later_question() {
    homed(
        "1000 > ?
        1100 * move 1.004 1 5 at 1
        1100 > G90 G21 G1 X1.004 Y1.000 Z5.000 F60.000
        1110 < ok
        1250 > ?
        1255 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1255 = Idle 1.000 1.000 5.000
        1260 < <Idle|MPos:1.003,1.000,5.000|FS:0,0>
        1260 = Idle 1.003 1.000 5.000
        1300 > ?
        1310 < <Idle|MPos:1.003,1.000,5.000|FS:0,0>
        1310 = Idle 1.003 1.000 5.000
        1310 = done 1.003 1.000 5.000",
    );
}

#[test]
fn idle_right_after_the_ok_is_not_yet_the_end() {
    homed(
        "950 * move 2 1 5 at 10
        950 > G90 G21 G1 X2.000 Y1.000 Z5.000 F600.000
        955 < ok
        955 > ?
        960 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Idle 1.000 1.000 5.000
        1005 > ?
        1010 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1010 = Moving 1.400 1.000 5.000
        1055 > ?
        1060 < <Idle|MPos:2.000,1.000,5.000|FS:0,0>
        1060 = Idle 2.000 1.000 5.000
        1060 = done 2.000 1.000 5.000",
    );
}

#[test]
fn idle_elsewhere_is_not_there() {
    moving(
        "1010 < <Idle|MPos:10.990,1.000,5.000|FS:0,0>
        1010 = Idle 10.990 1.000 5.000
        1055 > ?
        1110 < <Idle|MPos:10.990,1.000,5.000|FS:0,0>
        1110 = Idle 10.990 1.000 5.000
        1110 > ?
        1210 < <Idle|MPos:10.990,1.000,5.000|FS:0,0>
        1210 = Idle 10.990 1.000 5.000
        1210 = not at 11.000 1.000 5.000 but at 10.990 1.000 5.000
        1210 > ?",
    );
}

#[test]
fn an_overdue_move_is_stopped_and_told() {
    // 10 mm at 10 mm/s: twice one second and two more after it was sent at 950 ms.
    moving(
        "1010 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1010 = Moving 1.400 1.000 5.000
        ...
        2950 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        2950 = Moving 1.400 1.000 5.000
        ...
        4900 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        4900 = Moving 1.400 1.000 5.000
        4900 > ?
        4910 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        4910 = Moving 1.400 1.000 5.000
        4950 > !
        4950 > ?
        4960 < <Hold:0|MPos:1.400,1.000,5.000|FS:0,0>
        4960 = Hold 1.400 1.000 5.000
        4960 > ^X
        4970 < Grbl 1.1h ['$' for help]
        4970 > ?
        4980 < <Idle|MPos:1.400,1.000,5.000|FS:0,0>
        4980 = Idle 1.400 1.000 5.000
        4980 = overdue after 4000 ms at 1.400 1.000 5.000",
    );
}

#[test]
fn a_lost_ok_is_an_overdue_move() {
    homed(
        "950 * move 1 1 5.1 at 10
        950 > G90 G21 G1 X1.000 Y1.000 Z5.100 F600.000
        ...
        1950 < <Idle|MPos:1.000,1.000,5.100|FS:0,0>
        1950 = Idle 1.000 1.000 5.100
        ...
        2970 > !
        ...
        2980 < <Idle|MPos:1.000,1.000,5.100|FS:0,0>
        2980 = Idle 1.000 1.000 5.100
        ...",
    );
}

#[test]
fn a_refused_move_is_told_in_words() {
    homed(
        "950 * move 2 1 5 at 10
        950 > G90 G21 G1 X2.000 Y1.000 Z5.000 F600.000
        960 < error:9
        960 = Idle 1.000 1.000 5.000
        960 = refused error 9: locked by an alarm or a jog",
    );
}

#[test]
fn commands_that_cannot_be_done_are_refused_before_anything_is_sent() {
    homed(
        "950 * move nan 1 5 at 10
        950 = refused the target is not finite
        951 * move 2 1 5 at 0
        951 = refused the speed is too low or not a number
        952 * move 2 1 5 at -1
        952 = refused the speed is too low or not a number
        953 * move 2 1 5 at 10
        953 > G90 G21 G1 X2.000 Y1.000 Z5.000 F600.000
        954 * home
        954 = refused another command is under way",
    );
}

#[test]
fn a_move_to_where_the_stage_stands_becomes_a_look() {
    homed(
        "950 * move 1.0004 1 5 at 10
        950 > ?
        955 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        955 = Idle 1.000 1.000 5.000
        955 > ?
        960 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Idle 1.000 1.000 5.000
        960 = done 1.000 1.000 5.000
        961 * move 1 1 4.9994 at 0.5
        961 > G90 G21 G1 X1.000 Y1.000 Z4.999 F30.000",
    );
}

#[test]
fn a_target_is_rounded_to_the_three_decimals_that_the_controller_knows() {
    homed(
        "950 * move 1.50049 1 -0.0004 at 10
        950 > G90 G21 G1 X1.500 Y1.000 Z0.000 F600.000
        955 < ok
        955 > ?
        960 < <Idle|MPos:1.500,1.000,0.000|FS:0,0>
        960 = Idle 1.500 1.000 0.000
        960 = done 1.500 1.000 0.000",
    );
}

#[test]
fn a_probing_that_someone_else_made_is_passed_over() {
    let session = homed(
        "950 < [PRB:1.000,2.000,-0.250:1]
        960 * move 1 1 6 at 10
        960 > G90 G21 G1 X1.000 Y1.000 Z6.000 F600.000",
    );
    assert_eq!(session.unknown_lines(), 0);
}
