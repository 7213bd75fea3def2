//! When a move is done, and when it is not.

use super::{fed, homed, moving};
use crate::stage::Session as _;

#[test]
fn a_move_is_done_when_idle_at_the_target() {
    fed("960 * move 1.5 1 5 at 10
        960 > X.5
        965 < ok
        965 > ?
        970 < <Run|MPos:1.050,1.000,5.000|FS:600,0>
        970 = Moving 1.050 1.000 5.000
        985 > ?
        1015 < <Idle|MPos:1.498,1.003,5.000|FS:0,0>
        1015 = Idle 1.498 1.003 5.000
        1015 = done 1.498 1.003 5.000
        1085 > ?");
}

#[test]
fn a_report_asked_for_before_the_ok_proves_nothing() {
    // The stage stands within tolerance of the target already; the report is of before the move.
    homed(
        "1000 > ?
        1005 * move 1.004 1 5 at 1
        1005 > G91G21G94G1F60
        1005 < ok
        1005 > $G
        1005 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F60 S0]
        1005 < ok
        1005 > G53X1.004Y1Z5
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
        1100 > G91G21G94G1F60
        1100 < ok
        1100 > $G
        1100 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F60 S0]
        1100 < ok
        1100 > G53X1.004Y1Z5
        1100 > ?
        1110 < ok
        1200 > ?
        1255 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1255 = Idle 1.000 1.000 5.000
        1255 > ?
        1260 < <Idle|MPos:1.003,1.000,5.000|FS:0,0>
        1260 = Idle 1.003 1.000 5.000
        1275 > ?
        1310 < <Idle|MPos:1.003,1.000,5.000|FS:0,0>
        1310 = Idle 1.003 1.000 5.000
        1310 = done 1.003 1.000 5.000",
    );
}

#[test]
fn idle_right_after_the_ok_is_not_yet_the_end() {
    homed(
        "950 * move 2 1 5 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X2Y1Z5
        955 < ok
        955 > ?
        960 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Idle 1.000 1.000 5.000
        975 > ?
        1010 < <Run|MPos:1.400,1.000,5.000|FS:600,0>
        1010 = Moving 1.400 1.000 5.000
        1010 > ?
        1060 < <Idle|MPos:2.000,1.000,5.000|FS:0,0>
        1060 = Idle 2.000 1.000 5.000
        1060 = done 2.000 1.000 5.000",
    );
}

#[test]
fn idle_elsewhere_is_not_there_and_what_the_controller_holds_is_discarded() {
    moving(
        "1010 < <Idle|MPos:1.300,1.000,5.000|FS:0,0>
        1010 = Idle 1.300 1.000 5.000
        1025 > ?
        1110 < <Idle|MPos:1.300,1.000,5.000|FS:0,0>
        1110 = Idle 1.300 1.000 5.000
        1110 > ?
        1210 < <Idle|MPos:1.300,1.000,5.000|FS:0,0>
        1210 = Idle 1.300 1.000 5.000
        1210 > !
        1210 > ?
        1220 < <Hold:0|MPos:1.300,1.000,5.000|FS:0,0>
        1220 = Hold 1.300 1.000 5.000
        1220 > ^X
        1230 < Grbl 1.1h ['$' for help]
        1230 > ?
        1240 < <Idle|MPos:1.300,1.000,5.000|FS:0,0>
        1240 = Idle 1.300 1.000 5.000
        1240 = not at 11.000 1.000 5.000 but at 1.300 1.000 5.000",
    );
}

#[test]
fn an_overdue_move_is_stopped_and_told() {
    // 10 mm at 10 mm/s: twice one second and two more after it was sent at 954 ms.
    let stuck: Vec<String> = (1010..4950)
        .step_by(90)
        .map(|ms| {
            format!("{ms} < <Run|MPos:1.400,1.000,5.000|FS:600,0>\n{ms} = Moving 1.400 1.000 5.000\n...\n")
        })
        .collect();
    moving(&format!(
        "{}4954 > !
        4960 < <Hold:0|MPos:1.400,1.000,5.000|FS:0,0>
        4960 = Hold 1.400 1.000 5.000
        4960 > ?
        4965 < <Hold:0|MPos:1.400,1.000,5.000|FS:0,0>
        4965 = Hold 1.400 1.000 5.000
        4965 > ^X
        4970 < Grbl 1.1h ['$' for help]
        4970 > ?
        4980 < <Idle|MPos:1.400,1.000,5.000|FS:0,0>
        4980 = Idle 1.400 1.000 5.000
        4980 = overdue after 4000 ms at 1.400 1.000 5.000",
        stuck.concat()
    ));
}

