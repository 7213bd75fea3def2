//! What holds whatever a controller says.

use core::time::Duration;

use proptest::prelude::*;

use super::{TOLERANCE_MM, command};
use crate::grbl::session::Action;
use crate::grbl::{Config, Session};
use crate::stage::{Session as _, Status};

const BANNER: &str = "Grbl 1.1h ['$' for help]";

#[derive(Debug, Clone)]
enum Event {
    Wait(u64),
    Line(&'static str),
    Command(&'static str),
}

fn line() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "ok",
        "error:7",
        "error:9",
        "ALARM:1",
        "ALARM:3",
        BANNER,
        "<Idle|MPos:1.000,1.000,5.000|FS:0,0>",
        "<Idle|MPos:2.000,1.000,5.000|FS:0,0>",
        "<Run|MPos:1.500,1.000,5.000|FS:0,0>",
        "<Hold:0|MPos:1.500,1.000,5.000|FS:0,0>",
        "<Alarm|MPos:1.500,1.000,5.000|FS:0,0>",
        "<Idle|MPos:1.000,1.000,5.000|WCO:1.000,0.000,0.000>",
        "$22=0",
        "[VER:1.1h.20190830:]",
        "[GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0]",
        "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]",
        "noise",
    ])
}

fn event() -> impl Strategy<Value = Event> {
    let commands =
        prop::sample::select(vec!["home", "move 2 1 5 at 10", "move 1 1 5 at 10", "look", "clear", "stop"]);
    prop_oneof![
        2 => (0..400u64).prop_map(Event::Wait),
        4 => line().prop_map(Event::Line),
        2 => commands.prop_map(Event::Command),
    ]
}

/// A session, and what must be true of it.
struct Play {
    session: Session,
    now: Duration,
    /// Commands given and not ended.
    in_hand: usize,
    /// The last report to say so said that the position is known.
    known: bool,
}

impl Play {
    /// A homed stage at (1, 1, 5).
    fn homed() -> Self {
        let session = Session::new(Config::aligned(TOLERANCE_MM)).unwrap();
        let mut play = Self { session, now: Duration::ZERO, in_hand: 0, known: false };
        let greeting = play.session.start(play.now);
        play.check(&greeting);
        let at_home = "<Idle|MPos:1.000,1.000,5.000|FS:0,0>";
        for event in [
            Event::Line(BANNER),
            Event::Line(at_home),
            Event::Line("ok"),
            Event::Line("$20=1"),
            Event::Line("$22=1"),
            Event::Line("$23=3"),
            Event::Line("ok"),
            Event::Command("home"),
            Event::Line("ok"),
            Event::Line(at_home),
            Event::Line(at_home),
        ] {
            play.step(&event);
        }
        assert!(play.known && play.session.is_ready());
        play
    }

    fn step(&mut self, event: &Event) {
        let actions = match event {
            Event::Wait(ms) => return self.wait(Duration::from_millis(*ms)),
            Event::Line(line) => self.session.receive(self.now, format!("{line}\n").as_bytes()),
            Event::Command("stop") => {
                let actions = self.session.stop(self.now);
                if let Some(first) = actions.first() {
                    let stops = matches!(first, Action::Send(bytes) if matches!(bytes[..], [b'!' | 0x18]));
                    assert!(stops, "a stop begins with {first:?}");
                }
                actions
            }
            Event::Command(text) => {
                self.in_hand += usize::from(self.session.deadline().is_some());
                let actions = command(&mut self.session, self.now, text);
                let moves = actions
                    .iter()
                    .any(|a| matches!(a, Action::Move(b) if matches!(b[..], [b'X'..=b'Z', ..] | [b'G', b'5', b'3', ..])));
                assert!(!moves || self.known, "a move on a stage that is not homed");
                actions
            }
        };
        self.check(&actions);
    }

    fn wait(&mut self, time: Duration) {
        let until = self.now + time;
        while let Some(due) = self.session.deadline().filter(|due| *due <= until) {
            self.now = self.now.max(due);
            let actions = self.session.timer(self.now);
            self.check(&actions);
        }
        self.now = until;
    }

    fn check(&mut self, actions: &[Action]) {
        for action in actions {
            match action {
                Action::Done(_) => self.in_hand = self.in_hand.checked_sub(1).expect("a command ended twice"),
                Action::Report(report) => match report.status {
                    Status::Idle => self.known = true,
                    Status::Unhomed | Status::Alarm | Status::Homing => self.known = false,
                    Status::Moving | Status::Hold => {}
                },
                Action::Failed(_) => assert_eq!(self.session.deadline(), None),
                Action::Send(bytes) | Action::Move(bytes) => {
                    let writes = bytes.contains(&b'=') || bytes.contains(&b'~');
                    assert!(!writes, "a setting is written, or a hold given up: {bytes:?}");
                }
                Action::Connected(_) | Action::Suspect { .. } => {}
            }
        }
        assert!(!self.session.is_ready() || self.in_hand == 0, "ready with a command in hand");
    }
}

proptest! {
    /// Whatever a controller says and whenever: a command ends once, unless the session fails; a stop puts a
    /// stopping byte first, unless one is on its way; a move needs a homed stage. And if in the end the
    /// controller says one thing for ever, no command is waited for for ever.
    #[test]
    fn any_dialogue(events in prop::collection::vec(event(), 0..60), drone in prop::option::of(line())) {
        let mut play = Play::homed();
        for event in &events {
            play.step(event);
        }
        for _ in 0..2000 {
            play.step(&Event::Wait(50));
            if let Some(line) = drone {
                play.step(&Event::Line(line));
            }
        }
        prop_assert!(play.in_hand == 0 || play.session.deadline().is_none(), "a command without end");
    }
}
