//! A controller that speaks `grbl`: its states, what time does to them, and its real-time commands.
//!
//! It reproduces the observed behaviour of Grbl 1.1, as far as a stage needs it: straight moves, jogs, hold and resume,
//! reset, homing, limits, alarms, settings. Each move begins and ends at rest. Machine and work coordinates are the
//! same, unless the fault `work-offset` sets them apart; the rig file gives their directions in the robot frame. `$I` and a message after the banner say that it is simulated.

mod gcode;
mod input;
mod lines;
mod report;
mod settings;

use std::time::Duration;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tokio::time::Instant;

use super::Controller;
use crate::faults::ControllerFault;
use crate::motion::Point;
use crate::outbox::Outbox;
use crate::truth::RandomStream;
use crate::world::SharedWorld;
use gcode::{GrblError, MotionMode};
use input::{Input, RealTime};
use report::Status;
use settings::Settings;
use tactus_wire::grbl::{Axis, Config};
use tactus_wire::stage::Direction;

/// A status report leaves this long after its request.
const REPORT_LATENCY_MS: std::ops::RangeInclusive<u64> = 2..=5;

/// From a reset to the banner.
const RESTART: Duration = Duration::from_millis(5);

/// Alarms after which the controller accepts only a reset.
const CRITICAL_ALARMS: std::ops::RangeInclusive<u8> = 1..=2;

const ALARM_HARD_LIMIT: u8 = 1;
const ALARM_SOFT_LIMIT: u8 = 2;
const ALARM_RESET_IN_MOTION: u8 = 3;
const ALARM_HOMING_RESET: u8 = 6;
const ALARM_HOMING_FAILED: u8 = 9;

/// A virtual Grbl controller.
#[derive(Debug)]
pub(super) struct GrblController {
    world: SharedWorld,
    /// Relates its coordinates to the robot frame.
    frame: Config,
    settings: Settings,
    mode: Mode,
    modal: Modal,
    input: Input,
    outbox: Outbox,
    report_due: Option<Instant>,
    reports: u32,
    /// Until then a command is being executed; then `ok` is sent. No other line is taken meanwhile.
    busy_until: Option<Instant>,
    /// When the tip hits a limit switch.
    limit_at: Option<Instant>,
    rng: ChaCha8Rng,
    defects: Defects,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// Idle, or executing planned moves.
    Ready,
    Jog,
    /// Braking or at rest; the remaining moves are held.
    Hold,
    /// Braking at the end of a jog that was cancelled.
    JogCancel,
    /// Braking for a target beyond the travel.
    SoftLimit,
    Homing {
        gives_up_at: Option<Instant>,
    },
    Alarm {
        is_critical: bool,
    },
}

/// Modal state: set by lines, valid for the lines after them.
#[derive(Debug, Default)]
struct Modal {
    motion: MotionMode,
    relative: bool,
    feed_mm_per_min: Option<f64>,
}

/// Its lasting faults.
#[derive(Debug, Default)]
struct Defects {
    lie_z_mm: f64,
    /// Origin of the work frame, in the machine frame.
    work_offset_mm: Point,
    is_never_idle: bool,
    ignores_moves: bool,
    refuses_next: Option<u8>,
    homing_fails: bool,
}

impl Controller for GrblController {
    fn receive(&mut self, bytes: &[u8], now: Instant) {
        self.wake(now);
        for byte in bytes {
            if let Some(command) = self.input.push(*byte) {
                self.execute_real_time(command, now);
            }
            self.take_lines(now);
        }
    }

    fn wake(&mut self, now: Instant) {
        self.only_move(now);
        if self.report_due.is_some_and(|due| due <= now) {
            self.report_due = None;
            self.report(now);
        }
        if self.busy_until.is_some_and(|until| until <= now) {
            self.busy_until = None;
            self.say(report::OK, now);
        }
        self.take_lines(now);
    }

    fn only_move(&mut self, now: Instant) {
        if let Some(at) = self.limit_at.filter(|at| *at <= now) {
            self.alarm(ALARM_HARD_LIMIT, at);
        }
        self.world.lock().settle(now);
        if self.is_moving() {
            return;
        }
        self.limit_at = None;
        match self.mode {
            Mode::Jog => self.mode = Mode::Ready,
            Mode::JogCancel => {
                self.world.lock().motion.forget_held();
                self.mode = Mode::Ready;
            }
            Mode::SoftLimit => self.alarm(ALARM_SOFT_LIMIT, now),
            Mode::Homing { gives_up_at: None } => {
                let home_mm = self.home_mm();
                self.world.lock().motion.believe(home_mm);
                self.mode = Mode::Ready;
                self.say(report::OK, now);
            }
            Mode::Homing { gives_up_at: Some(at) } if at <= now => self.alarm(ALARM_HOMING_FAILED, now),
            Mode::Homing { .. } | Mode::Ready | Mode::Hold | Mode::Alarm { .. } => {}
        }
    }

