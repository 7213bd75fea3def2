//! Stopping.

use super::{homed, moving};

#[test]
fn stop_holds_then_flushes_at_a_stand_and_keeps_the_position() {
    moving(
        "1008 * stop
        1008 > !
        1015 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1015 = Moving 1.400 1.000 5.000
        1015 > ?
        1030 < <Hold:1|MPos:1.500,1.000,5.000|FS:300,0>
        1030 = Hold 1.500 1.000 5.000
        1035 > ?
        1075 < <Hold:0|MPos:1.520,1.000,5.000|FS:0,0>
        1075 = Hold 1.520 1.000 5.000
        1075 > ^X
        1090 < Grbl 1.1h ['$' for help]
        1090 > ?
        1100 < <Idle|MPos:1.520,1.000,5.000|FS:0,0|WCO:0.000,0.000,0.000>
        1100 = Idle 1.520 1.000 5.000
        1100 = stopped 1.520 1.000 5.000
        1110 * move 1.52 1 6 at 10
        1110 > ?
        1115 < <Idle|MPos:1.520,1.000,5.000|FS:0,0>
        1115 = Idle 1.520 1.000 5.000
        1115 > G91G21G94G1F600
        1116 < ok
        1116 > $G
        1117 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        1117 < ok
        1117 > G53X1.52Y1Z6",
    );
}

#[test]
fn a_second_stop_changes_nothing() {
    moving(
        "1008 * stop
        1008 > !
        1009 * stop
        1009 > !
        1015 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1015 = Moving 1.400 1.000 5.000
        1015 > ?
        1030 < <Hold:0|MPos:1.500,1.000,5.000|FS:0,0>
        1030 = Hold 1.500 1.000 5.000
        1030 > ^X
        1031 * stop
        1090 < Grbl 1.1h ['$' for help]
        1090 > ?
        1100 < <Idle|MPos:1.500,1.000,5.000|FS:0,0>
        1100 = Idle 1.500 1.000 5.000
        1100 = stopped 1.500 1.000 5.000",
    );
}

#[test]
fn a_stage_that_stands_elsewhere_after_the_reset_must_be_homed() {
    moving(
        "1006 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1006 = Moving 1.400 1.000 5.000
        1008 * stop
        1008 > !
        1008 > ?
        1030 < <Hold:0|MPos:1.500,1.000,5.000|FS:0,0>
        1030 = Hold 1.500 1.000 5.000
        1030 > ^X
        1090 < Grbl 1.1h ['$' for help]
        1090 > ?
        1100 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        1100 = Unhomed 0.000 0.000 0.000
        1100 = stopped 0.000 0.000 0.000
        1110 * move 1 1 6 at 10
        1110 = unhomed",
    );
}

#[test]
fn a_reset_that_raises_an_alarm_leaves_the_position_suspect() {
    moving(
        "1006 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1006 = Moving 1.400 1.000 5.000
        1008 * stop
        1008 > !
        1008 > ?
        1030 < <Hold:0|MPos:1.500,1.000,5.000|FS:0,0>
        1030 = Hold 1.500 1.000 5.000
        1030 > ^X
        1035 < ALARM:3
        1035 = Alarm 3 1.500 1.000 5.000
        1040 < Grbl 1.1h ['$' for help]
        1040 > ?
        1050 < <Alarm|MPos:1.500,1.000,5.000|FS:0,0>
        1050 = Alarm 3 1.500 1.000 5.000
        1050 = stopped 1.500 1.000 5.000
        1060 * move 1.5 1 6 at 10
        1060 = alarm 3",
    );
}

#[test]
fn a_line_that_waits_in_the_controller_is_flushed_by_a_stop() {
    homed(
        "950 * move 2 1 5 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X2Y1Z5
        951 * stop
        951 > !
        951 > ?
        960 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Idle 1.000 1.000 5.000
        960 > ^X
        970 < Grbl 1.1h ['$' for help]
        970 > ?
        980 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        980 = Idle 1.000 1.000 5.000
        980 = stopped 1.000 1.000 5.000",
    );
}

#[test]
fn a_stage_that_moves_on_is_told_again_to_hold() {
    moving(
        "1006 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1006 = Moving 1.400 1.000 5.000
        1008 * stop
        1008 > !
        1008 > ?
        1010 < <Run|MPos:1.500,1.000,5.000|FS:600,0>
        1010 = Moving 1.500 1.000 5.000
        1010 > !
        1028 > ?
        1278 > !
        1278 > ?",
    );
}

#[test]
fn a_hold_that_never_completes_ends_in_a_reset_and_an_unknown_position() {
    moving(
        "1006 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1006 = Moving 1.400 1.000 5.000
        1008 * stop
        1008 > !
        1008 > ?
        ...
        2900 < <Hold:1|MPos:1.500,1.000,5.000|FS:600,0>
        2900 = Hold 1.500 1.000 5.000
        2900 > ?
        ...
        4008 > ^X
        4020 < Grbl 1.1h ['$' for help]
        4020 > ?
        4030 < <Idle|MPos:1.500,1.000,5.000|FS:0,0>
        4030 = Unhomed 1.500 1.000 5.000
        4030 = stopped 1.500 1.000 5.000",
    );
}

#[test]
fn stop_while_standing_leaves_the_stage_ready() {
    homed(
        "950 * stop
        950 > !
        950 > ?
        960 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Hold 1.000 1.000 5.000
        960 > ^X
        970 < Grbl 1.1h ['$' for help]
        970 > ?
        980 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        980 = Idle 1.000 1.000 5.000
        990 * move 1 1 6 at 10
        990 > ?
        995 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        995 = Idle 1.000 1.000 5.000
        995 > G91G21G94G1F600
        996 < ok
        996 > $G
        997 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        997 < ok
        997 > G53X1Y1Z6",
    );
}

