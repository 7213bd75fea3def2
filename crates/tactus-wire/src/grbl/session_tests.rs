//! Dialogues with a controller, as transcripts. A line is a time in ms, a mark and a text:
//! `*` a command to the session, `<` a line from the controller, `>` bytes to it, `=` what the session tells.
//! `...` stands for any number of lines of the last two kinds.
//! The controller's lines are those of the real firmware's host build, as the module's doc lists them.

#[path = "session_tests/alarms.rs"]
mod alarms;
#[path = "session_tests/any_dialogue.rs"]
mod any_dialogue;
#[path = "session_tests/connect.rs"]
mod connect;
#[path = "session_tests/looks.rs"]
mod looks;
#[path = "session_tests/moves.rs"]
mod moves;
#[path = "session_tests/returns.rs"]
mod returns;
#[path = "session_tests/settings.rs"]
mod settings;
#[path = "session_tests/stops.rs"]
mod stops;

use core::time::Duration;

use super::{Action, Session};
use crate::grbl::Config;
use crate::stage::{Failure, Session as _, Whereabouts};

const TOLERANCE_MM: f64 = 0.005;

/// From opening the port to a homed stage that stands at (1, 1, 5).
const HOMED: &str = "
    0 * start
    500 > ^X
    520 < Grbl 1.1h ['$' for help]
    520 > ?
    530 < <Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>
    530 > $I
    531 < [VER:1.1h.20190830:]
    531 < [OPT:V,15,128]
    531 < ok
    531 > $$
    532 < $20=1
    532 < $22=1
    532 < $23=3
    532 < $100=250.000
    532 < ok
    532 = connected Grbl 1.1h ['$' for help], VER:1.1h.20190830
    532 = Unhomed 0.000 0.000 0.000
    540 * home
    540 > $H
    540 = Homing 0.000 0.000 0.000
    895 < ok
    895 > ?
    900 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
    900 = Homing 1.000 1.000 5.000
    900 > ?
    910 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
    910 = Idle 1.000 1.000 5.000
    910 = done 1.000 1.000 5.000
";

/// And on to a stage that stands there again, with a feed of 10 mm/s.
const FED: &str = "
    920 * move 1 1 5.05 at 10
    920 > G91G21G94G1F600
    921 < ok
    921 > $G
    922 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
    922 < ok
    922 > G53X1Y1Z5.05
    923 < ok
    923 > ?
    930 < <Idle|MPos:1.000,1.000,5.050|FS:0,0>
    930 = Idle 1.000 1.000 5.050
    930 = done 1.000 1.000 5.050
    931 * move 1 1 5 at 10
    931 > Z-.05
    932 < ok
    932 > ?
    950 < <Idle|MPos:1.000,1.000,5.000|FS:0,0>
    950 = Idle 1.000 1.000 5.000
    950 = done 1.000 1.000 5.000
";

/// And on to a move of 10 mm at 10 mm/s that has been accepted.
const MOVING: &str = "
    950 * move 11 1 5 at 10
    950 > G91G21G94G1F600
    952 < ok
    952 > $G
    954 < [GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]
    954 < ok
    954 > G53X11Y1Z5
    955 < ok
    955 > ?
    1005 < <Run|MPos:1.010,1.000,5.000|FS:600,0>
    1005 = Moving 1.010 1.000 5.000
    1005 > ?
";

/// Plays the inputs of a transcript, timers running in between, and compares the whole of it.
fn check(transcript: &str) -> Session {
    check_with(Config::aligned(TOLERANCE_MM), transcript)
}

fn check_with(config: Config, transcript: &str) -> Session {
    let expected: Vec<&str> = transcript.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let mut session = Session::new(config).unwrap();
    let mut actual = Vec::new();
    for line in expected.iter().filter(|line| **line != "...") {
        let (ms, rest) = line.split_once(' ').unwrap();
        let until = Duration::from_millis(ms.parse().unwrap());
        let (mark, text) = rest.split_once(' ').unwrap();
        let is_input = matches!(mark, "*" | "<");
        run_timers(&mut session, until, is_input, &mut actual);
        if !is_input {
            continue;
        }
        actual.push((*line).to_owned());
        let actions = match mark {
            "<" => session.receive(until, format!("{text}\r\n").as_bytes()),
            _ => command(&mut session, until, text),
        };
        actual.extend(actions.iter().map(|action| describe(until, action)));
    }
    compare(&actual, &expected);
    session
}

