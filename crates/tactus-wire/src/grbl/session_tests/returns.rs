//! The session of a link that was lost and is back.

use super::{check, homed, moving};
use crate::stage::{Session as _, Whereabouts};

/// The greeting of a controller that answers the reset with this report; then what follows.
fn back(listens: &str, report: &str, rest: &str) {
    check(&format!(
        "0 * recall 1 1 -0.3 to 1 1 -0.4
        0 * start
        0 > !
        {listens}
        500 > ^X
        520 < Grbl 1.1h ['$' for help]
        520 > ?
        530 < <{report}|FS:0,0|WCO:0.000,0.000,0.000>
        530 > $I
        531 < ok
        531 > $$
        532 < $20=1
        532 < $22=1
        532 < $23=3
        532 < ok
        532 = connected Grbl 1.1h ['$' for help]
        {rest}"
    ));
}

#[test]
fn a_controller_that_stands_where_it_was_keeps_its_place() {
    for z in ["-0.300", "-0.344", "-0.400", "-0.404"] {
        back("", &format!("Idle|MPos:1.000,1.000,{z}"), &format!("532 = Idle 1.000 1.000 {z}"));
    }
    let moves_up = "532 = Idle 1.000 1.000 -0.300
        540 * move 1 1 6 at 10
        540 > ?
        545 < <Idle|MPos:1.000,1.000,-0.300|FS:0,0>
        545 = Idle 1.000 1.000 -0.300
        545 > G91G21G94G1F600
        546 < ok
        546 > $G
        547 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
        547 < ok
        547 > G53X1Y1Z6";
    back("", "Idle|MPos:1.000,1.000,-0.300", moves_up);
}

#[test]
fn a_controller_that_stands_elsewhere_or_is_locked_must_be_homed() {
    for place in ["1.000,1.000,-0.290", "1.000,1.010,-0.350", "0.000,0.000,0.000"] {
        let [x, y, z] = [0, 1, 2].map(|at| place.split(',').nth(at).unwrap());
        back("", &format!("Idle|MPos:{place}"), &format!("532 = Unhomed {x} {y} {z}"));
    }
    back("", "Alarm|MPos:1.000,1.000,-0.300", "532 = Unhomed 1.000 1.000 -0.300");
    back("", "Run|MPos:1.000,1.000,-0.350", "532 = Moving 1.000 1.000 -0.350\n...");
}

#[test]
fn a_controller_that_counts_from_0_again_is_not_believed_although_it_was_there() {
    check(
        "0 * recall 0 0 0 to 0 0 0
        0 * start
        0 > !
        500 > ^X
        520 < Grbl 1.1h ['$' for help]
        520 > ?
        530 < <Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>
        530 > $I
        531 < ok
        531 > $$
        532 < $20=1
        532 < $22=1
        532 < $23=3
        532 < ok
        532 = connected Grbl 1.1h ['$' for help]
        532 = Unhomed 0.000 0.000 0.000",
    );
}

#[test]
fn a_controller_that_has_started_by_itself_must_be_homed() {
    check(
        "0 * recall 1 1 -0.3 to 1 1 -0.3
        0 * start
        0 > !
        20 < Grbl 1.1h ['$' for help]
        20 > ?
        30 < <Idle|MPos:1.000,1.000,-0.300|FS:0,0|WCO:0.000,0.000,0.000>
        30 > $I
        31 < ok
        31 > $$
        32 < $20=1
        32 < $22=1
        32 < $23=3
        32 < ok
        32 = connected Grbl 1.1h ['$' for help]
        32 = Unhomed 1.000 1.000 -0.300",
    );
}

#[test]
fn a_stop_before_the_reset_holds_and_keeps_the_place() {
    back("100 * stop\n100 > !", "Idle|MPos:1.000,1.000,-0.300", "532 = Idle 1.000 1.000 -0.300");
}

#[test]
fn what_is_known_is_the_way_that_was_under_way_and_nothing_after_an_alarm_or_a_reset_in_motion() {
    let at = |from_mm, to_mm| Some(Whereabouts { from_mm, to_mm });
    assert_eq!(homed("").whereabouts(), at([1.0, 1.0, 5.0], [1.0, 1.0, 5.0]));
    assert_eq!(moving("").whereabouts(), at([1.01, 1.0, 5.0], [11.0, 1.0, 5.0]));
    let silent = moving("...\n3205 = failed: the controller did not answer for its status");
    assert_eq!(silent.whereabouts(), at([1.01, 1.0, 5.0], [11.0, 1.0, 5.0]));
    let alarm = moving("1010 < ALARM:1\n1010 = Alarm 1 1.010 1.000 5.000\n1010 = alarm 1");
    assert_eq!(alarm.whereabouts(), None);
    let reset = moving(
        "1008 * stop
        1008 > !
        ...
        2900 < <Run|MPos:1.500,1.000,5.000|FS:600,0>
        ...
        4008 > ^X",
    );
    assert_eq!(reset.whereabouts(), None);
    assert_eq!(
        check("0 * recall 1 1 5 to 1 1 4\n0 * start\n0 > !").whereabouts(),
        at([1.0, 1.0, 5.0], [1.0, 1.0, 4.0])
    );
}
