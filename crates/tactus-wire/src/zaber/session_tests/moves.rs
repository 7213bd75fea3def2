//! When a move is done, and when it is not.

use super::{Config, Failure, Play, Status, config};
use crate::stage::{AxisName, Session as _};
use crate::zaber::Flag;

#[test]
fn the_axes_are_set_to_their_parts_of_the_speed_and_arrive_together() {
    let mut play = Play::homed();
    // 3 mm in x, 4 mm down in z: 5 mm along the way, at 5 mm/s.
    play.move_to([3.0, 0.0, 16.0], 5.0);
    play.run(60);
    // 6000 and 8000 microsteps/s, times 1.6384.
    assert_eq!(
        play.commands(),
        ["/1 1 set maxspeed 9830", "/2 1 set maxspeed 13107", "/1 1 move abs 6000", "/2 1 move abs 8000"]
    );
    assert_eq!(play.status(), Status::Moving);
    play.run(400);
    let [x, z] = [0, 2].map(|slot| play.stage.axes[slot].position / play.stage.axes[slot].target);
    assert!((x - z).abs() < 0.01, "{x} {z}");
    play.run(1000);
    assert_eq!(play.result(), Ok([3.0, 0.0, 16.0]));
    assert_eq!(play.status(), Status::Idle);
    // As fast as replies come: 4 ms each.
    let asked = play.count("get pos");
    assert!((240..290).contains(&asked), "{asked}");
}

#[test]
fn the_acceleration_is_shared_like_the_speed() {
    let mut play = Play::homed_with(Config { accel_mm_per_s2: Some(50.0), ..config() });
    play.move_to([3.0, 0.0, 16.0], 5.0);
    play.run(30);
    // 60000 and 80000 microsteps/s², times 1.6384 / 10000.
    assert_eq!(
        play.commands()[..4],
        ["/1 1 set maxspeed 9830", "/1 1 set accel 10", "/2 1 set maxspeed 13107", "/2 1 set accel 13"]
    );
}

#[test]
fn a_move_to_the_present_place_becomes_a_look() {
    let mut play = Play::homed();
    play.move_to([0.0001, 0.0, 20.0], 5.0);
    assert_eq!(play.results, []);
    play.run(50);
    assert_eq!(play.result(), Ok([0.0, 0.0, 20.0]));
    assert_eq!(play.commands(), [""; 0]);
}

#[test]
fn what_cannot_be_done_is_refused_and_nothing_sent() {
    let mut play = Play::homed();
    for (target_mm, speed) in [
        ([f64::NAN, 0.0, 20.0], 1.0),
        ([1.0, 0.0, 20.0], 0.0),
        ([1.0, 0.0, 20.0], f64::INFINITY),
        ([1.0, 0.0, 20.0], 1e12),
        ([1.0, 0.0, 20.0], 1e-9),
        ([1.0, 0.0, 20.001], 1.0),
        ([50.001, 0.0, 20.0], 1.0),
        ([1e300, 0.0, 20.0], 1.0),
    ] {
        play.move_to(target_mm, speed);
        assert!(matches!(play.result(), Err(Failure::Refused { .. })), "{target_mm:?} at {speed}");
    }
    play.run(300);
    assert_eq!(play.commands(), [""; 0]);
    assert!(play.session.is_ready());
}

#[test]
fn a_second_move_is_refused_while_one_is_in_hand() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 1.0);
    play.run(100);
    play.move_to([4.0, 0.0, 20.0], 1.0);
    assert!(matches!(play.result(), Err(Failure::Refused { .. })));
    play.run(5000);
    assert_eq!(play.result(), Ok([3.0, 0.0, 20.0]));
    assert_eq!(play.count("move abs"), 1);
}

