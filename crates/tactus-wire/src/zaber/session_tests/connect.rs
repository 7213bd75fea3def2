//! Finding the devices, and listening to them.

use super::{Play, Status, config};
use crate::stage::Session as _;
use crate::zaber::{Axis, ConfigError, Flag, Session};

#[test]
fn every_device_and_axis_is_asked_what_it_is() {
    let mut play = Play::new(config());
    play.start();
    play.run(75);
    assert_eq!(
        play.log.join("\n"),
        "0 > /1 0 00 get version
4 > /1 0 01 get system.axiscount
8 > /1 1 02 get limit.min
12 > /1 1 03 get limit.max
16 > /1 1 04 warnings
20 > /1 1 05 get pos
24 > /1 0 06 get system.axiscount
28 > /1 2 07 get limit.min
32 > /1 2 08 get limit.max
36 > /1 2 09 warnings
40 > /1 2 10 get pos
44 > /2 0 11 get version
48 > /2 0 12 get system.axiscount
52 > /2 1 13 get limit.min
56 > /2 1 14 get limit.max
60 > /2 1 15 warnings
64 > /2 1 16 get pos
68 = connected device 1 firmware 7.38, device 2 firmware 7.38
68 = Unhomed 5.000 5.000 15.000
68 > /1 1 17 get pos
72 > /1 2 18 get pos"
    );
    assert!(play.session.is_ready());
}

#[test]
fn with_checksums_on_every_line_has_one() {
    let mut play = Play::new(super::Config { checksums: true, ..config() });
    play.start();
    play.run(200);
    assert_eq!(play.log[0], "0 > /1 0 00 set comm.checksum 1:F5");
    assert_eq!(play.count("> /2 0 12 set comm.checksum 1:"), 1);
    assert_eq!(play.status(), Status::Unhomed);
    assert_eq!(play.session.unknown_lines(), 0);
    // A device that falls back to sending none is not believed.
    play.stage.checksums = false;
    play.run(3000);
    assert_eq!(play.count("= failed: device 1 did not answer to \"get pos\""), 1);
}

#[test]
fn a_standing_stage_is_asked_ten_times_a_second() {
    let mut play = Play::homed();
    play.run(1000);
    assert_eq!(play.count("get pos"), 30);
    assert_eq!(play.count("= Idle 0.000 0.000 20.000"), 10);
}

#[test]
fn a_reference_is_trusted_if_that_is_asked_for() {
    for (trusts_reference, status) in [(true, Status::Idle), (false, Status::Unhomed)] {
        let mut play = Play::new(super::Config { trusts_reference, ..config() });
        play.stage.axes.iter_mut().for_each(|axis| axis.warnings.clear());
        play.start();
        play.run(200);
        assert_eq!(play.status(), status);
    }
}

#[test]
fn a_reference_that_hides_behind_another_warning_is_looked_for() {
    let mut play = Play::new(super::Config { trusts_reference: true, ..config() });
    play.stage.axes.iter_mut().for_each(|axis| axis.warnings.clear());
    play.stage.axes[2].warnings = vec![Flag::parse("WV").unwrap(), Flag::NO_REFERENCE];
    play.start();
    play.run(200);
    assert_eq!(play.status(), Status::Unhomed);
}

#[test]
fn a_stage_that_is_found_moving_is_stopped() {
    let mut play = Play::new(config());
    play.stage.axes[2].target = 90_000.0;
    play.start();
    play.run(200);
    assert_eq!(play.count("= Moving"), 1);
    assert_eq!(play.commands().last().unwrap(), "/0 0 stop");
    assert!(!play.stage.axes[2].is_busy() && play.session.is_ready());
}

#[test]
fn a_silent_port_is_given_up() {
    let mut play = Play::new(config());
    play.stage.is_dead = true;
    play.start();
    play.run(10_000);
    assert_eq!(play.count("get version"), 8);
    assert_eq!(play.count("= failed: device 1 does not answer"), 1);
    assert_eq!(play.session.deadline(), None);
    assert!(play.session.stop(play.now).is_empty());
}

