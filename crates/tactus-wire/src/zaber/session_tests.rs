//! Dialogues with a virtual stage on a virtual clock. What is said is logged, one line each: a time in ms, a
//! mark and a text: `>` bytes to the stage, `=` what the session tells.

#[path = "session_tests/any_dialogue.rs"]
mod any_dialogue;
#[path = "session_tests/connect.rs"]
mod connect;
#[path = "session_tests/fake.rs"]
mod fake;
#[path = "session_tests/faults.rs"]
mod faults;
#[path = "session_tests/looks.rs"]
mod looks;
#[path = "session_tests/moves.rs"]
mod moves;
#[path = "session_tests/stops.rs"]
mod stops;

use core::time::Duration;

use fake::Fake;

use super::{Action, Session};
use crate::stage::{Direction, Failure, Report, Session as _, Status};
use crate::zaber::{Axis, Config};

/// Bytes take this long, either way.
const LATENCY: Duration = Duration::from_millis(2);

/// x and y are axes of device 1; z is device 2, which counts down and stands at 0 mm when it is at 40000. A
/// microstep is 0.5 um.
fn config() -> Config {
    let axis = |device, number| Axis {
        device,
        number,
        um_per_microstep: 0.5,
        direction: Direction::Positive,
        origin_microsteps: 0,
        resolution: None,
    };
    let z = Axis { direction: Direction::Negative, origin_microsteps: 40_000, ..axis(2, 1) };
    Config {
        axes: [Some(axis(1, 1)), Some(axis(1, 2)), Some(z)],
        tolerance_mm: 0.002,
        accel_mm_per_s2: None,
        homing_speed_mm_per_s: None,
        checksums: false,
        trusts_reference: false,
    }
}

/// A session, the stage at its other end, and the time.
struct Play {
    session: Session,
    stage: Fake,
    now: Duration,
    /// What is on its way: when it arrives, and whether to the stage.
    under_way: Vec<(Duration, bool, Vec<u8>)>,
    log: Vec<String>,
    results: Vec<Result<[f64; 3], Failure>>,
    report: Option<Report>,
}

impl Play {
    fn new(config: Config) -> Self {
        let session = Session::new(config).unwrap();
        let stage = Fake::new();
        let (under_way, log, results) = (Vec::new(), Vec::new(), Vec::new());
        Self { session, stage, now: Duration::ZERO, under_way, log, results, report: None }
    }

    /// A stage that has been connected and homed; its log is empty.
    fn homed() -> Self {
        Self::homed_with(config())
    }

    fn homed_with(config: Config) -> Self {
        let mut play = Self::new(config);
        play.start();
        play.run(200);
        play.home();
        play.run(5000);
        assert_eq!(play.result(), Ok([0.0, 0.0, 20.0]));
        assert_eq!(play.status(), Status::Idle);
        play.log.clear();
        play
    }

    fn start(&mut self) {
        let actions = self.session.start(self.now);
        self.act(actions);
    }

    fn home(&mut self) {
        let actions = self.session.home(self.now);
        self.act(actions);
    }

    fn stop(&mut self) {
        let actions = self.session.stop(self.now);
        let says_stop = |bytes: &[u8]| String::from_utf8_lossy(bytes).contains("stop");
        assert!(matches!(&actions[..], [Action::Send(bytes), ..] if says_stop(bytes)), "{actions:?}");
        self.act(actions);
    }

    fn look(&mut self) {
        let actions = self.session.look(self.now);
        self.act(actions);
    }

    fn clear(&mut self) {
        let actions = self.session.clear_alarm(self.now);
        self.act(actions);
    }

    fn move_to(&mut self, target_mm: [f64; 3], speed_mm_per_s: f64) {
        let actions = self.session.move_to(self.now, target_mm, speed_mm_per_s);
        self.act(actions);
    }

    /// Lets some ms pass.
    fn run(&mut self, ms: u64) {
        let until = self.now + Duration::from_millis(ms);
        loop {
            let arrival = self.under_way.iter().map(|(at, ..)| *at).min();
            let timer = self.session.deadline().map(|at| at.max(self.now));
            // What arrives at the time of a timer is there first.
            let Some(next) = arrival.into_iter().chain(timer).min().filter(|next| *next <= until) else {
                break;
            };
            self.now = next;
            if let Some(at) = self.under_way.iter().position(|(at, ..)| *at == next) {
                let (_, to_stage, bytes) = self.under_way.remove(at);
                if to_stage {
                    for reply in self.stage.hear(next, &bytes) {
                        self.under_way.push((next + LATENCY, false, reply));
                    }
                } else {
                    let actions = self.session.receive(next, &bytes);
                    self.act(actions);
                }
            } else {
                let actions = self.session.timer(next);
                self.act(actions);
            }
        }
        self.now = until;
    }

    fn result(&mut self) -> Result<[f64; 3], Failure> {
        assert_eq!(self.results.len(), 1, "{:?}\n{}", self.results, self.log.join("\n"));
        self.results.remove(0)
    }

    fn status(&self) -> Status {
        self.report.unwrap().status
    }

    /// What was said to the stage, without times and ids, and without the questions that are asked all the
    /// time.
    fn commands(&self) -> Vec<String> {
        let said = self.log.iter().filter_map(|line| line.split_once(" > ").map(|(_, said)| said));
        let without_id = said.map(|said| {
            let words: Vec<&str> = said.split(' ').collect();
            [&words[..2], &words[3..]].concat().join(" ")
        });
        without_id.filter(|said| !said.ends_with("get pos")).collect()
    }

    fn count(&self, text: &str) -> usize {
        self.log.iter().filter(|line| line.contains(text)).count()
    }

    fn act(&mut self, actions: Vec<Action>) {
        for action in actions {
            let text = match action {
                Action::Send(bytes) | Action::Move(bytes) => {
                    let text = format!("> {}", String::from_utf8_lossy(&bytes).trim_end());
                    self.under_way.push((self.now + LATENCY, true, bytes));
                    text
                }
                Action::Connected(controller) => format!("= connected {}", controller.identity),
                Action::Report(report) => {
                    self.report = Some(report);
                    let [x, y, z] = report.position_mm;
                    let alarm = report.alarm.map(|alarm| format!(" {}", alarm.name()));
                    format!("= {:?}{} {x:.3} {y:.3} {z:.3}", report.status, alarm.unwrap_or_default())
                }
                Action::Suspect { why } => format!("= suspect: {why}"),
                Action::Done(result) => {
                    self.results.push(result.clone());
                    format!("= done {result:?}")
                }
                Action::Failed(error) => format!("= failed: {error}"),
            };
            self.log.push(format!("{} {text}", self.now.as_millis()));
        }
    }
}