#[test]
fn a_rejected_move_stops_the_axes_that_have_set_out() {
    let mut play = Play::homed();
    play.stage.rejects = Some(("move abs 8000", "PARKED"));
    play.move_to([3.0, 0.0, 16.0], 5.0);
    play.run(1000);
    let Err(Failure::Refused { command, reason }) = play.result() else { panic!() };
    assert_eq!((&command[..], &reason[..]), ("move abs 8000", "z: PARKED: the axis is parked: unpark it"));
    assert_eq!(play.commands().last().unwrap(), "/0 0 stop");
    assert!(play.stage.axes[0].position < 500.0);
    assert_eq!(play.status(), Status::Idle);
}

#[test]
fn a_speed_that_the_controller_refuses_moves_nothing() {
    let mut play = Play::homed();
    play.stage.rejects = Some(("set maxspeed", "BADDATA"));
    play.move_to([3.0, 0.0, 16.0], 5.0);
    play.run(1000);
    assert!(matches!(play.result(), Err(Failure::Refused { .. })));
    assert_eq!(play.count("move abs"), 0);
    assert!(play.session.is_ready());
}

#[test]
fn standing_elsewhere_is_not_there() {
    let mut play = Play::homed();
    play.stage.axes[0].stops_short_at = Some(2_000.0);
    play.move_to([3.0, 0.0, 20.0], 5.0);
    play.run(2000);
    let expected = Failure::NotThere { target_mm: [3.0, 0.0, 20.0], position_mm: [1.0, 0.0, 20.0] };
    assert_eq!(play.result(), Err(expected));
}

#[test]
fn an_overdue_move_is_stopped_and_told() {
    let mut play = Play::homed();
    play.stage.deaf_to = Some("set maxspeed");
    play.move_to([3.0, 0.0, 20.0], 5.0);
    // No answer to the speed for 2 s: the session ends, with a stop.
    play.run(2100);
    assert_eq!(play.count("= failed: device 1 did not answer to \"set maxspeed 16384\""), 1);
    assert_eq!(play.commands().last().unwrap(), "/0 0 stop");

    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 5.0);
    play.run(30);
    // Ten times too slow.
    play.stage.axes[0].maxspeed /= 10.0;
    play.run(4000);
    let Err(Failure::Overdue { position_mm: [x, ..], waited, .. }) = play.result() else { panic!() };
    assert_eq!(waited.as_millis(), 3200);
    assert!((x - 1.65).abs() < 0.1, "{x}");
    assert!(!play.stage.axes[0].is_busy());
}

#[test]
fn a_move_that_is_not_confirmed_is_not_sent_again_but_stopped() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 1.0);
    play.run(1);
    play.stage.lost_replies = 1;
    play.run(5000);
    // The lost one is the reply to the speed, which is told again.
    let speed = "/1 1 set maxspeed 3277";
    assert_eq!(play.commands(), [speed, speed, "/1 1 move abs 6000"]);
    assert_eq!(play.result(), Ok([3.0, 0.0, 20.0]));

    play.move_to([0.0, 0.0, 20.0], 1.0);
    play.run(5);
    play.stage.lost_replies = 1;
    play.run(1000);
    assert!(
        matches!(play.result(), Err(Failure::Unanswered { command, .. }) if command.contains("move abs 0"))
    );
    assert_eq!(play.commands()[3..], [speed, "/1 1 move abs 0", "/0 0 stop"]);
    assert!(!play.stage.axes[0].is_busy());
    assert_eq!(play.status(), Status::Idle);
}

#[test]
fn a_move_that_someone_else_ends_is_told() {
    let mut play = Play::homed();
    play.move_to([3.0, 0.0, 20.0], 1.0);
    play.run(500);
    play.stage.axes[0].warnings.push(Flag::INTERRUPTED);
    play.run(500);
    let Err(Failure::Interrupted { axis, meaning, .. }) = play.result() else { panic!() };
    assert_eq!((axis, meaning), (AxisName::X, Flag::INTERRUPTED.meaning()));
    assert_eq!(play.status(), Status::Idle);
}

#[test]
fn a_move_on_a_stage_that_is_not_homed_is_refused() {
    let mut play = Play::new(config());
    play.start();
    play.run(200);
    play.move_to([3.0, 0.0, 20.0], 1.0);
    assert_eq!(play.result(), Err(Failure::Unhomed));
}