#[test]
fn homing_is_stopped_by_a_reset() {
    homed(
        "950 * home
        950 > $H
        950 = Homing 1.000 1.000 5.000
        1000 * stop
        1000 > ^X
        1005 < ALARM:6
        1005 = Alarm 6 1.000 1.000 5.000
        1010 < Grbl 1.1h ['$' for help]
        1010 > ?
        1020 < <Alarm|MPos:1.000,1.000,5.000|FS:0,0>
        1020 = Alarm 6 1.000 1.000 5.000
        1020 = stopped 1.000 1.000 5.000",
    );
}

#[test]
fn a_stage_that_says_even_after_the_reset_that_it_moves_is_not_waited_for() {
    moving(
        "1006 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1006 = Moving 1.400 1.000 5.000
        1008 * stop
        1008 > !
        1008 > ?
        ...
        2900 < <Run|MPos:1.500,1.000,5.000|FS:600,0>
        2900 = Moving 1.500 1.000 5.000
        2900 > !
        2900 > ?
        ...
        4008 > ^X
        4020 < Grbl 1.1h ['$' for help]
        4020 > ?
        4030 < <Run|MPos:1.500,1.000,5.000|FS:0,0>
        4030 = Moving 1.500 1.000 5.000
        4030 = stopped 1.500 1.000 5.000
        4035 * move 1 1 6 at 10
        4035 = unhomed",
    );
}

#[test]
fn a_jog_of_someone_else_is_stopped_too() {
    homed(
        "1000 > ?
        1010 < <Jog|MPos:1.100,1.000,5.000|FS:600,0>
        1010 = Moving 1.100 1.000 5.000
        1020 * stop
        1020 > !
        1020 > ?
        1030 < <Jog|MPos:1.200,1.000,5.000|FS:100,0>
        1030 = Moving 1.200 1.000 5.000
        1030 > !
        1040 > ?
        1080 < <Idle|MPos:1.210,1.000,5.000|FS:0,0>
        1080 = Idle 1.210 1.000 5.000
        1080 > ^X
        1090 < Grbl 1.1h ['$' for help]
        1090 > ?
        1100 < <Idle|MPos:1.210,1.000,5.000|FS:0,0>
        1100 = Idle 1.210 1.000 5.000",
    );
}

#[test]
fn a_controller_that_is_in_a_hold_after_the_reset_is_freed() {
    // The guard of the driver wrote a stop after the reset.
    moving(
        "1008 * stop
        1008 > !
        1015 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1015 = Moving 1.400 1.000 5.000
        1015 > ?
        1030 < <Hold:0|MPos:1.500,1.000,5.000|FS:0,0>
        1030 = Hold 1.500 1.000 5.000
        1030 > ^X
        1040 < Grbl 1.1h ['$' for help]
        1040 > ?
        1050 < <Hold:0|MPos:1.500,1.000,5.000|FS:0,0>
        1050 = Hold 1.500 1.000 5.000
        1050 > ^X
        1060 < Grbl 1.1h ['$' for help]
        1060 > ?
        1070 < <Idle|MPos:1.500,1.000,5.000|FS:0,0>
        1070 = Idle 1.500 1.000 5.000
        1070 = stopped 1.500 1.000 5.000
        1080 * move 1.5 1 6 at 10
        1080 > ?",
    );
}

#[test]
fn a_controller_that_decelerates_after_the_reset_is_awaited_then_freed() {
    homed(
        "950 * stop
        950 > !
        950 > ?
        960 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Hold 1.000 1.000 5.000
        960 > ^X
        970 < Grbl 1.1h ['$' for help]
        970 > ?
        980 < <Hold:1|MPos:1.000,1.000,5.000|FS:0,0>
        980 = Hold 1.000 1.000 5.000
        980 > !
        980 > ?
        990 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        990 = Hold 1.000 1.000 5.000
        990 > ^X
        1000 < Grbl 1.1h ['$' for help]
        1000 > ?
        1010 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1010 = Idle 1.000 1.000 5.000",
    );
}

#[test]
fn a_controller_that_stays_in_a_hold_is_reset_a_few_times() {
    let held = |ms: u32| {
        format!(
            "{ms} < Grbl 1.1h ['$' for help]
            {ms} > ?
            {ms} < <Door:0|MPos:1.000,1.000,5.000|FS:0,0>
            {ms} = Hold 1.000 1.000 5.000\n"
        )
    };
    let tries: String = (0..5).map(|at| held(970 + at) + &format!("{} > ^X\n", 970 + at)).collect();
    homed(&format!(
        "950 * stop
        950 > !
        950 > ?
        960 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Hold 1.000 1.000 5.000
        960 > ^X
        {tries}{}1000 * stop
        1000 > !
        1000 > ?",
        held(975)
    ));
}

#[test]
fn a_hold_after_another_reset_of_the_controller_is_ended_too() {
    homed(
        "950 < Grbl 1.1h ['$' for help]
        950 = suspect: the controller was reset: Grbl 1.1h ['$' for help]
        950 = Unhomed 1.000 1.000 5.000
        950 > ?
        960 < <Hold:0|MPos:0.000,0.000,0.000|FS:0,0>
        960 = Hold 0.000 0.000 0.000
        960 > ^X
        970 < Grbl 1.1h ['$' for help]
        970 > ?
        980 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        980 = Unhomed 0.000 0.000 0.000",
    );
}
