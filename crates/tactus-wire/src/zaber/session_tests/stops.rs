//! Stops.

use super::{Failure, Play, Status};
use crate::stage::Session as _;
use crate::zaber::HostCommand;

#[test]
fn a_stop_is_sent_at_once_and_keeps_the_position() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 1.0);
    play.run(1001);
    play.stop();
    assert!(play.session.is_stopping());
    play.run(100);
    let Err(Failure::Stopped { position_mm: [x, ..] }) = play.result() else { panic!() };
    assert!((x - play.stage.axes[0].position / 2000.0).abs() < 0.001 && (0.9..1.1).contains(&x), "{x}");
    assert_eq!(play.status(), Status::Idle);
    // It is taken up where it was left, the warning of the stop notwithstanding.
    play.move_to([3.0, 0.0, 20.0], 5.0);
    play.run(1000);
    assert_eq!(play.result(), Ok([3.0, 0.0, 20.0]));
}

#[test]
fn a_stop_before_the_axes_have_set_out() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 16.0], 5.0);
    play.run(5);
    play.stop();
    play.run(500);
    assert!(matches!(play.result(), Err(Failure::Stopped { .. })));
    assert_eq!(play.count("move abs"), 0);
}

#[test]
fn a_stop_that_a_device_does_not_hear_is_sent_again() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 1.0);
    play.run(500);
    play.stage.deaf_to = Some("stop");
    play.stop();
    play.run(100);
    play.stage.deaf_to = None;
    play.run(500);
    assert_eq!(play.commands()[2..], ["/0 0 stop", "/0 0 stop"]);
    assert!(matches!(play.result(), Err(Failure::Stopped { .. })));
}

#[test]
fn a_device_that_never_confirms_a_stop_ends_the_session() {
    let mut play = Play::homed();
    play.stage.deaf_to = Some("stop");
    play.stop();
    play.run(3000);
    assert_eq!(play.count("= failed: device 1 did not answer to \"stop\""), 1);
}

#[test]
fn a_stage_that_goes_on_moving_is_stopped_harder() {
    let mut play = Play::homed();
    play.move_to([40.0, 0.0, 20.0], 1.0);
    play.run(500);
    play.stage.glides = true;
    play.stop();
    play.run(2900);
    assert_eq!(play.status(), Status::Hold);
    play.run(200);
    assert_eq!(play.commands()[2..], ["/0 0 stop", "/0 0 estop"]);
    assert!(matches!(play.result(), Err(Failure::Stopped { .. })));
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn stop_while_standing_leaves_the_stage_ready() {
    let mut play = Play::homed();
    play.stop();
    play.stop();
    play.run(100);
    assert_eq!(play.count("> /0 0"), 2);
    assert_eq!(play.status(), Status::Idle);
    assert!(play.session.is_ready() && play.results.is_empty());
}

#[test]
fn a_stop_while_homing_leaves_the_stage_unhomed() {
    let mut play = Play::homed();
    play.home();
    play.run(2);
    play.stop();
    play.run(100);
    assert!(matches!(play.result(), Err(Failure::Stopped { .. })));
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn a_reply_to_what_was_asked_before_the_stop_proves_nothing() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 1.0);
    play.run(500);
    play.stop();
    let ids: Vec<u8> = play
        .under_way
        .iter()
        .filter(|(_, to_stage, _)| *to_stage)
        .filter_map(|(_, _, bytes)| HostCommand::parse(String::from_utf8_lossy(bytes).trim_end())?.id)
        .collect();
    let before = ids[0] - 1;
    let late = format!("@01 1 {before:02} OK IDLE -- 6000\r\n");
    let actions = play.session.receive(play.now, late.as_bytes());
    play.act(actions);
    assert!(play.session.is_stopping());
    assert!(play.report.unwrap().position_mm[0] < 1.0);
}
