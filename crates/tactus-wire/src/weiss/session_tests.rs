use core::time::Duration;

use super::{Config, Device, Session, SessionError, restarted, silent};
use crate::sensor::{Action, LossEvidence, Reading, Session as _};
use crate::weiss::{
    BOOT_MESSAGE, Checksum, ControllerInfo, ErrorCode, FrameError, InfoError, MatrixInfo, SensorInfo,
    acknowledge, acquire, encode_frame, encode_packet, id, query_controller, query_matrix, query_sensor,
};

/// What reaches the session at a time in ms.
enum Input {
    Start,
    Hear(Vec<u8>),
    /// The deadline, which must be this time.
    Timer,
}

use Input::{Hear, Start, Timer};

fn config(checksum: Checksum) -> Config {
    Config { rows: 1, cols: 2, fps: 30, run_length: false, checksum }
}

/// Plays a dialogue: at each line's time the input must lead to exactly these actions.
fn check(dialogue: impl IntoIterator<Item = (u64, Input, Vec<Action>)>) -> Session {
    let mut session = Session::new(config(Checksum::Crc));
    for (ms, input, expected) in dialogue {
        let now = Duration::from_millis(ms);
        let actions = match input {
            Start => session.start(now),
            Hear(bytes) => session.receive(now, &bytes),
            Timer => {
                assert_eq!(session.deadline(), Some(now));
                session.timer(now)
            }
        };
        assert_eq!(actions, expected, "at {ms} ms");
    }
    session
}

fn send(bytes: Vec<u8>) -> Vec<Action> {
    vec![Action::Send(bytes)]
}

fn device() -> Device {
    Device {
        controller: ControllerInfo { serial_number: 7, software_version: 300, ..Default::default() },
        sensor: SensorInfo { matrices: 1, ..Default::default() },
        matrix: MatrixInfo { cells_x: 2, cells_y: 1, ..Default::default() },
    }
}

fn acknowledged() -> Input {
    Hear(acknowledge(id::ACQUIRE, ErrorCode::SUCCESS))
}

fn frame(timestamp_ms: u32) -> Input {
    Hear(encode_frame(timestamp_ms, &[1, 2], false))
}

fn reading(tick_ms: u64, new_clock: bool) -> Action {
    Action::Reading(Reading {
        tick: Some(tick_ms),
        new_clock,
        evidence: LossEvidence::TimesOnly,
        counts: [1.0, 2.0].into(),
        bad: vec![],
        temperature_c: None,
    })
}

fn connected() -> Action {
    Action::Connected { identity: Some("controller serial 7, software 300, sensor serial 0".to_owned()) }
}

/// From nothing to the first frame, at `ms` throughout.
fn greeting(ms: u64) -> Vec<(u64, Input, Vec<Action>)> {
    let mut dialogue = vec![(ms, Start, send(acquire(false, false, 0)))];
    dialogue.extend(answers(ms));
    dialogue
}

/// From the first answer to the first frame.
fn answers(ms: u64) -> Vec<(u64, Input, Vec<Action>)> {
    vec![
        (ms, acknowledged(), send(query_controller())),
        (ms, Hear(device().controller.encode()), send(query_sensor())),
        (ms, Hear(device().sensor.encode()), send(query_matrix(0))),
        (ms, Hear(device().matrix.encode()), send(acquire(true, false, 30))),
        (ms, acknowledged(), vec![]),
        (ms, frame(1000), vec![connected(), reading(1000, true)]),
    ]
}

fn after_greeting(rest: Vec<(u64, Input, Vec<Action>)>) -> Session {
    check(greeting(0).into_iter().chain(rest))
}

#[test]
fn asks_who_is_there_and_reads_frames() {
    let session = after_greeting(vec![
        (33, frame(1033), vec![reading(1033, false)]),
        (66, frame(1066), vec![reading(1066, false)]),
    ]);
    assert_eq!(session.deadline(), Some(Duration::from_millis(1066)));
}

#[test]
fn several_frames_in_one_piece() {
    let both = [encode_frame(1033, &[1, 2], false), encode_frame(1066, &[1, 2], true)].concat();
    after_greeting(vec![(70, Hear(both), vec![reading(1033, false), reading(1066, false)])]);
}

#[test]
fn a_booting_controller_is_asked_until_it_answers() {
    let again = || send(acquire(false, false, 0));
    let mut dialogue = vec![(0, Start, again())];
    dialogue.extend((1..=7).map(|s| (s * 1000, Timer, again())));
    dialogue.push((7100, Hear(BOOT_MESSAGE.to_vec()), again()));
    dialogue.push((7400, Hear(BOOT_MESSAGE.to_vec()), again()));
    dialogue.push((8400, Timer, again()));
    dialogue.extend(answers(8450));
    check(dialogue);
}

#[test]
fn silence_is_given_up_in_the_end() {
    let mut dialogue = vec![(0, Start, send(acquire(false, false, 0)))];
    dialogue.extend((1..15).map(|s| (s * 1000, Timer, send(acquire(false, false, 0)))));
    let error = SessionError::Silent { query: "switching the acquisition off", asked: 15 };
    dialogue.push((15_000, Timer, vec![Action::Failed(error.into())]));
    dialogue.push((15_001, acknowledged(), vec![]));
    assert_eq!(check(dialogue).deadline(), None);
}