#[test]
fn motion_and_arrival_show_that_a_line_was_accepted_whose_ok_was_lost() {
    fed("960 * move 1 1 5.1 at 10
        960 > Z.1
        1010 > ?
        1015 < <Run|MPos:1.000,1.000,5.050|FS:600,0>
        1015 = Moving 1.000 1.000 5.050
        1030 > ?
        1035 < <Idle|MPos:1.000,1.000,5.100|FS:0,0>
        1035 = Idle 1.000 1.000 5.100
        1035 = done 1.000 1.000 5.100");
}

#[test]
fn a_line_that_gets_lost_with_its_ok_is_an_overdue_move() {
    let stands: Vec<String> = (970..2990)
        .step_by(90)
        .map(|ms| {
            format!("...\n{ms} < <Idle|MPos:1.000,1.000,5.000|FS:0,0>\n{ms} = Idle 1.000 1.000 5.000\n")
        })
        .collect();
    fed(&format!(
        "960 * move 1 1 5.1 at 10
        960 > Z.1
        {}...
        2980 > !
        ...",
        stands.concat()
    ));
}

#[test]
fn the_copy_of_an_ok_starts_nothing_and_ends_nothing() {
    // Each ok comes twice: the copies answer neither `$G` nor the move.
    homed(
        "950 * move 1 1 4.9 at 1
        950 > G91G21G94G1F60
        952 < ok
        952 > $G
        952 < ok
        960 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F60 S0]
        960 < ok
        960 > G53X1Y1Z4.9
        961 < ok
        961 > ?
        966 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        966 = Idle 1.000 1.000 5.000
        970 < ok
        981 > ?
        990 < <Run|MPos:1.000,1.000,4.990|FS:60,0>
        990 = Moving 1.000 1.000 4.990
        1001 > ?
        1080 < <Idle|MPos:1.000,1.000,4.900|FS:0,0>
        1080 = Idle 1.000 1.000 4.900
        1080 = done 1.000 1.000 4.900",
    );
}

#[test]
fn a_speed_that_was_damaged_is_set_again_and_then_given_up() {
    let wrong = "[GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]";
    homed(&format!(
        "950 * move 1 1 4.9 at 1
        950 > G91G21G94G1F60
        952 < ok
        952 > $G
        954 < {wrong}
        954 > G91G21G94G1F60
        954 < ok
        954 > $G
        956 < ok
        958 < {wrong}
        958 > G91G21G94G1F60
        958 < ok
        958 > $G
        960 < ok
        962 < {wrong}
        962 > !
        962 > ?
        970 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        970 = Hold 1.000 1.000 5.000
        970 > ^X
        980 < Grbl 1.1h ['$' for help]
        980 > ?
        990 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        990 = Idle 1.000 1.000 5.000
        990 = refused the controller has understood {wrong}"
    ));
}

#[test]
fn a_speed_without_an_answer_is_set_three_times() {
    homed(
        "950 * move 1 1 4.9 at 1
        950 > G91G21G94G1F60
        1450 > G91G21G94G1F60
        1460 < ok
        1460 > $G
        1960 > G91G21G94G1F60
        2460 > !
        2460 > ?",
    );
}

