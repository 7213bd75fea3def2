//! Where the stage stands, asked of the controller and never of what was known before.

use super::{homed, moving};

#[test]
fn two_reports_that_were_asked_for_after_the_look_answer_it() {
    homed(
        "950 * look
        950 > ?
        960 < <Idle|MPos:1.001,1.000,5.000|FS:0,0>
        960 = Idle 1.001 1.000 5.000
        960 > ?
        970 < <Idle|MPos:1.001,1.000,5.000|FS:0,0>
        970 = Idle 1.001 1.000 5.000
        970 = done 1.001 1.000 5.000
        1060 > ?",
    );
}

#[test]
fn a_report_asked_for_before_the_look_and_its_copy_do_not_answer_it() {
    homed(
        "1000 > ?
        1005 * look
        1010 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1010 = Idle 1.000 1.000 5.000
        1010 > ?
        1011 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1011 = Idle 1.000 1.000 5.000
        1011 > ?
        1020 < <Run|MPos:1.000,1.000,4.900|FS:60,0>
        1020 = Moving 1.000 1.000 4.900
        1020 = not idle at 1.000 1.000 4.900",
    );
}

#[test]
fn a_stage_that_someone_moves_is_not_idle() {
    homed(
        "950 * look
        950 > ?
        960 < <Jog|MPos:1.100,1.000,5.000|FS:600,0>
        960 = Moving 1.100 1.000 5.000
        960 = not idle at 1.100 1.000 5.000",
    );
    homed(
        "950 * look
        950 > ?
        960 < <Hold:0|MPos:1.100,1.000,5.000|FS:0,0>
        960 = Hold 1.100 1.000 5.000
        960 = not idle at 1.100 1.000 5.000",
    );
}

#[test]
fn a_stage_that_stands_elsewhere_fails_a_move_to_where_it_was_last_seen() {
    homed(
        "950 * move 1 1 5 at 10
        950 > ?
        960 < <Idle|MPos:1.000,1.000,4.000|FS:0,0>
        960 = Idle 1.000 1.000 4.000
        960 > ?
        965 < <Idle|MPos:1.000,1.000,4.000|FS:0,0>
        965 = Idle 1.000 1.000 4.000
        965 = not at 1.000 1.000 5.000 but at 1.000 1.000 4.000",
    );
}

#[test]
fn in_an_alarm_or_without_homing_a_look_fails() {
    moving(
        "1010 < ALARM:1
        1010 = Alarm 1 1.010 1.000 5.000
        1010 = alarm 1
        1020 * look
        1020 = alarm 1",
    );
    homed(
        "950 * look
        950 > ?
        955 < ALARM:1
        955 = Alarm 1 1.000 1.000 5.000
        955 = alarm 1",
    );
    homed(
        "950 * look
        950 > ?
        955 < <Alarm|MPos:1.000,1.000,5.000|FS:0,0>
        955 = Alarm 1.000 1.000 5.000
        955 = alarm 0",
    );
    homed(
        "950 < Grbl 1.1h ['$' for help]
        950 = suspect: the controller was reset: Grbl 1.1h ['$' for help]
        950 = Unhomed 1.000 1.000 5.000
        950 > ?
        960 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        960 = Unhomed 0.000 0.000 0.000
        970 * look
        970 > ?
        980 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        980 = Unhomed 0.000 0.000 0.000
        980 = unhomed",
    );
}

#[test]
fn a_reset_during_a_look_fails_it() {
    homed(
        "950 * look
        950 > ?
        955 < Grbl 1.1h ['$' for help]
        955 = suspect: the controller was reset: Grbl 1.1h ['$' for help]
        955 = Unhomed 1.000 1.000 5.000
        955 = unhomed
        955 > ?",
    );
}

#[test]
fn a_controller_that_does_not_answer_a_look_is_given_up() {
    homed(
        "950 * look
        950 > ?
        ...
        2950 = failed: the controller did not answer for its status",
    );
}

#[test]
fn a_look_is_stopped_and_refuses_other_commands() {
    homed(
        "950 * look
        950 > ?
        951 * move 1 1 6 at 10
        951 = refused another command is under way
        952 * stop
        952 > !
        960 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Idle 1.000 1.000 5.000
        960 > ?
        970 < <Hold:0|MPos:1.000,1.000,5.000|FS:0,0>
        970 = Hold 1.000 1.000 5.000
        970 > ^X
        980 < Grbl 1.1h ['$' for help]
        980 > ?
        990 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        990 = Idle 1.000 1.000 5.000
        990 = stopped 1.000 1.000 5.000",
    );
}

#[test]
fn a_late_report_is_no_answer_to_a_later_question() {
    // Each report is 400 ms late at first.
    homed(
        "1000 > ?
        1250 > ?
        1300 * look
        1400 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1400 = Idle 1.000 1.000 5.000
        1400 > ?
        1650 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1650 = Idle 1.000 1.000 5.000
        1650 > ?
        1700 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1700 = Idle 1.000 1.000 5.000
        1700 > ?
        1750 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1750 = Idle 1.000 1.000 5.000
        1750 > ?
        1760 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1760 = Idle 1.000 1.000 5.000
        1760 = done 1.000 1.000 5.000",
    );
}

#[test]
fn a_pause_at_rest_shows_that_a_report_is_lost() {
    homed(
        "1000 > ?
        1250 > ?
        1260 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1260 = Idle 1.000 1.000 5.000
        1760 > ?
        1765 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1765 = Idle 1.000 1.000 5.000
        1800 * look
        1800 > ?
        1810 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1810 = Idle 1.000 1.000 5.000
        1810 > ?
        1820 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        1820 = Idle 1.000 1.000 5.000
        1820 = done 1.000 1.000 5.000",
    );
}
