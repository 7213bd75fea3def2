use core::time::Duration;

use super::{Action, Config, ConfigError, Loss, Reading, Session};
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
    Action::Send(Request::reading(address, id))
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

fn reading(element: usize, tick: u64, counter: u16, passed_over: u64) -> Action {
    Action::Reading(Reading { element, tick, new_clock: false, counter, passed_over, counts: 300 })
}

fn first(element: usize, tick: u64, counter: u16) -> Action {
    Action::Reading(Reading { element, tick, new_clock: true, counter, passed_over: 0, counts: 300 })
}

#[test]
fn polls_in_turn_and_keeps_the_beat() {
    check([
        (0, Start, vec![ask(4, 0)]),
        (3, answer(4, 0, 1000, 7), vec![first(0, 1000, 7), ask(9, 1)]),
        (6, answer(9, 1, 1030, 500), vec![reading(1, 1030, 500, 0)]),
        (20, Timer, vec![ask(4, 2)]),
        (23, answer(4, 2, 1200, 10), vec![reading(0, 1200, 10, 2), ask(9, 3)]),
        (45, answer(9, 3, 1420, 501), vec![reading(1, 1420, 501, 0), ask(4, 4)]),
        (48, answer(4, 4, 1450, 11), vec![reading(0, 1450, 11, 0), ask(9, 5)]),
        (50, answer(9, 5, 1470, 502), vec![reading(1, 1470, 502, 0)]),
        (60, Timer, vec![ask(4, 6)]),
    ]);
}

#[test]
fn silence_is_told_once_and_polling_goes_on() {
    let lost = |element, address| Action::Lost { element, address, loss: Loss::Silent };
    check([
        (0, Start, vec![ask(4, 0)]),
        (250, Timer, vec![ask(9, 1)]),
        (500, Timer, vec![ask(4, 2)]),
        (750, Timer, vec![ask(9, 3)]),
        (1000, Timer, vec![ask(4, 4)]),
        (1250, Timer, vec![lost(0, 4), ask(9, 5)]),
        (1500, Timer, vec![lost(1, 9), ask(4, 6)]),
        (1750, Timer, vec![ask(9, 7)]),
        (1760, answer(9, 7, 90, 1), vec![first(1, 90, 1), ask(4, 8)]),
    ]);
}

#[test]
fn an_element_that_the_board_does_not_reach_is_named() {
    let loss = Loss::Reply(ReplyError::TimedOut { address: 4 });
    let mut dialogue = vec![(0, Start, vec![ask(4, 0)])];
    for poll in 0..4u8 {
        let at = 20 * u64::from(poll);
        let mut actions = vec![ask(9, 2 * poll + 1)];
        if poll == 2 {
            actions.insert(0, Action::Lost { element: 0, address: 4, loss });
        }
        dialogue.push((at + 1, bus_timeout(4, 2 * poll), actions));
        let fresh = if poll == 0 { first(1, 5, 0) } else { reading(1, 5 + u64::from(poll), poll.into(), 0) };
        dialogue.push((at + 2, answer(9, 2 * poll + 1, 5 + u32::from(poll), poll.into()), vec![fresh]));
        dialogue.push((at + 20, Timer, vec![ask(4, 2 * poll + 2)]));
    }
    check(dialogue);
}

#[test]
fn the_same_reading_again_is_no_reading() {
    let stale = Action::Lost { element: 0, address: 4, loss: Loss::Stale };
    check([
        (0, Start, vec![ask(4, 0)]),
        (1, answer(4, 0, 10, 7), vec![first(0, 10, 7), ask(9, 1)]),
        (2, answer(9, 1, 20, 0), vec![reading(1, 20, 0, 0)]),
        (20, Timer, vec![ask(4, 2)]),
        (21, answer(4, 2, 210, 7), vec![ask(9, 3)]),
        (270, answer(9, 3, 2700, 1), vec![reading(1, 2700, 1, 0), ask(4, 4)]),
        (271, answer(4, 4, 2710, 7), vec![ask(9, 5)]),
        (521, Timer, vec![ask(4, 6)]),
        (770, answer(4, 6, 7700, 7), vec![ask(9, 7)]),
        (1001, answer(9, 7, 10_010, 2), vec![reading(1, 10_010, 2, 0), ask(4, 8)]),
        (1002, answer(4, 8, 10_020, 7), vec![stale, ask(9, 9)]),
        (1003, answer(9, 9, 10_030, 3), vec![reading(1, 10_030, 3, 0)]),
        (1021, Timer, vec![ask(4, 10)]),
        (1022, answer(4, 10, 10_220, 8), vec![reading(0, 10_220, 8, 0), ask(9, 11)]),
    ]);
}

#[test]
fn late_and_foreign_replies_are_counted() {
    let session = check([
        (0, Start, vec![ask(4, 0)]),
        (250, Timer, vec![ask(9, 1)]),
        (251, answer(4, 0, 10, 7), vec![]),
        (252, answer(4, 1, 10, 7), vec![]),
        (253, answer(9, 1, 10, 7), vec![first(1, 10, 7), ask(4, 2)]),
    ]);
    assert_eq!(session.unexpected_replies(), 2);
    assert_eq!(session.decoder_stats().skipped_bytes, 0);
}

#[test]
fn a_restarted_board_has_a_new_clock() {
    check([
        (0, Start, vec![ask(4, 0)]),
        (1, answer(4, 0, u32::MAX, 7), vec![first(0, u32::MAX.into(), 7), ask(9, 1)]),
        (2, answer(9, 1, 9, 0), vec![reading(1, 4_294_967_305, 0, 0)]),
        (20, Timer, vec![ask(4, 2)]),
        (
            21,
            answer(4, 2, 3, 8),
            vec![
                Action::Reading(Reading {
                    element: 0,
                    tick: 3,
                    new_clock: true,
                    counter: 8,
                    passed_over: 0,
                    counts: 300,
                }),
                ask(9, 3),
            ],
        ),
    ]);
}

#[test]
fn what_cannot_be_polled_is_refused() {
    let new =
        |addresses| Session::new(Config { addresses, interval: Duration::ZERO }).map(|_| ()).unwrap_err();
    assert_eq!(new(vec![]), ConfigError::NoAddress);
    assert_eq!(new(vec![4, 200]), ConfigError::Address { address: 200 });
    assert_eq!(new(vec![4, 5, 4]), ConfigError::Twice { address: 4 });
}
