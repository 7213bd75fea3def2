//! A straight move under way: its G-code line, and how reports are judged.

use core::time::Duration;

use super::Config;
use super::number::{round_to_um, short};
use crate::stage::{ArrivalCheck, AxisName, Course, Judgement, Shape, distance_mm};

/// How a line says where to go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// By the coordinates of every axis in the machine frame: shows whether reports and parser agree.
    Absolute,
    /// By how far.
    Increments,
}

/// A move under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveMove {
    arrival: ArrivalCheck,
    course: Course,
    line: String,
    way: Way,
    /// Where the controller's parser stands after the line, in its coordinates.
    parsed_mm: [f64; 3],
    sent: Duration,
    /// When the controller accepted the line, or showed that it executes it.
    accepted: Option<Duration>,
}

impl ActiveMove {
    /// A move that starts now from `base_mm`, in the controller's coordinates. The target is rounded to the three decimals
    /// that are sent. `None` if no axis moves.
    ///
    /// By increments, the line has the axes that move, and nothing else: see `docs/decisions/0020-a-damaged-byte.md`.
    pub(super) fn new(
        now: Duration,
        config: &Config,
        (base_mm, target_mm): ([f64; 3], [f64; 3]),
        speed_mm_per_s: f64,
        way: Way,
    ) -> Option<Self> {
        let machine_mm = config.to_machine(target_mm).map(round_to_um);
        let (mut words, mut parsed_mm) = (String::new(), base_mm);
        let mut moves = false;
        for name in AxisName::ALL {
            let way_mm = round_to_um(name.of(machine_mm) - name.of(base_mm));
            moves |= way_mm != 0.0;
            if way_mm != 0.0 || way == Way::Absolute {
                let number = match way {
                    Way::Absolute => name.of(machine_mm),
                    Way::Increments => way_mm,
                };
                words.push_str(name.of(["X", "Y", "Z"]));
                words.push_str(&short(number));
                name.set(&mut parsed_mm, name.of(base_mm) + way_mm);
            }
        }
        let machine_frame = if way == Way::Absolute { "G53" } else { "" };
        let (from_mm, target_mm) = (config.to_stage(base_mm), config.to_stage(parsed_mm));
        let expected_s = distance_mm(from_mm, target_mm) / speed_mm_per_s;
        moves.then(|| Self {
            arrival: ArrivalCheck::new(now, target_mm, expected_s),
            course: Course::new(now, from_mm, target_mm, speed_mm_per_s, Shape::Line),
            line: format!("{machine_frame}{words}"),
            way,
            parsed_mm,
            sent: now,
            accepted: None,
        })
    }

    /// The line to send, without its end.
    pub(super) fn line(&self) -> &str {
        &self.line
    }

    /// True if its arrival shows that reports have no offset.
    pub(super) fn is_absolute(&self) -> bool {
        self.way == Way::Absolute
    }

    pub(super) fn arrival(&self) -> &ArrivalCheck {
        &self.arrival
    }

    /// Where the controller's parser stands after the line, in its coordinates.
    pub(super) fn parsed_mm(&self) -> [f64; 3] {
        self.parsed_mm
    }

    /// True if the line has not been accepted yet.
    pub(super) fn awaits_ok(&self) -> bool {
        self.accepted.is_none()
    }

    pub(super) fn accept(&mut self, now: Duration) {
        self.accepted.get_or_insert(now);
    }

    /// True if the stage cannot be here if it is on the way to the target.
    pub(super) fn strays(&self, now: Duration, position_mm: [f64; 3], tolerance_mm: f64) -> bool {
        self.course.strays(now, position_mm, tolerance_mm)
    }

    /// Judges a report received now that was requested at `asked`.
    ///
    /// The controller counts as having accepted the line if it said `ok`, or if a report that was requested after the line
    /// shows motion: an `ok` may be lost. A report that was requested before does not show that the move has ended.
    pub(super) fn judge(
        &mut self,
        now: Duration,
        asked: Option<Duration>,
        (stands, moves): (bool, bool),
        position_mm: [f64; 3],
        tolerance_mm: f64,
    ) -> Judgement {
        if moves && let Some(asked) = asked.filter(|asked| *asked >= self.sent) {
            self.accept(asked);
        }
        let asked_after_ok = asked.zip(self.accepted).is_some_and(|(asked, accepted)| asked >= accepted);
        self.arrival.judge(now, stands && asked_after_ok, position_mm, tolerance_mm)
    }
}
