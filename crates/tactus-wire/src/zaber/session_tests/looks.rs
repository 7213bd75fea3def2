//! Where the stage stands, asked of the devices and never of what was known before.

use super::{Failure, Play, config};
use crate::stage::Session as _;
use crate::zaber::Flag;

#[test]
fn a_round_that_begins_after_the_look_answers_it() {
    let mut play = Play::homed();
    // A round is under way; the tip is pushed after its axis has answered.
    play.run(101);
    play.look();
    play.stage.axes[0].position = 20.0;
    play.stage.axes[0].target = 20.0;
    assert_eq!(play.results, []);
    play.run(50);
    assert_eq!(play.result(), Ok([0.01, 0.0, 20.0]));
    assert_eq!(play.commands(), [""; 0]);
    assert!(play.session.is_ready());
}

#[test]
fn a_stage_that_moves_is_not_idle_and_one_elsewhere_not_at_the_target() {
    let mut play = Play::homed();
    play.look();
    play.stage.axes[0].target = 90_000.0;
    play.run(50);
    assert!(matches!(play.result(), Err(Failure::NotIdle { .. })));

    let mut play = Play::homed();
    play.stage.axes[0].position = 100.0;
    play.stage.axes[0].target = 100.0;
    play.move_to([0.0, 0.0, 20.0], 5.0);
    play.run(50);
    let expected = Failure::NotThere { target_mm: [0.0, 0.0, 20.0], position_mm: [0.05, 0.0, 20.0] };
    assert_eq!(play.result(), Err(expected));
}

#[test]
fn a_fault_or_a_lost_reference_fails_a_look() {
    let mut play = Play::homed();
    play.look();
    play.stage.axes[0].warnings.push(Flag::STALLED);
    play.run(500);
    assert!(matches!(play.result(), Err(Failure::Alarm(_))));
    play.look();
    assert!(matches!(play.result(), Err(Failure::Alarm(_))));

    let mut play = Play::homed();
    play.look();
    play.stage.reboot(play.now, 2);
    play.run(500);
    assert_eq!(play.result(), Err(Failure::Unhomed));

    let mut play = Play::new(config());
    play.start();
    play.run(200);
    play.look();
    play.run(50);
    assert_eq!(play.result(), Err(Failure::Unhomed));
}

#[test]
fn a_look_without_an_answer_ends_the_session_and_a_stop_ends_the_look() {
    let mut play = Play::homed();
    play.stage.is_dead = true;
    play.look();
    play.run(3000);
    assert_eq!((play.results.len(), play.session.deadline()), (0, None));

    let mut play = Play::homed();
    play.look();
    play.stop();
    play.run(500);
    assert!(matches!(play.result(), Err(Failure::Stopped { .. })));
    assert!(play.session.is_ready());
}
