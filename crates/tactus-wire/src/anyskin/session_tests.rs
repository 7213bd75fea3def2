use core::time::Duration;

use super::Session;
use crate::anyskin::{DecodedFrame, Magnetometer};
use crate::sensor::{Action, Cause, LossEvidence, Reading, Session as _};

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn bytes(field_ut: [f32; 3]) -> Vec<u8> {
    DecodedFrame { magnetometers: [Magnetometer { temperature_c: 25.0, field_ut }; 5] }.encode()
}

fn reading(evidence: LossEvidence) -> Action {
    let counts = [1.5, -2.5, 3.0].repeat(5).into();
    Action::Reading(Reading {
        tick: None,
        new_clock: false,
        evidence,
        counts,
        bad: vec![],
        temperature_c: Some(25.0),
    })
}

fn three_frames() -> Vec<u8> {
    bytes([1.5, -2.5, 3.0]).repeat(3)
}

#[test]
fn connects_with_the_first_frames_and_marks_damage() {
    let mut session = Session::new();
    assert_eq!(session.start(ms(0)), []);
    let fresh = reading(LossEvidence::TimesOnly);
    let connected = Action::Connected { identity: None };
    assert_eq!(session.receive(ms(30), &three_frames()), [connected, fresh.clone(), fresh.clone(), fresh]);
    assert_eq!(session.receive(ms(40), &bytes([1.0; 3])[5..]), []);
    let [first, ..] = &session.receive(ms(70), &three_frames())[..] else { panic!("no reading") };
    assert_eq!(*first, reading(LossEvidence::Damage));
}

#[test]
fn a_magnetometer_without_a_number_is_bad() {
    let mut session = Session::new();
    session.start(ms(0));
    session.receive(ms(30), &three_frames());
    let actions = session.receive(ms(40), &bytes([f32::NAN, -5000.0, 1.0]));
    let [Action::Reading(reading)] = &actions[..] else { panic!("not a reading: {actions:?}") };
    assert_eq!(reading.bad, [0, 3, 6, 9, 12]);
    assert_eq!(reading.counts[1..3], [-5000.0, 1.0]);
}

#[test]
fn the_temperature_is_the_mean_of_those_that_are_numbers() {
    let magnetometers = [20.0, 22.0, f32::NAN, 30.0, f32::INFINITY]
        .map(|temperature_c| Magnetometer { temperature_c, field_ut: [1.0; 3] });
    assert_eq!(DecodedFrame { magnetometers }.temperature_c(), Some(24.0));
    let magnetometers = [Magnetometer { temperature_c: f32::NAN, field_ut: [1.0; 3] }; 5];
    assert_eq!(DecodedFrame { magnetometers }.temperature_c(), None);
}

#[test]
fn silence_and_another_device_differ() {
    let mut session = Session::new();
    session.start(ms(0));
    assert_eq!(session.deadline(), Some(ms(1000)));
    let lost = |actions: Vec<Action>| match &actions[..] {
        [Action::Lost(loss)] => loss.cause,
        other => panic!("not lost: {other:?}"),
    };
    assert_eq!(lost(session.timer(ms(1000))), Cause::Silent);
    for at in [1500, 2400] {
        assert_eq!(session.receive(ms(at), b"other"), []);
    }
    assert_eq!(session.timer(ms(2000)), [], "bytes came since");
    assert_eq!(session.deadline(), Some(ms(3000)));
    assert_eq!(lost(session.timer(ms(3000))), Cause::Protocol);
}
