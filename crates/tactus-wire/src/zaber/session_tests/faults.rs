//! Faults, homing, restarts and silence.

use super::{Config, Failure, Play, Status, config};
use crate::stage::{Alarm, AxisName, Session as _};
use crate::zaber::Flag;

/// What a flag of an axis is as an alarm.
fn alarm(axis: AxisName, flag: Flag) -> Alarm {
    Alarm { code: flag.code(), axis: Some(axis), meaning: flag.meaning() }
}

fn stalled_z() -> Alarm {
    alarm(AxisName::Z, Flag::STALLED)
}

#[test]
fn z_is_homed_first_and_the_others_together() {
    let mut play = Play::new(config());
    play.start();
    play.run(80);
    play.log.clear();
    play.home();
    play.run(300);
    assert_eq!((play.commands(), play.status()), (vec!["/2 1 home".to_owned()], Status::Homing));
    play.run(5000);
    assert_eq!(play.commands(), ["/2 1 home", "/1 1 home", "/1 2 home"]);
    assert_eq!(play.result(), Ok([0.0, 0.0, 20.0]));
}

#[test]
fn homing_has_a_speed_of_its_own_if_that_is_asked_for() {
    let mut play = Play::homed_with(Config { homing_speed_mm_per_s: Some(10.0), ..config() });
    // The slowest move that can be told, and not waited for.
    play.move_to([0.001, 0.0, 20.0], 0.001);
    play.run(3000);
    assert!(play.result().is_ok());
    play.log.clear();
    play.home();
    play.run(100);
    assert!(play.result().is_ok());
    let speeds = ["/1 1 set maxspeed 32768", "/1 2 set maxspeed 32768"];
    assert_eq!(play.commands()[..2], ["/2 1 set maxspeed 32768", "/2 1 home"]);
    assert_eq!(play.commands()[2..], [speeds[0], speeds[1], "/1 1 home", "/1 2 home"]);
}

#[test]
fn a_stall_stops_all_axes_and_must_be_cleared_and_homed() {
    let mut play = Play::homed();
    play.stage.axes[2].stalls_at = Some(4_000.0);
    play.move_to([3.0, 0.0, 16.0], 5.0);
    play.run(2000);
    assert_eq!(play.result(), Err(Failure::Alarm(stalled_z())));
    assert_eq!(play.commands().iter().filter(|said| *said == "/0 0 stop").count(), 1);
    assert!(play.stage.axes[0].position < 3_200.0);
    assert_eq!((play.status(), play.report.unwrap().alarm), (Status::Alarm, Some(stalled_z())));

    play.move_to([3.0, 0.0, 20.0], 1.0);
    assert_eq!(play.result(), Err(Failure::Alarm(stalled_z())));
    play.home();
    assert_eq!(play.result(), Err(Failure::Alarm(stalled_z())));

    play.stage.axes[2].stalls_at = None;
    play.clear();
    play.run(100);
    assert!(play.result().is_ok());
    assert_eq!(play.status(), Status::Unhomed);
    play.move_to([3.0, 0.0, 20.0], 1.0);
    assert_eq!(play.result(), Err(Failure::Unhomed));
    play.home();
    play.run(5000);
    assert!(play.result().is_ok());
    play.move_to([3.0, 0.0, 20.0], 5.0);
    play.run(2000);
    assert!(play.result().is_ok());
}

#[test]
fn an_alarm_that_cannot_be_cleared() {
    let mut play = Play::homed();
    let hot = Flag::parse("FM").unwrap();
    play.stage.axes[0].warnings.push(hot);
    play.run(200);
    assert_eq!(play.status(), Status::Alarm);
    play.log.clear();
    play.stage.rejects = Some(("warnings clear", "BADCOMMAND"));
    play.clear();
    play.run(100);
    assert_eq!(play.result(), Err(Failure::Alarm(alarm(AxisName::X, hot))));
    assert_eq!(play.commands()[..3], ["/1 1 warnings clear", "/1 1 driver enable", "/1 1 warnings"]);
}

#[test]
fn without_an_alarm_there_is_nothing_to_clear() {
    let mut play = Play::homed();
    play.clear();
    assert_eq!(play.result(), Ok([0.0, 0.0, 20.0]));
    assert_eq!(play.commands(), [""; 0]);
}

