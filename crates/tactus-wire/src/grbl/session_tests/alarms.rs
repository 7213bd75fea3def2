//! Alarms, homing and resets.

use super::{homed, moving};

#[test]
fn a_hard_limit_is_told_cleared_and_homed_again() {
    moving(
        "1010 < ALARM:1
        1010 = Alarm 1 1.010 1.000 5.000
        1010 = alarm 1
        1011 < [MSG:Reset to continue]
        1100 * move 2 1 5 at 10
        1100 = alarm 1
        1200 * home
        1200 = alarm 1
        ...
        9000 * clear
        9000 > ^X
        9010 < Grbl 1.1h ['$' for help]
        9010 > $X
        9011 < [MSG:'$H'|'$X' to unlock]
        9020 < [MSG:Caution: Unlocked]
        9020 < ok
        9020 > ?
        9030 < <Idle|MPos:1.020,1.000,5.000|FS:0,0>
        9030 = Unhomed 1.020 1.000 5.000
        9030 = done 1.020 1.000 5.000
        9040 * home
        9040 > $H
        9040 = Homing 1.020 1.000 5.000
        9900 < ok
        9900 > ?
        9910 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        9910 = Homing 1.000 1.000 5.000
        9910 > ?
        9920 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
        9920 = Idle 1.000 1.000 5.000
        9920 = done 1.000 1.000 5.000",
    );
}

#[test]
fn an_alarm_that_cannot_be_cleared() {
    moving(
        "1010 < ALARM:1
        1010 = Alarm 1 1.010 1.000 5.000
        1010 = alarm 1
        1020 * clear
        1020 > ^X
        1030 < Grbl 1.1h ['$' for help]
        1030 > $X
        1040 < ok
        1040 > ?
        1050 < <Alarm|MPos:1.020,1.000,5.000|FS:0,0>
        1050 = Alarm 1 1.020 1.000 5.000
        1050 = alarm 1",
    );
}

#[test]
fn without_an_alarm_there_is_nothing_to_clear() {
    homed(
        "950 * clear
        950 = done 1.000 1.000 5.000",
    );
}

#[test]
fn stop_in_an_alarm_is_sent_and_no_more() {
    moving(
        "1010 < ALARM:1
        1010 = Alarm 1 1.010 1.000 5.000
        1010 = alarm 1
        1020 * stop
        1020 > !
        1020 * clear
        1020 > ^X",
    );
}

#[test]
fn a_soft_limit_is_an_alarm_too() {
    homed(
        "950 * move 900 1 5 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X900Y1Z5
        960 < ALARM:2
        960 = Alarm 2 1.000 1.000 5.000
        960 = alarm 2",
    );
}

#[test]
fn an_alarm_whose_line_was_lost_shows_in_the_report() {
    moving(
        "1010 < <Alarm|MPos:1.400,1.000,5.000|FS:0,0>
        1010 = Alarm 1.400 1.000 5.000
        1010 = alarm 0",
    );
}

#[test]
fn homing_may_fail() {
    homed(
        "950 * home
        950 > $H
        950 = Homing 1.000 1.000 5.000
        960 < <Home|MPos:1.000,1.000,5.000|FS:0,0>
        960 = Homing 1.000 1.000 5.000
        12000 * move 2 1 5 at 10
        12000 = refused another command is under way
        24950 < ALARM:9
        24950 = Alarm 9 1.000 1.000 5.000
        24950 = alarm 9
        24950 > ?",
    );
    homed(
        "950 * home
        950 > $H
        950 = Homing 1.000 1.000 5.000
        960 < error:5
        960 = Unhomed 1.000 1.000 5.000
        960 = refused error 5: homing is switched off in the controller ($22)
        960 > ?
        970 * move 1 1 6 at 10
        970 = unhomed",
    );
    homed(
        "950 * home
        950 > $H
        950 = Homing 1.000 1.000 5.000
        60950 > ^X
        60950 = failed: the controller did not answer that it is homed",
    );
}

#[test]
fn a_banner_in_motion_leaves_the_position_suspect() {
    moving(
        "1010 < Grbl 1.1h ['$' for help]
        1010 = suspect: the controller was reset: Grbl 1.1h ['$' for help]
        1010 = Unhomed 1.010 1.000 5.000
        1010 = unhomed
        1010 > ?
        1020 < <Idle|MPos:1.700,1.000,5.000|FS:0,0>
        1020 = Unhomed 1.700 1.000 5.000
        1030 * move 1 1 6 at 10
        1030 = unhomed",
    );
}

#[test]
fn a_banner_at_a_stand_does_too() {
    homed(
        "950 < Grbl 1.1h ['$' for help]
        950 = suspect: the controller was reset: Grbl 1.1h ['$' for help]
        950 = Unhomed 1.000 1.000 5.000
        950 > ?
        960 < <Idle|MPos:0.000,0.000,0.000|FS:0,0>
        960 = Unhomed 0.000 0.000 0.000",
    );
}

#[test]
fn the_error_of_boot_is_no_answer_to_a_move() {
    homed(
        "950 * move 2 1 5 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X2Y1Z5
        955 < error:7
        960 < Grbl 1.1h ['$' for help]
        960 = suspect: the controller was reset: Grbl 1.1h ['$' for help]
        960 = Unhomed 1.000 1.000 5.000
        960 = unhomed
        960 > ?",
    );
}

#[test]
fn a_locked_controller_refuses_moves_until_it_is_reset_and_unlocked() {
    // The alarm's line was lost, and `?` goes unanswered: the refusal is what shows it.
    homed(
        "950 * move 2 1 5 at 10
        950 > G91G21G94G1F600
        950 < ok
        950 > $G
        950 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        950 < ok
        950 > G53X2Y1Z5
        955 < error:9
        955 > !
        955 > ?
        ...
        2955 = failed: the controller did not answer for its status",
    );
}
