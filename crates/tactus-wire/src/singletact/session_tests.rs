use core::time::Duration;

use super::{Config, ConfigError, ElementLoss, Session};
use crate::sensor::{Action, Cause, Loss, LossEvidence, Reading, Session as _};
use crate::singletact::{ElementReading, Reply, ReplyError, Request, Via};

/// What reaches the session at a time in ms.
enum Input {
    Start,
    Hear(Vec<u8>),
    /// The deadline, which must be this time.
    Timer,
}

use Input::{Hear, Start, Timer};

/// Plays a dialogue with the elements 4 and 9, polled every 20 ms: each input must lead to exactly these
/// actions.
fn check(dialogue: impl IntoIterator<Item = (u64, Input, Vec<Action>)>) -> Session {
    let config = Config { addresses: vec![4, 9], interval: Duration::from_millis(20) };
    let mut session = Session::new(config).unwrap();
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

fn ask(address: u8, id: u8) -> Action {
    Action::Send(Request::reading(address, id).encode().unwrap())
}

fn answer(address: u8, id: u8, ticks: u32, counter: u16) -> Input {
    let data = ElementReading { counter, counts: 300 }.encode();
    let reply = Reply { via: Via::Usb, address, timed_out: false, id, timestamp_ticks: ticks, data: &data };
    Hear(reply.encode())
}

fn bus_timeout(address: u8, id: u8) -> Input {
    let data = [0; 6];
    let reply = Reply { via: Via::Arduino, address, timed_out: true, id, timestamp_ticks: 0, data: &data };
    Hear(reply.encode())
}

/// A reading of the elements that answered, each with 300 counts.
fn reading(tick: u64, lost: u64, answered: [bool; 2]) -> Action {
    Action::Reading(Reading {
        tick: Some(tick),
        new_clock: false,
        evidence: LossEvidence::Counted { lost, wrap: u64::MAX },
        counts: answered.map(|answered| if answered { 300.0 } else { 0.0 }).into(),
        bad: (0..).zip(answered).filter(|(_, answered)| !answered).map(|(element, _)| element).collect(),
        temperature_c: None,
    })
}

/// The same on a new clock.
fn first(tick: u64, lost: u64, answered: [bool; 2]) -> Action {
    let Action::Reading(old) = reading(tick, lost, answered) else { unreachable!("it is a reading") };
    Action::Reading(Reading { new_clock: true, ..old })
}

const CONNECTED: Action = Action::Connected { identity: None };
const BOTH: [bool; 2] = [true, true];

#[test]
fn polls_in_turn_and_keeps_the_interval() {
    check([
        (0, Start, vec![ask(4, 0)]),
        (3, answer(4, 0, 1000, 7), vec![ask(9, 1)]),
        (6, answer(9, 1, 1030, 500), vec![CONNECTED, first(1030, 0, BOTH)]),
        (20, Timer, vec![ask(4, 2)]),
        (23, answer(4, 2, 1200, 10), vec![ask(9, 3)]),
        (45, answer(9, 3, 1420, 501), vec![reading(1420, 0, BOTH), ask(4, 4)]),
        (48, answer(4, 4, 1450, 11), vec![ask(9, 5)]),
        (50, answer(9, 5, 1470, 502), vec![reading(1470, 0, BOTH)]),
        (60, Timer, vec![ask(4, 6)]),
    ]);
}

#[test]
fn intervals_without_a_reading_are_counted() {
    check([
        (0, Start, vec![ask(4, 0)]),
        (1, answer(4, 0, 10, 7), vec![ask(9, 1)]),
        (2, answer(9, 1, 20, 0), vec![CONNECTED, first(20, 0, BOTH)]),
        (20, Timer, vec![ask(4, 2)]),
        (21, answer(4, 2, 210, 8), vec![ask(9, 3)]),
        // The round of 20 ms ends 11 intervals late, and begins a new series.
        (271, Timer, vec![reading(210, 0, [true, false]), ask(4, 4)]),
        (272, answer(4, 4, 2720, 9), vec![ask(9, 5)]),
        (273, answer(9, 5, 2730, 1), vec![reading(2730, 11, BOTH)]),
        (291, Timer, vec![ask(4, 6)]),
    ]);
}

#[test]
fn silence_is_reported_once_and_polling_continues() {
    let warning = format!("element 0 at address 4 is no longer read: {}", ElementLoss::Silent);
    let lost = Loss::new(Cause::Silent, ElementLoss::Silent.to_string());
    check([
        (0, Start, vec![ask(4, 0)]),
        (250, Timer, vec![ask(9, 1)]),
        (500, Timer, vec![ask(4, 2)]),
        (750, Timer, vec![ask(9, 3)]),
        (1000, Timer, vec![ask(4, 4)]),
        (1250, Timer, vec![Action::Warning(warning), ask(9, 5)]),
        (1500, Timer, vec![Action::Lost(lost), ask(4, 6)]),
        (1750, Timer, vec![ask(9, 7)]),
        (1760, answer(9, 7, 90, 1), vec![CONNECTED, first(90, 75, [false, true]), ask(4, 8)]),
    ]);
}

#[test]
fn an_element_that_the_board_does_not_reach_is_named() {
    let loss = ElementLoss::Reply(ReplyError::TimedOut { address: 4 });
    let mut dialogue = vec![(0, Start, vec![ask(4, 0)])];
    for poll in 0..4u8 {
        let at = 20 * u64::from(poll);
        let mut actions = vec![ask(9, 2 * poll + 1)];
        if poll == 2 {
            actions.insert(0, Action::Warning(format!("element 0 at address 4 is no longer read: {loss}")));
        }
        dialogue.push((at + 1, bus_timeout(4, 2 * poll), actions));
        let tick = 5 + u64::from(poll);
        let one = [false, true];
        let fresh =
            if poll == 0 { vec![CONNECTED, first(tick, 0, one)] } else { vec![reading(tick, 0, one)] };
        dialogue.push((at + 2, answer(9, 2 * poll + 1, 5 + u32::from(poll), poll.into()), fresh));
        dialogue.push((at + 20, Timer, vec![ask(4, 2 * poll + 2)]));
    }
    check(dialogue);
}

#[test]
fn the_same_reading_again_is_no_reading() {
    let stale = format!("element 0 at address 4 is no longer read: {}", ElementLoss::Stale);
    let one = [false, true];
    check([
        (0, Start, vec![ask(4, 0)]),
        (1, answer(4, 0, 10, 7), vec![ask(9, 1)]),
        (2, answer(9, 1, 20, 0), vec![CONNECTED, first(20, 0, BOTH)]),
        (20, Timer, vec![ask(4, 2)]),
        (21, answer(4, 2, 210, 7), vec![ask(9, 3)]),
        (270, answer(9, 3, 2700, 1), vec![reading(2700, 0, one), ask(4, 4)]),
        (271, answer(4, 4, 2710, 7), vec![ask(9, 5)]),
        (521, Timer, vec![ask(4, 6)]),
        (770, answer(4, 6, 7700, 7), vec![ask(9, 7)]),
        (1001, answer(9, 7, 10_010, 2), vec![reading(10_010, 23, one), ask(4, 8)]),
        (1002, answer(4, 8, 10_020, 7), vec![Action::Warning(stale), ask(9, 9)]),
        (1003, answer(9, 9, 10_030, 3), vec![reading(10_030, 23, one)]),
        (1021, Timer, vec![ask(4, 10)]),
        (1022, answer(4, 10, 10_220, 8), vec![ask(9, 11)]),
        (1023, answer(9, 11, 10_230, 4), vec![reading(10_230, 0, BOTH)]),
    ]);
}

#[test]
fn late_and_foreign_replies_are_counted() {
    let session = check([
        (0, Start, vec![ask(4, 0)]),
        (250, Timer, vec![ask(9, 1)]),
        (251, answer(4, 0, 10, 7), vec![]),
        (252, answer(4, 1, 10, 7), vec![]),
        (253, answer(9, 1, 10, 7), vec![CONNECTED, first(10, 0, [false, true]), ask(4, 2)]),
    ]);
    assert_eq!(session.unexpected_replies, 2);
    assert_eq!(session.decoder.stats().skipped_bytes, 0);
}

#[test]
fn a_restarted_board_has_a_new_clock() {
    check([
        (0, Start, vec![ask(4, 0)]),
        (1, answer(4, 0, u32::MAX, 7), vec![ask(9, 1)]),
        (2, answer(9, 1, 9, 0), vec![CONNECTED, first(4_294_967_305, 0, BOTH)]),
        (20, Timer, vec![ask(4, 2)]),
        (21, answer(4, 2, 3, 8), vec![ask(9, 3)]),
        (22, answer(9, 3, 13, 1), vec![first(13, 0, BOTH)]),
    ]);
}

#[test]
fn bytes_that_are_no_answer_are_another_device() {
    let mut dialogue = vec![(0, Start, vec![ask(4, 0)]), (10, Hear(b"temperature 21.5".to_vec()), vec![])];
    for poll in 1..=5u8 {
        let address = if poll % 2 == 0 { 4 } else { 9 };
        let mut actions = vec![ask(address, poll)];
        if poll == 5 {
            let warning = format!("element 0 at address 4 is no longer read: {}", ElementLoss::Silent);
            actions.insert(0, Action::Warning(warning));
        }
        dialogue.push((250 * u64::from(poll), Timer, actions));
    }
    let what = "bytes come, but no answer to a poll (16 bytes skipped, 0 replies to no request): is it the board that \
                the rig file describes, and is the bit rate right?";
    let lost = Loss::new(Cause::Protocol, what);
    dialogue.push((1500, Timer, vec![Action::Lost(lost), ask(4, 6)]));
    check(dialogue);
}

#[test]
fn what_cannot_be_polled_is_refused() {
    let new =
        |addresses| Session::new(Config { addresses, interval: Duration::ZERO }).map(|_| ()).unwrap_err();
    assert_eq!(new(vec![]), ConfigError::NoAddress);
    assert_eq!(new(vec![4, 200]), ConfigError::Address { address: 200 });
    assert_eq!(new(vec![4, 5, 4]), ConfigError::Twice { address: 4 });
}