#[test]
fn an_alert_of_a_stall_stops_the_stage_at_once() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 16.0], 1.0);
    play.run(500);
    play.stage.axes[2].warnings.insert(0, Flag::STALLED);
    let actions = play.session.receive(play.now, b"!02 1 IDLE FS\r\n");
    let stops = matches!(&actions[0], super::Action::Send(bytes) if bytes.ends_with(b"stop\n"));
    assert!(stops, "{actions:?}");
    play.act(actions);
    play.run(500);
    assert_eq!(play.result(), Err(Failure::Alarm(stalled_z())));
}

#[test]
fn homing_may_fail() {
    let mut play = Play::homed();
    let limit = Flag::parse("FE").unwrap();
    play.stage.reboot(play.now, 2);
    (play.stage.axes[2].position, play.stage.axes[2].target) = (5_000.0, 5_000.0);
    play.stage.axes[2].homing_fault = Some(limit);
    play.run(200);
    play.home();
    play.run(5000);
    assert_eq!(play.result(), Err(Failure::Alarm(alarm(AxisName::Z, limit))));
    assert_eq!(play.commands().iter().filter(|said| said.ends_with("home")).count(), 1);
    assert_eq!(play.status(), Status::Alarm);

    // It ends without a fault, and without a reference.
    let mut play = Play::new(config());
    play.stage.axes[2].homing_fault = Some(Flag::NO_REFERENCE);
    play.start();
    play.run(200);
    play.home();
    play.run(5000);
    assert_eq!(play.result(), Err(Failure::Unhomed));
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn homing_that_takes_too_long_is_stopped() {
    let mut play = Play::new(config());
    play.start();
    play.run(200);
    play.stage.axes[2].maxspeed = 1.0;
    play.home();
    play.run(121_000);
    assert!(matches!(play.result(), Err(Failure::Refused { .. })));
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn a_restart_in_motion_leaves_the_position_suspect() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 16.0], 1.0);
    play.run(500);
    // It is away for a second, and back before it is given up.
    play.stage.is_dead = true;
    play.run(1000);
    play.stage.is_dead = false;
    play.stage.reboot(play.now, 2);
    play.run(500);
    assert_eq!(play.count("= suspect: z no longer knows where it is"), 1);
    assert_eq!(play.result(), Err(Failure::Unhomed));
    assert_eq!(play.status(), Status::Unhomed);
    assert!(!play.stage.axes[0].is_busy(), "x was stopped");
    play.move_to([3.0, 0.0, 16.0], 1.0);
    assert_eq!(play.result(), Err(Failure::Unhomed));
}

#[test]
fn a_restart_at_a_stand_does_too() {
    let mut play = Play::homed();
    play.stage.reboot(play.now, 1);
    play.run(200);
    assert_eq!(play.count("= suspect: x no longer knows where it is"), 1);
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn a_lost_reference_that_hides_behind_another_warning_is_found_in_motion() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 16.0], 1.0);
    play.run(500);
    play.stage.axes[2].warnings = vec![Flag::parse("WV").unwrap(), Flag::NO_REFERENCE];
    play.run(60);
    assert_eq!(play.count("= suspect: z no longer knows where it is"), 1);
    assert_eq!(play.result(), Err(Failure::Unhomed));
}

#[test]
fn a_caution_alone_stops_nothing() {
    let mut play = Play::homed();
    play.stage.axes[2].warnings = vec![Flag::parse("WV").unwrap()];
    play.move_to([0.0, 0.0, 19.0], 5.0);
    play.run(1000);
    assert_eq!(play.result(), Ok([0.0, 0.0, 19.0]));
    assert_eq!(play.status(), Status::Idle);
    play.home();
    play.run(2000);
    assert!(play.result().is_ok());
}

#[test]
fn an_axis_that_was_pushed_must_be_homed() {
    let mut play = Play::homed();
    play.stage.axes[1].warnings.push(Flag::parse("WM").unwrap());
    play.run(200);
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn silence_in_motion_stops_the_stage_and_ends_the_session() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 16.0], 1.0);
    play.run(500);
    play.stage.is_dead = true;
    play.run(3000);
    assert_eq!(play.count("= failed: device"), 1);
    assert_eq!(play.commands().last().unwrap(), "/0 0 stop");
    assert_eq!(play.session.deadline(), None);
    assert!(play.results.is_empty());
}
