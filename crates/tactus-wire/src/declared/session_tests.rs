use core::time::Duration;
use std::sync::Arc;

use super::Session;
use crate::declared::{Encoder, Format, RawFormat};
use crate::sensor::{Action, Cause, LossEvidence, Reading, Session as _};

const COUNTED: &str = r#"
schema = "tactus.link/1"
name = "pair"
[frame]
bytes = 16
sync = [0xAA, 0x55]
[sequence]
offset = 2
width = 1
[timestamp]
offset = 4
width = 4
tick_ns = 62.5
[samples]
offset = 8
elements = 2
type = "u16"
bad = [65535]
[checksum]
kind = "crc32"
"#;

const SECOND: Duration = Duration::from_secs(1);

fn format() -> Arc<Format> {
    Arc::new(toml::from_str::<RawFormat>(COUNTED).unwrap().check().unwrap())
}

fn started(format: &Arc<Format>) -> (Session, Encoder) {
    let mut session = Session::new(format);
    assert_eq!(session.start(Duration::ZERO), []);
    (session, Encoder::new(Arc::clone(format)))
}

fn only_reading(actions: Vec<Action>) -> Reading {
    match actions.into_iter().last() {
        Some(Action::Reading(reading)) => reading,
        other => panic!("not a reading: {other:?}"),
    }
}

#[test]
fn ticks_become_nanoseconds_and_bad_elements_are_listed() {
    let format = format();
    let (mut session, mut encoder) = started(&format);
    assert_eq!(
        (session.name().as_str(), session.tick_ns(), session.packet_bytes()),
        ("declared, pair", 1, None)
    );
    let actions = session.receive(SECOND, encoder.encode(1000, &[7.0, 65_535.0]).unwrap());
    assert_eq!(actions[0], Action::Connected { identity: None });
    let expected = Reading {
        tick: Some(62_500),
        new_clock: true,
        evidence: LossEvidence::TimesOnly,
        counts: [7.0, 65_535.0].into(),
        bad: vec![1],
        temperature_c: None,
    };
    assert_eq!(only_reading(actions), expected);
}

#[test]
fn the_devices_count_shows_losses() {
    let format = format();
    let (mut session, mut encoder) = started(&format);
    session.receive(SECOND, encoder.encode(0, &[7.0, 8.0]).unwrap());
    encoder.lose_frame();
    encoder.lose_frame();
    let reading = only_reading(session.receive(SECOND, encoder.encode(1, &[7.0, 8.0]).unwrap()));
    assert_eq!(reading.evidence, LossEvidence::Counted { lost: 2, wrap: 256 });
}

#[test]
fn a_clock_that_is_set_forward_is_a_new_clock() {
    let format = format();
    let (mut session, mut encoder) = started(&format);
    session.receive(SECOND, encoder.encode(0, &[7.0, 8.0]).unwrap());
    for (tick, new_clock) in [(16_000_000, false), (48_100_000, true)] {
        let reading = only_reading(session.receive(SECOND, encoder.encode(tick, &[7.0, 8.0]).unwrap()));
        assert_eq!(reading.new_clock, new_clock, "{tick}");
    }
}

#[test]
fn a_frame_that_comes_twice_gives_one_reading_and_a_fault_in_the_end() {
    let format = format();
    let (mut session, mut encoder) = started(&format);
    let frame = encoder.encode(0, &[7.0, 8.0]).unwrap().to_vec();
    session.receive(Duration::ZERO, &frame);
    assert_eq!(session.receive(SECOND / 2, &frame), []);
    let actions = session.timer(SECOND);
    let [Action::Lost(loss)] = &actions[..] else { panic!("not lost: {actions:?}") };
    assert_eq!(loss.cause, Cause::Silent);
    assert!(loss.what.contains("stands still"), "{}", loss.what);
}
