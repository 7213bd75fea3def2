//! What holds whatever the devices say.

use core::time::Duration;

use proptest::prelude::*;

use super::{Play, config};
use crate::stage::{Session as _, Status};
use crate::zaber::Session;
use crate::zaber::session::Action;

#[derive(Debug, Clone)]
enum Event {
    Wait(u64),
    /// A reply to the latest question, whatever it was.
    Reply(&'static str),
    Bytes(Vec<u8>),
    Home,
    Move(f64),
    Look,
    Clear,
    Stop,
    Lose(usize),
    Reboot(u8),
    Die(bool),
}

fn event() -> impl Strategy<Value = Event> {
    let replies = prop::sample::select(vec![
        "OK IDLE -- 0",
        "OK BUSY -- 500",
        "OK IDLE FS 500",
        "OK IDLE WR 0",
        "OK IDLE WV 0",
        "OK BUSY NI 1",
        "OK IDLE -- 00",
        "OK IDLE WR 01 WR",
        "RJ IDLE -- BADDATA",
        "RJ IDLE -- AGAIN",
        "OK IDLE -- NA",
    ]);
    prop_oneof![
        6 => (0..400u64).prop_map(Event::Wait),
        3 => replies.prop_map(Event::Reply),
        1 => prop::collection::vec(any::<u8>(), 0..40).prop_map(Event::Bytes),
        1 => Just(Event::Home),
        3 => (0.0..20.0).prop_map(Event::Move),
        1 => Just(Event::Look),
        1 => Just(Event::Clear),
        2 => Just(Event::Stop),
        1 => (1..4usize).prop_map(Event::Lose),
        1 => (1..3u8).prop_map(Event::Reboot),
        1 => any::<bool>().prop_map(Event::Die),
    ]
}

fn step(play: &mut Play, given: &mut usize, event: &Event) {
    let is_over = play.session.deadline().is_none();
    if matches!(event, Event::Home | Event::Move(_) | Event::Look | Event::Clear) {
        *given += usize::from(!is_over);
    }
    match event {
        Event::Wait(ms) => play.run(*ms),
        Event::Reply(text) => {
            let last = play.log.iter().rev().find_map(|line| line.split_once(" > /").map(|(_, said)| said));
            let words: Vec<&str> = last.unwrap_or_default().split(' ').collect();
            let [device, axis, id, ..] = words[..] else { return };
            let line = format!("@{device:0>2} {axis} {id} {text}\r\n");
            let actions = play.session.receive(play.now, line.as_bytes());
            play.act(actions);
        }
        Event::Bytes(bytes) => {
            let actions = play.session.receive(play.now, bytes);
            play.act(actions);
        }
        Event::Stop if is_over => assert!(play.session.stop(play.now).is_empty()),
        Event::Stop => play.stop(),
        Event::Lose(count) => play.stage.lost_replies += count,
        Event::Reboot(device) => play.stage.reboot(play.now, *device),
        Event::Die(is_dead) => play.stage.is_dead = *is_dead,
        Event::Home => play.home(),
        Event::Move(mm) => play.move_to([*mm, mm / 2.0, 20.0 - mm / 3.0], 5.0),
        Event::Look => play.look(),
        Event::Clear => play.clear(),
    }
}

/// What the log must show: moves only on a homed stage, and no more than one in flight an axis.
fn check_log(log: &[String]) {
    let mut known = true;
    let mut in_flight = Vec::new();
    for line in log {
        let (_, text) = line.split_once(' ').unwrap();
        if text.starts_with("= Unhomed") || text.starts_with("= Alarm") || text.starts_with("= Homing") {
            known = false;
        } else if text.starts_with("= Idle") {
            known = true;
        } else if text.starts_with("= done") {
            in_flight.clear();
        } else if text.contains("move abs") {
            let axis = text[2..6].to_owned();
            assert!(known, "a move on a stage that is not homed:\n{}", log.join("\n"));
            assert!(!in_flight.contains(&axis), "two moves in flight of {axis}:\n{}", log.join("\n"));
            in_flight.push(axis);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever the devices say and whenever: a command ends once, unless the session fails; a stop sends its
    /// message first; no axis has two moves in flight, and none without being homed; and no command is waited
    /// for for ever.
    #[test]
    fn any_dialogue(events in prop::collection::vec(event(), 0..40)) {
        let mut play = Play::homed();
        let mut given = 0;
        for event in &events {
            step(&mut play, &mut given, event);
            prop_assert!(play.results.len() <= given, "a command ended twice");
            let all_ended = play.results.len() == given;
            prop_assert!(all_ended || !play.session.is_ready(), "ready with a command in hand");
        }
        play.run(130_000);
        let is_over = play.session.deadline().is_none();
        prop_assert!(is_over || play.results.len() == given, "a command without end");
        check_log(&play.log);
        if !is_over {
            prop_assert!(play.status() != Status::Hold);
        }
    }

    /// Any bytes, cut anywhere, to a session in any phase.
    #[test]
    fn any_bytes(chunks in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 0..20)) {
        let mut session = Session::new(config()).unwrap();
        let mut sent = session.start(Duration::ZERO).len();
        for (ms, chunk) in chunks.iter().enumerate() {
            let now = Duration::from_millis(ms as u64);
            let actions = session.receive(now, chunk);
            sent += actions.iter().filter(|action| matches!(action, Action::Send(_))).count();
        }
        prop_assert!(sent <= 1 + chunks.len());
    }
}