#[test]
fn a_stage_off_its_way_or_too_fast_is_stopped_at_once() {
    // Sideways.
    moving(
        "1020 < <Run|MPos:1.100,1.100,5.000|FS:600,0>
        1020 = Moving 1.100 1.100 5.000
        1020 > !
        1020 > ?
        1025 < <Hold:0|MPos:1.100,1.110,5.000|FS:0,0>
        1025 = Hold 1.100 1.110 5.000
        1025 > ^X
        1030 < Grbl 1.1h ['$' for help]
        1030 > ?
        1035 < <Idle|MPos:1.100,1.110,5.000|FS:0,0>
        1035 = Idle 1.100 1.110 5.000
        1035 = astray at 1.100 1.110 5.000 on the way to 11.000 1.000 5.000",
    );
    // 1 mm in 66 ms.
    moving(
        "1020 < <Run|MPos:2.000,1.000,5.000|FS:6000,0>
        1020 = Moving 2.000 1.000 5.000
        1020 > !
        ...",
    );
    // Beyond the target: `.5` was heard as `5`.
    fed("960 * move 1 1 4.5 at 10
        960 > Z-.5
        965 < ok
        965 > ?
        970 < <Run|MPos:1.000,1.000,4.950|FS:600,0>
        970 = Moving 1.000 1.000 4.950
        985 > ?
        1020 < <Run|MPos:1.000,1.000,4.480|FS:600,0>
        1020 = Moving 1.000 1.000 4.480
        1020 > !
        ...");
}

#[test]
fn a_stage_that_moves_without_reports_is_stopped() {
    moving(
        "1105 > ?
        1205 > ?
        1305 > !
        1310 < <Hold:0|MPos:3.000,1.000,5.000|FS:0,0>
        1310 = Hold 3.000 1.000 5.000
        1310 > ?
        ...
        1610 < <Hold:0|MPos:3.000,1.000,5.000|FS:0,0>
        1610 = Hold 3.000 1.000 5.000
        1610 > ?
        1615 < <Hold:0|MPos:3.000,1.000,5.000|FS:0,0>
        1615 = Hold 3.000 1.000 5.000
        1630 > ?
        1635 < <Hold:0|MPos:3.000,1.000,5.000|FS:0,0>
        1635 = Hold 3.000 1.000 5.000
        1635 > ^X
        1645 < Grbl 1.1h ['$' for help]
        1645 > ?
        1650 < <Idle|MPos:3.000,1.000,5.000|FS:0,0>
        1650 = Idle 3.000 1.000 5.000
        1650 = unanswered for 300ms",
    );
}

#[test]
fn one_damaged_report_is_not_where_an_increment_is_counted_from() {
    fed("1032 > ?
        1040 < <Idle|MPos:1.000,1.000,9.000|FS:0,0>
        1040 = Idle 1.000 1.000 9.000
        1050 * move 1 1 4.9 at 10
        1050 > ?
        1055 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1055 = Idle 1.000 1.000 5.000
        1055 > Z-.1");
}

#[test]
fn an_axis_that_does_not_move_is_not_named() {
    fed("960 * move 1.0004 1 4.9 at 10
        960 > Z-.1");
}

#[test]
fn a_refused_move_is_told_in_words() {
    homed(
        "950 * move 2 1 5 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X2Y1Z5
        960 < error:9
        960 > !
        960 > ?
        965 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        965 = Hold 1.000 1.000 5.000
        965 > ^X
        970 < Grbl 1.1h ['$' for help]
        970 > ?
        975 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        975 = Idle 1.000 1.000 5.000
        975 = refused error 9: locked by an alarm or a jog",
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
        953 > G91G21G94G1F600
        953 < ok
        953 > $G
        953 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        953 < ok
        953 > G53X2Y1Z5
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
        961 > G91G21G94G1F30
        961 < ok
        961 > $G
        961 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F30 S0]
        961 < ok
        961 > G53X1Y1Z4.999",
    );
}

#[test]
fn the_first_move_after_homing_is_absolute_until_one_has_arrived() {
    // It goes up instead of down: where the reports say that it stands, it does not.
    homed(
        "920 * move 1 1 4 at 10
        920 > G91G21G94G1F600
        921 < ok
        921 > $G
        922 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        922 < ok
        922 > G53X1Y1Z4
        923 < ok
        923 > ?
        930 < <Run|MPos:1.000,1.000,5.010|FS:600,0>
        930 = Moving 1.000 1.000 5.010
        943 > ?
        950 < <Run|MPos:1.000,1.000,5.200|FS:600,0>
        950 = Moving 1.000 1.000 5.200
        950 > !
        950 > ?
        960 < <Hold:0|MPos:1.000,1.000,5.200|FS:0,0>
        960 = Hold 1.000 1.000 5.200
        960 > ^X
        970 < Grbl 1.1h ['$' for help]
        970 > ?
        980 < <Idle|MPos:1.000,1.000,5.200|FS:0,0>
        980 = Idle 1.000 1.000 5.200
        980 = astray at 1.000 1.000 5.200 on the way to 1.000 1.000 4.000
        990 * move 1 1 4 at 10
        990 > ?
        995 < <Idle|MPos:1.000,1.000,5.200|FS:0,0>
        995 = Idle 1.000 1.000 5.200
        995 > G91G21G94G1F600
        996 < ok
        996 > $G
        997 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        997 < ok
        997 > G53X1Y1Z4",
    );
}

#[test]
fn a_target_is_rounded_to_the_three_decimals_that_the_controller_knows() {
    homed(
        "950 * move 1.50049 1 -0.0004 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X1.5Y1Z0
        955 < ok
        955 > ?",
    );
}

#[test]
fn a_probing_that_someone_else_made_is_passed_over() {
    let session = homed(
        "950 < [PRB:1.000,2.000,-0.250:1]
        960 * move 1 1 6 at 10
        960 > G91G21G94G1F600
        960 < ok
        960 > $G
        960 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        960 < ok
        960 > G53X1Y1Z6",
    );
    assert_eq!(session.unknown_lines(), 0);
}

#[test]
fn a_stage_that_stands_elsewhere_than_it_arrived_is_told_once() {
    fed("1032 > ?
        1040 < <Idle|MPos:1.000,1.000,5.050|FS:0,0>
        1040 = Idle 1.000 1.000 5.050
        1132 > ?
        1140 < <Idle|MPos:1.000,1.000,5.050|FS:0,0>
        1140 = Idle 1.000 1.000 5.050
        1150 * move 1 1 4.9 at 10
        1150 = not at 1.000 1.000 5.000 but at 1.000 1.000 5.050
        1160 * move 1 1 6 at 10
        1160 > Z.95");
    fed("960 * look
        960 > ?
        965 < <Idle|MPos:1.000,1.000,5.050|FS:0,0>
        965 = Idle 1.000 1.000 5.050
        965 > ?
        970 < <Idle|MPos:1.000,1.000,5.050|FS:0,0>
        970 = Idle 1.000 1.000 5.050
        970 = not at 1.000 1.000 5.000 but at 1.000 1.000 5.050");
}