fn compare(actual: &[String], expected: &[&str]) {
    let mut rest = actual.iter();
    let mut any = false;
    for line in expected {
        any |= *line == "...";
        if *line != "..." {
            let found =
                if any { rest.any(|actual| actual == line) } else { rest.next().is_some_and(|a| a == line) };
            assert!(found, "no {line:?} in its place in\n{}", actual.join("\n"));
            any = false;
        }
    }
    assert!(any || rest.next().is_none(), "more came than expected:\n{}", actual.join("\n"));
}

/// Runs what is due before `until`, or at it if no input comes first.
fn run_timers(session: &mut Session, until: Duration, is_input: bool, actual: &mut Vec<String>) {
    while let Some(due) = session.deadline().filter(|due| *due < until || *due == until && !is_input) {
        let actions = session.timer(due);
        actual.extend(actions.iter().map(|action| describe(due, action)));
    }
}

fn command(session: &mut Session, now: Duration, text: &str) -> Vec<Action> {
    let words: Vec<&str> = text.split(' ').collect();
    let place = |words: [&str; 3]| -> [f64; 3] { words.map(|mm| mm.parse().unwrap()) };
    match words[..] {
        ["recall", x, y, z, "to", to_x, to_y, to_z] => {
            let (from_mm, to_mm) = (place([x, y, z]), place([to_x, to_y, to_z]));
            session.recall(Whereabouts { from_mm, to_mm });
            Vec::new()
        }
        ["start"] => session.start(now),
        ["home"] => session.home(now),
        ["look"] => session.look(now),
        ["stop"] => session.stop(now),
        ["clear"] => session.clear_alarm(now),
        ["move", x, y, z, "at", speed] => session.move_to(now, place([x, y, z]), speed.parse().unwrap()),
        _ => panic!("no such command: {text}"),
    }
}

fn describe(now: Duration, action: &Action) -> String {
    let place = |[x, y, z]: [f64; 3]| format!("{x:.3} {y:.3} {z:.3}");
    let text = match action {
        Action::Send(bytes) | Action::Move(bytes) => {
            format!("> {}", String::from_utf8_lossy(bytes).trim_end().replace('\x18', "^X"))
        }
        Action::Connected(controller) => format!("= connected {}", controller.identity),
        Action::Report(report) => {
            let alarm = report.alarm.map(|alarm| format!(" {}", alarm.name())).unwrap_or_default();
            format!("= {:?}{alarm} {}", report.status, place(report.position_mm))
        }
        Action::Suspect { why } => format!("= suspect: {why}"),
        Action::Done(Ok(position_mm)) => format!("= done {}", place(*position_mm)),
        Action::Done(Err(failure)) => match failure {
            Failure::Stopped { position_mm } => format!("= stopped {}", place(*position_mm)),
            Failure::Refused { reason, .. } => format!("= refused {reason}"),
            Failure::Unanswered { waited, .. } => format!("= unanswered for {waited:?}"),
            Failure::Alarm(alarm) => format!("= alarm {}", alarm.name()),
            Failure::Unhomed => "= unhomed".to_owned(),
            Failure::Withheld => "= withheld".to_owned(),
            Failure::NotIdle { position_mm } => format!("= not idle at {}", place(*position_mm)),
            Failure::Interrupted { .. } => "= interrupted".to_owned(),
            Failure::NotThere { target_mm, position_mm } => {
                format!("= not at {} but at {}", place(*target_mm), place(*position_mm))
            }
            Failure::Astray { target_mm, position_mm } => {
                format!("= astray at {} on the way to {}", place(*position_mm), place(*target_mm))
            }
            Failure::Overdue { position_mm, waited, .. } => {
                format!("= overdue after {} ms at {}", waited.as_millis(), place(*position_mm))
            }
        },
        Action::Failed(error) => format!("= failed: {error}"),
    };
    format!("{} {text}", now.as_millis())
}

fn homed(rest: &str) -> Session {
    check(&format!("{HOMED}{rest}"))
}

fn fed(rest: &str) -> Session {
    check(&format!("{HOMED}{FED}{rest}"))
}

fn moving(rest: &str) -> Session {
    check(&format!("{HOMED}{MOVING}{rest}"))
}
