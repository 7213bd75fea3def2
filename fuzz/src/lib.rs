//! What the fuzz targets share: how a fuzzer's input becomes arrivals on a link.

use std::time::Duration;

use tactus_wire::stage::{Action, Session};

/// Bytes that arrive together, at most.
const ARRIVAL_MAX_BYTES: usize = 64;

/// Cuts what is behind the first half of the input into arrivals whose lengths the first half tells.
///
/// The whole that they make up stands first.
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

/// One thing that happens to a session.
#[derive(Debug, Clone, Copy)]
pub enum Happening<'a> {
    /// These bytes come.
    Bytes(&'a [u8]),
    /// Time passes until the session's deadline.
    Deadline,
    /// A person or a run asks for something; which, the number says.
    Command(u8),
    /// Time passes.
    Pause(Duration),
}

/// Reads the input as a list of what happens.
pub fn happenings(mut input: &[u8]) -> Vec<Happening<'_>> {
    let mut happenings = Vec::new();
    while let [kind, rest @ ..] = input {
        input = rest;
        happenings.push(match kind {
            0..=31 => Happening::Deadline,
            32..=63 => Happening::Pause(Duration::from_millis(u64::from(*kind))),
            64..=95 => Happening::Command(*kind - 64),
            _ => {
                let (bytes, rest) = input.split_at(usize::from(*kind - 95).min(input.len()));
                input = rest;
                Happening::Bytes(bytes)
            }
        });
    }
    happenings
}

/// Lets everything happen to a stage's session, whatever a person asks meanwhile.
///
/// # Panics
/// If a command ends twice, or one that was never given.
pub fn converse(mut session: impl Session, input: &[u8]) {
    let mut now = Duration::ZERO;
    let (mut asked, mut done) = (0, 0);
    let mut actions = session.start(now);
    for happening in happenings(input) {
        done += actions.iter().filter(|action| matches!(action, Action::Done(_))).count();
        assert!(done <= asked, "a command ended twice, or one that was never given");
        if actions.iter().any(|action| matches!(action, Action::Failed(_))) {
            return;
        }
        actions = match happening {
            Happening::Bytes(bytes) => session.receive(now, bytes),
            Happening::Deadline => {
                now = session.deadline().unwrap_or(now).max(now);
                session.timer(now)
            }
            Happening::Pause(pause) => {
                now += pause;
                Vec::new()
            }
            Happening::Command(3) => session.stop(now),
            Happening::Command(_) if !session.is_ready() => Vec::new(),
            Happening::Command(kind) => {
                asked += 1;
                match kind {
                    0 => session.home(now),
                    1 => session.clear_alarm(now),
                    _ => session.move_to(now, [f64::from(kind), 0.5, -0.25], 10.0),
                }
            }
        };
    }
}