#[test]
fn an_axis_that_the_device_lacks() {
    let mut config = config();
    config.axes[2] = config.axes[2].map(|axis| Axis { number: 4, ..axis });
    let mut play = Play::new(config);
    play.start();
    play.run(200);
    assert_eq!(play.count("= failed: device 2 has 1 axes, but the rig uses its axis 4 as z"), 1);
}

#[test]
fn microsteps_of_another_length_are_refused_with_both_values() {
    let mut config = config();
    config.axes[2] = config.axes[2].map(|axis| Axis { resolution: Some(64), ..axis });
    let mut play = Play::new(config.clone());
    play.start();
    play.run(200);
    assert_eq!(play.count("= connected"), 1);
    assert_eq!(play.count("get resolution"), 1, "only the axis whose resolution the rig relies on");
    play = Play::new(config);
    play.stage.resolution = 128;
    play.start();
    play.run(200);
    let refusal = "= failed: the controller has resolution = 128 on z, but the rig needs 64";
    assert_eq!(play.count(refusal), 1, "{}", play.log.join("\n"));
    assert_eq!(play.count("set "), 0, "nothing is changed");
}

#[test]
fn a_device_that_does_not_know_a_question() {
    let mut play = Play::new(config());
    play.stage.rejects = Some(("get limit.max", "BADCOMMAND"));
    play.start();
    play.run(200);
    assert_eq!(play.count("= failed: device 1 refused \"get limit.max\": BADCOMMAND"), 1);
}

#[test]
fn a_lost_reply_is_asked_for_again() {
    let mut play = Play::homed();
    play.stage.lost_replies = 1;
    play.run(1000);
    // One question is asked twice, a quarter of a second apart.
    assert_eq!((play.count("> /1 1"), play.count("> /2 1")), (10, 9));
    assert_eq!(play.status(), Status::Idle);
}

#[test]
fn noise_and_foreign_messages_are_counted_and_passed_over() {
    let mut play = Play::homed();
    let before = play.session.unknown_lines();
    for line in
        ["@01 1 99 OK IDLE -- 5", "@07 1 OK IDLE -- 5", "#01 0 hello", "!01 1 IDLE --", "@01 1 OK", "\x7F"]
    {
        let actions = play.session.receive(play.now, format!("{line}\r\n").as_bytes());
        play.act(actions);
    }
    assert_eq!(play.session.unknown_lines() - before, 4);
    play.run(500);
    assert_eq!(play.status(), Status::Idle);
}

#[test]
fn a_knob_that_is_turned_is_seen() {
    let mut play = Play::homed();
    play.stage.axes[0].warnings.push(Flag::MANUAL_CONTROL);
    play.stage.axes[0].target = 40_000.0;
    play.run(150);
    assert_eq!(play.status(), Status::Moving);
    play.move_to([1.0, 0.0, 20.0], 1.0);
    assert!(matches!(play.result(), Err(super::Failure::Refused { reason, .. }) if reason.contains("knob")));
    play.run(5000);
    assert_eq!(play.status(), Status::Idle);
    // The flag stays, but is no news when the next move is under way.
    play.move_to([1.0, 0.0, 20.0], 10.0);
    play.run(5000);
    assert_eq!(play.result(), Ok([1.0, 0.0, 20.0]));
}

#[test]
fn a_configuration_that_makes_no_stage() {
    let mut same = config();
    same.axes[1] = same.axes[0];
    let mut no_length = config();
    no_length.axes[0] = no_length.axes[0].map(|axis| Axis { um_per_microstep: 0.0, ..axis });
    let none = super::Config { axes: [None; 3], ..config() };
    assert!(matches!(Session::new(same), Err(ConfigError::Same { .. })));
    assert!(matches!(Session::new(no_length), Err(ConfigError::Range { field: "um_per_microstep", .. })));
    assert!(matches!(Session::new(none), Err(ConfigError::NoAxis)));
}

#[test]
fn a_stage_of_one_axis() {
    let mut config = config();
    (config.axes[0], config.axes[1]) = (None, None);
    let mut play = Play::homed_with(config);
    play.move_to([1.0, 0.0, 19.0], 1.0);
    assert!(matches!(play.result(), Err(super::Failure::Refused { .. })));
    play.move_to([0.0, 0.0, 19.0], 1.0);
    play.run(2000);
    assert_eq!(play.result(), Ok([0.0, 0.0, 19.0]));
}