    fn next_wake(&self) -> Option<Instant> {
        let gives_up_at = if let Mode::Homing { gives_up_at } = self.mode { gives_up_at } else { None };
        let move_ends = self.world.lock().motion.next_end();
        [self.outbox.next_due(), self.report_due, self.busy_until, self.limit_at, gives_up_at, move_ends]
            .into_iter()
            .flatten()
            .min()
    }

    fn limit_at(&self) -> Option<Instant> {
        self.limit_at
    }

    fn output(&mut self, now: Instant) -> Vec<u8> {
        self.outbox.take_due(now)
    }

    fn fault(&mut self, fault: ControllerFault, now: Instant) {
        self.only_move(now);
        match fault {
            ControllerFault::Alarm(code) => self.alarm(code, now),
            ControllerFault::Lie { z_mm } => self.defects.lie_z_mm = z_mm,
            ControllerFault::WorkOffset { mm } => {
                let axis = self.frame.axes[2].machine;
                axis.set(&mut self.defects.work_offset_mm, mm);
            }
            ControllerFault::NeverIdle => self.defects.is_never_idle = true,
            ControllerFault::Refuse(code) => self.defects.refuses_next = Some(code),
            ControllerFault::IgnoreMoves => self.defects.ignores_moves = true,
            ControllerFault::LostSteps { lost_mm } => self.world.lock().motion.lose_steps(lost_mm),
            ControllerFault::HomingFails => self.defects.homing_fails = true,
            ControllerFault::Reset => {
                self.world.lock().motion.freeze(now);
                self.power_up(now);
            }
        }
    }

    fn mend(&mut self) {
        self.defects = Defects::default();
    }
}

impl GrblController {
    pub(super) fn new(world: SharedWorld, frame: Config, now: Instant) -> Self {
        let truth = world.lock().truth().clone();
        let mut controller = Self {
            world,
            frame,
            settings: Settings::of(&truth.stage, &frame),
            mode: Mode::Ready,
            modal: Modal::default(),
            input: Input::default(),
            outbox: Outbox::default(),
            report_due: None,
            reports: 0,
            busy_until: None,
            limit_at: None,
            rng: RandomStream::StageController.rng(truth.seed),
            defects: Defects::default(),
        };
        controller.power_up(now);
        controller
    }

    /// Restarts as after a power failure: the controller believes that it is at 0.
    fn power_up(&mut self, now: Instant) {
        let believed_mm = self.frame.to_stage([0.0; 3]);
        self.world.lock().motion.believe(believed_mm);
        self.mode = if self.settings.has_homing() { Mode::Alarm { is_critical: false } } else { Mode::Ready };
        if self.rng.random() {
            // The real firmware sometimes says this: the stored settings could not be read.
            self.outbox.push(now + RESTART, report::error(GrblError(7)));
        }
        self.restart(now);
    }

    /// Resets everything except the position and an alarm.
    fn restart(&mut self, now: Instant) {
        self.modal = Modal::default();
        self.input.clear();
        self.report_due = None;
        self.reports = 0;
        self.busy_until = None;
        self.limit_at = None;
        self.outbox.push(now + RESTART, report::BANNER);
        if matches!(self.mode, Mode::Alarm { .. }) {
            self.outbox.push(now + RESTART, report::UNLOCK);
        }
    }

    fn execute_real_time(&mut self, command: RealTime, now: Instant) {
        match (command, self.mode) {
            (RealTime::Report, Mode::Homing { .. }) => {}
            (RealTime::Report, _) => self.ask_for_report(now),
            (RealTime::Reset, _) => self.reset(now),
            (RealTime::Hold, Mode::Ready) => self.brake(Mode::Hold, now),
            (RealTime::Hold | RealTime::CancelJog, Mode::Jog) => self.brake(Mode::JogCancel, now),
            (RealTime::Resume, Mode::Hold) if !self.is_moving() => {
                self.mode = Mode::Ready;
                self.world.lock().motion.resume(now);
                self.watch_limits();
            }
            (RealTime::Hold | RealTime::Resume | RealTime::CancelJog, _) => {}
        }
    }

