//! What a `zaber-ascii` stage may send, whatever is asked of it: no conversation panics, and every command ends once at most.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{Happening, happenings};
use tactus_wire::zaber::{Action, Axis, Config, Direction, Session};

fuzz_target!(|input: &[u8]| {
    let mut session = session();
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
});

fn session() -> Session {
    let axis = |number| {
        Some(Axis {
            device: 1,
            number,
            um_per_microstep: 0.05,
            direction: Direction::Positive,
            origin_microsteps: 0,
        })
    };
    let config = Config {
        axes: [axis(1), axis(2), axis(3)],
        tolerance_mm: 0.005,
        accel_mm_per_s2: None,
        homing_speed_mm_per_s: None,
        checksums: false,
        trusts_reference: true,
    };
    match Session::new(config) {
        Ok(session) => session,
        Err(error) => unreachable!("three axes of one device: {error}"),
    }
}
