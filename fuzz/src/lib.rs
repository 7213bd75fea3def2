//! Shared by the fuzz targets: turns a fuzzer's input into reads of a link and into events of a session, into a damaged file, and
//! counts what an input costs.

mod edits;
pub mod memory;
mod scratch;

use std::time::Duration;

use tactus_wire::{sensor, stage};

pub use edits::edited;
pub use scratch::Scratch;

/// Most bytes that arrive together.
const ARRIVAL_MAX_BYTES: usize = 64;

/// Cuts the second half of the input into arrivals. The bytes of the first half give their lengths.
///
/// Returns the uncut second half, and the arrivals.
pub fn arrivals(input: &[u8]) -> (&[u8], Vec<&[u8]>) {
    let (lengths, whole) = input.split_at(input.len() / 2);
    let mut rest = whole;
    let mut arrivals = Vec::new();
    for length in lengths {
        let (arrival, behind) = rest.split_at((usize::from(*length) % ARRIVAL_MAX_BYTES).min(rest.len()));
        arrivals.push(arrival);
        rest = behind;
    }
    arrivals.push(rest);
    (whole, arrivals)
}

/// One event of a session.
#[derive(Debug, Clone, Copy)]
pub enum SessionEvent<'a> {
    /// These bytes arrive.
    Bytes(&'a [u8]),
    /// Time passes until the session's deadline.
    Deadline,
    /// A stage is given a command; the number selects which. A sensor's session takes it as a deadline.
    Command(u8),
    /// Time passes.
    Pause(Duration),
}

/// Reads the input as a list of events.
pub fn events(mut input: &[u8]) -> Vec<SessionEvent<'_>> {
    let mut events = Vec::new();
    while let [kind, rest @ ..] = input {
        input = rest;
        events.push(match kind {
            0..=31 => SessionEvent::Deadline,
            32..=63 => SessionEvent::Pause(Duration::from_millis(u64::from(*kind))),
            64..=95 => SessionEvent::Command(*kind - 64),
            _ => {
                let (bytes, rest) = input.split_at(usize::from(*kind - 95).min(input.len()));
                input = rest;
                SessionEvent::Bytes(bytes)
            }
        });
    }
    events
}

/// Runs a sensor's session through the events.
///
/// # Panics
/// If a reading has another number of elements, or lists a bad one that does not exist.
pub fn run_sensor(mut session: impl sensor::Session, elements: usize, input: &[u8]) {
    let mut now = Duration::ZERO;
    let mut actions = session.start(now);
    for event in events(input) {
        for action in actions {
            if let sensor::Action::Reading(reading) = action {
                assert_eq!(reading.counts.len(), elements);
                assert!(reading.bad.iter().all(|bad| usize::try_from(*bad).is_ok_and(|bad| bad < elements)));
            }
        }
        actions = match event {
            SessionEvent::Bytes(bytes) => session.receive(now, bytes),
            SessionEvent::Pause(pause) => {
                now += pause;
                Vec::new()
            }
            SessionEvent::Deadline | SessionEvent::Command(_) => {
                now = session.deadline().unwrap_or(now).max(now);
                session.timer(now)
            }
        };
    }
}

/// Runs a stage's session through the events, with commands at any time.
///
/// # Panics
/// If a command ends twice, or one that was never given.
pub fn run_stage(mut session: impl stage::Session, input: &[u8]) {
    let mut now = Duration::ZERO;
    let (mut asked, mut done) = (0, 0);
    let mut actions = session.start(now);
    for event in events(input) {
        done += actions.iter().filter(|action| matches!(action, stage::Action::Done(_))).count();
        assert!(done <= asked, "a command ended twice, or one that was never given");
        if actions.iter().any(|action| matches!(action, stage::Action::Failed(_))) {
            return;
        }
        actions = match event {
            SessionEvent::Bytes(bytes) => session.receive(now, bytes),
            SessionEvent::Deadline => {
                now = session.deadline().unwrap_or(now).max(now);
                session.timer(now)
            }
            SessionEvent::Pause(pause) => {
                now += pause;
                Vec::new()
            }
            SessionEvent::Command(3) => session.stop(now),
            SessionEvent::Command(_) if !session.is_ready() => Vec::new(),
            SessionEvent::Command(kind) => {
                asked += 1;
                match kind {
                    0 => session.home(now),
                    1 => session.clear_alarm(now),
                    2 => session.look(now),
                    _ => session.move_to(now, [f64::from(kind), 0.5, -0.25], 10.0),
                }
            }
        };
    }
}