    fn brake(&mut self, mode: Mode, now: Instant) {
        self.mode = mode;
        self.world.lock().motion.hold(now);
        self.watch_limits();
        self.only_move(now);
    }

    /// Restarts the controller; motion stops at once.
    fn reset(&mut self, now: Instant) {
        let is_moving = self.is_moving();
        self.world.lock().motion.freeze(now);
        match self.mode {
            Mode::Homing { .. } => self.alarm(ALARM_HOMING_RESET, now),
            // The real firmware notices this only sometimes.
            _ if is_moving && self.rng.random() => self.alarm(ALARM_RESET_IN_MOTION, now),
            Mode::Alarm { .. } => {}
            Mode::Ready | Mode::Jog | Mode::Hold | Mode::JogCancel | Mode::SoftLimit => {
                self.mode = Mode::Ready;
            }
        }
        if let Mode::Alarm { is_critical } = &mut self.mode {
            *is_critical = false;
        }
        self.restart(now);
    }

    /// Stops at once and raises an alarm.
    fn alarm(&mut self, code: u8, now: Instant) {
        {
            let mut world = self.world.lock();
            world.settle(now);
            world.motion.freeze(now);
        }
        self.limit_at = None;
        let is_critical = CRITICAL_ALARMS.contains(&code);
        self.mode = Mode::Alarm { is_critical };
        self.outbox.push(now, report::alarm(code));
        if is_critical {
            self.outbox.push(now, report::RESET_TO_CONTINUE);
        }
    }

    /// Ends of the travel that homing goes to (`$23`).
    fn home_ends_mm(&self) -> Point {
        let travel_mm = self.world.lock().truth().stage.travel_mm;
        std::array::from_fn(|axis| {
            let [least, greatest] = travel_mm[axis];
            if self.homes_to_least(axis) { least } else { greatest }
        })
    }

    /// Position at the end of homing: off the switches.
    fn home_mm(&self) -> Point {
        let (ends_mm, pull_off_mm) = (self.home_ends_mm(), self.settings.pull_off_mm());
        std::array::from_fn(|axis| {
            ends_mm[axis] + if self.homes_to_least(axis) { pull_off_mm } else { -pull_off_mm }
        })
    }

    /// True if an axis of the robot frame homes to its least coordinate.
    fn homes_to_least(&self, axis: usize) -> bool {
        let Axis { machine, direction, .. } = self.frame.axes[axis];
        self.settings.homes_down(machine) == (direction == Direction::Positive)
    }

    fn watch_limits(&mut self) {
        let world = self.world.lock();
        let travel_mm = world.truth().stage.travel_mm;
        self.limit_at = if self.settings.has_hard_limits() { world.motion.leaves(travel_mm) } else { None };
    }

    fn is_moving(&self) -> bool {
        self.world.lock().motion.is_moving()
    }

    fn say(&mut self, text: &str, now: Instant) {
        self.outbox.push(now, text);
    }

    /// Schedules a report, unless one is already due.
    fn ask_for_report(&mut self, now: Instant) {
        if self.report_due.is_none() {
            self.report_due = Some(now + Duration::from_millis(self.rng.random_range(REPORT_LATENCY_MS)));
        }
    }

    fn report(&mut self, now: Instant) {
        let world = self.world.lock();
        let is_moving = world.motion.is_moving();
        let [x, y, z] = world.believed_mm(now);
        let status = Status {
            state: match self.mode {
                _ if self.defects.is_never_idle => "Run",
                Mode::Ready if is_moving => "Run",
                Mode::Ready => "Idle",
                Mode::Jog | Mode::JogCancel => "Jog",
                Mode::Hold | Mode::SoftLimit if is_moving => "Hold:1",
                Mode::Hold | Mode::SoftLimit => "Hold:0",
                Mode::Homing { .. } => "Home",
                Mode::Alarm { .. } => "Alarm",
            },
            machine_mm: self.frame.to_machine([x, y, z + self.defects.lie_z_mm]),
            work_offset_mm: self.defects.work_offset_mm,
            is_machine_position: self.settings.reports_machine_position(),
            buffers: self
                .settings
                .reports_buffers()
                .then(|| (world.motion.pending(), self.input.free_bytes())),
            speed_mm_per_s: world.motion.speed_mm_per_s(now),
            number: self.reports,
        };
        drop(world);
        self.reports += 1;
        self.outbox.push(now, status.line());
    }
}

#[cfg(test)]
#[path = "grbl_tests.rs"]
mod tests;