#[test]
fn a_lost_answer_is_asked_for_again() {
    let mut broken = device().controller.encode();
    broken[10] ^= 1;
    check([
        (0, Start, send(acquire(false, false, 0))),
        (5, acknowledged(), send(query_controller())),
        (9, Hear(broken), vec![]),
        (1005, Timer, send(query_controller())),
        (1009, Hear(device().controller.encode()), send(query_sensor())),
        // The answer to the first asking, late.
        (1010, Hear(device().controller.encode()), vec![]),
    ]);
}

#[test]
fn frames_of_an_earlier_acquisition_are_passed_over() {
    let mut dialogue = greeting(0);
    dialogue.insert(1, (0, frame(900), vec![]));
    dialogue.insert(3, (0, frame(933), vec![]));
    check(dialogue);
}

#[test]
fn a_missing_acknowledgement_is_no_matter_if_frames_come() {
    let mut dialogue = greeting(0);
    dialogue.remove(5);
    check(dialogue);
}

#[test]
fn a_stall_is_told_and_the_same_clock_goes_on() {
    after_greeting(vec![
        (1000, Timer, vec![Action::Lost(silent()), Action::Send(acquire(true, false, 30))]),
        (2000, Timer, send(acquire(true, false, 30))),
        (2500, frame(3500), vec![connected(), reading(3500, false)]),
    ]);
}

#[test]
fn a_stopped_clock_is_silence() {
    let session = after_greeting(vec![
        (500, frame(1000), vec![]),
        (999, frame(1000), vec![]),
        (1000, Timer, vec![Action::Lost(silent()), Action::Send(acquire(true, false, 30))]),
        (1033, frame(1000), vec![]),
        (1066, frame(1033), vec![connected(), reading(1033, false)]),
    ]);
    assert_eq!(session.stale_frames, 3);
}

#[test]
fn a_restart_is_told_and_everything_asked_anew() {
    let mut dialogue = vec![(
        40,
        Hear(BOOT_MESSAGE.to_vec()),
        vec![Action::Lost(restarted()), Action::Send(acquire(false, false, 0))],
    )];
    dialogue.extend(answers(50));
    after_greeting(dialogue);
}

#[test]
fn a_clock_that_jumps_is_a_new_clock() {
    after_greeting(vec![
        (33, frame(61_033), vec![reading(61_033, true)]),
        (66, frame(61_066), vec![reading(61_066, false)]),
        (99, frame(3), vec![reading(3, true)]),
    ]);
}

#[test]
fn a_frame_of_another_array_ends_the_session() {
    for elements in [1, 3, 48, 500] {
        let error = SessionError::DecodedFrame(FrameError::Elements { expected: 2, found: elements });
        let other = Hear(encode_frame(1033, &vec![0; elements], false));
        let session = after_greeting(vec![(33, other, vec![Action::Failed(error.into())])]);
        assert_eq!(session.deadline(), None);
    }
}

#[test]
fn a_refusal_ends_the_session() {
    let dialogue = |code| {
        let mut dialogue = greeting(0);
        dialogue.truncate(5);
        dialogue.push((0, Hear(acknowledge(id::ACQUIRE, ErrorCode(code))), vec![]));
        dialogue
    };
    let mut refused = dialogue(5);
    let query = "switching the acquisition on";
    refused[5].2 = vec![Action::Failed(SessionError::Refused { query, code: ErrorCode(5) }.into())];
    check(refused);
    check(dialogue(0));
    let error = SessionError::Refused { query, code: ErrorCode(5) };
    assert_eq!(
        error.to_string(),
        "the controller refused switching the acquisition on: error 5, feature not supported"
    );
}

#[test]
fn a_reply_of_another_form_ends_the_session() {
    let error = InfoError { id: id::CONTROLLER, expected: 18, found: 3 };
    check([
        (0, Start, send(acquire(false, false, 0))),
        (0, acknowledged(), send(query_controller())),
        (
            0,
            Hear(encode_packet(id::CONTROLLER, &[0; 3])),
            vec![Action::Failed(SessionError::Answer(error).into())],
        ),
    ]);
}

#[test]
fn a_matrix_of_another_shape_is_a_warning() {
    let other = MatrixInfo { cells_x: 1, cells_y: 2, ..Default::default() };
    let mut dialogue = greeting(0);
    dialogue[4].1 = Hear(other.encode());
    let warning = "the matrix reports 2 rows and 1 columns, the rig's array has 1 and 2";
    dialogue[6].2.insert(1, Action::Warning(warning.to_owned()));
    check(dialogue);
}

#[test]
fn older_firmware_is_spoken_to_in_its_form() {
    let mut session = Session::new(config(Checksum::Sum8));
    for (ms, input, expected) in greeting(0) {
        let now = Duration::from_millis(ms);
        let actions = match input {
            Start => session.start(now),
            Hear(bytes) => session.receive(now, &Checksum::Sum8.close(bytes)),
            Timer => session.timer(now),
        };
        let mut expected = expected;
        for action in &mut expected {
            if let Action::Send(packet) = action {
                *packet = Checksum::Sum8.close(packet.clone());
            }
        }
        assert_eq!(actions, expected);
    }
    assert_eq!(session.decoder.stats().bad_checksums, 0);
}
