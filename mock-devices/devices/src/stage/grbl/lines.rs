//! Execution of lines: `$` statements, jogs, G-code.

use std::time::Duration;

use rand::RngExt;
use tokio::time::Instant;

use super::gcode::{Block, GrblError, MotionMode};
use super::input::Line;
use super::{GrblController, Modal, Mode, report};
use crate::motion::Point;
use crate::stage::Controller as _;

/// Writing a setting blocks the controller for this long.
const SETTING_WRITE_MS: std::ops::RangeInclusive<u64> = 100..=220;

/// Homing that finds no switch gives up after this.
const HOMING_GIVES_UP: Duration = Duration::from_secs(24);

/// The answer to a line.
enum LineReply {
    Ok,
    Text(String),
    /// `ok` after a time.
    After(Duration),
    /// The answer comes at the end of the motion, or never.
    None,
}

impl GrblController {
    /// Executes waiting lines, as far as the controller accepts them.
    pub(super) fn take_lines(&mut self, now: Instant) {
        while self.input.has_line() && self.takes_a_line() {
            let Some(line) = self.input.take_line() else { return };
            let reply = match line {
                Line::Overflow => Err(GrblError::OVERFLOW),
                Line::Text(text) => self.execute(&text, now),
            };
            match reply {
                Ok(LineReply::Ok) => self.say(report::OK, now),
                Ok(LineReply::Text(text)) => {
                    self.outbox.push(now, text);
                    self.say(report::OK, now);
                }
                Ok(LineReply::After(duration)) => self.busy_until = Some(now + duration),
                Ok(LineReply::None) => {}
                Err(error) => self.outbox.push(now, report::error(error)),
            }
        }
    }

    /// False during a hold, and while the planner is full.
    fn takes_a_line(&self) -> bool {
        let is_open = matches!(self.mode, Mode::Ready | Mode::Jog | Mode::Alarm { .. });
        is_open && self.busy_until.is_none() && self.world.lock().motion.pending() < report::PLANNER_BLOCKS
    }

    fn execute(&mut self, line: &str, now: Instant) -> Result<LineReply, GrblError> {
        if self.mode == (Mode::Alarm { is_critical: true }) {
            return Err(GrblError::LOCKED);
        }
        match line.strip_prefix('$') {
            Some(statement) => self.execute_statement(statement, now),
            None if line.is_empty() => Ok(LineReply::Ok),
            None if matches!(self.mode, Mode::Alarm { .. } | Mode::Jog) => Err(GrblError::LOCKED),
            None => self.execute_gcode(line, now),
        }
    }

    fn execute_statement(&mut self, statement: &str, now: Instant) -> Result<LineReply, GrblError> {
        if let Some(jog) = statement.strip_prefix("J=") {
            return self.jog(jog, now);
        }
        match statement {
            "" => return Ok(LineReply::Text(report::HELP.to_owned())),
            "#" => return Ok(LineReply::Text(report::offsets(self.defects.work_offset_mm))),
            "G" => return Ok(LineReply::Text(self.modal.line())),
            _ => {}
        }
        let is_locked = matches!(self.mode, Mode::Alarm { .. });
        if !is_locked && (self.mode != Mode::Ready || self.is_moving()) {
            return Err(GrblError::NOT_IDLE);
        }
        match statement {
            "$" => Ok(LineReply::Text(self.settings.list())),
            "I" => Ok(LineReply::Text(report::BUILD.to_owned())),
            "X" if is_locked => {
                self.mode = Mode::Ready;
                Ok(LineReply::Text(report::UNLOCKED.to_owned()))
            }
            "X" => Ok(LineReply::Ok),
            "H" if !self.settings.has_homing() => Err(GrblError::HOMING_OFF),
            "H" => {
                self.home(now);
                Ok(LineReply::None)
            }
            _ => {
                self.settings.write(statement)?;
                Ok(LineReply::After(Duration::from_millis(self.rng.random_range(SETTING_WRITE_MS))))
            }
        }
    }

    fn execute_gcode(&mut self, line: &str, now: Instant) -> Result<LineReply, GrblError> {
        let block = Block::parse(line)?;
        if block.dwell {
            let dwell = Duration::from_secs_f64(block.dwell_s.ok_or(GrblError::NO_VALUE)?.min(1e6));
            let moves_end = self.world.lock().motion.last_end().unwrap_or(now);
            return Ok(LineReply::After(moves_end - now + dwell));
        }
        let motion = block.motion.unwrap_or(self.modal.motion);
        let feed_mm_per_min = block.feed_mm_per_min.or(self.modal.feed_mm_per_min);
        let relative = block.relative.unwrap_or(self.modal.relative);
        if block.has_axes() && motion == MotionMode::Feed && !feed_mm_per_min.is_some_and(|feed| feed > 0.0) {
            return Err(GrblError::NO_FEED);
        }
        self.modal = Modal { motion, relative, feed_mm_per_min };
        if !block.has_axes() {
            return Ok(LineReply::Ok);
        }
        if let Some(code) = self.defects.refuses_next.take() {
            return Err(GrblError(code));
        }
        let target_mm = self.target(&block, relative);
        if !self.is_within_travel(target_mm) {
            self.brake(Mode::SoftLimit, now);
            return Ok(LineReply::None);
        }
        let feed_mm_per_min = match motion {
            MotionMode::Rapid => self.settings.rapid_mm_per_min(),
            MotionMode::Feed => feed_mm_per_min.unwrap_or_default(),
        };
        self.plan(target_mm, feed_mm_per_min, now);
        Ok(LineReply::Ok)
    }

    fn jog(&mut self, line: &str, now: Instant) -> Result<LineReply, GrblError> {
        if !(self.mode == Mode::Jog || self.mode == Mode::Ready && !self.is_moving()) {
            return Err(GrblError::NOT_IDLE);
        }
        let block = Block::parse(line)?;
        if block.motion.is_some() || block.dwell || block.dwell_s.is_some() {
            return Err(GrblError::JOG);
        }
        let feed_mm_per_min = block.feed_mm_per_min.filter(|feed| *feed > 0.0).ok_or(GrblError::NO_FEED)?;
        if !block.has_axes() {
            return Err(GrblError::NO_AXIS);
        }
        if let Some(code) = self.defects.refuses_next.take() {
            return Err(GrblError(code));
        }
        let target_mm = self.target(&block, block.relative.unwrap_or(self.modal.relative));
        if !self.is_within_travel(target_mm) {
            return Err(GrblError::TRAVEL);
        }
        self.mode = Mode::Jog;
        self.plan(target_mm, feed_mm_per_min, now);
        self.only_move(now);
        Ok(LineReply::Ok)
    }

    fn target(&self, block: &Block, relative: bool) -> Point {
        let from_mm = self.frame.to_machine(self.world.lock().motion.destination_mm());
        self.frame.to_stage(std::array::from_fn(|axis| match block.axes_mm[axis] {
            Some(place_mm) if block.machine => place_mm,
            Some(way_mm) if relative => from_mm[axis] + way_mm,
            Some(place_mm) => place_mm + self.defects.work_offset_mm[axis],
            None => from_mm[axis],
        }))
    }

    fn is_within_travel(&self, target_mm: Point) -> bool {
        let travel_mm = self.world.lock().truth().stage.travel_mm;
        !self.settings.has_soft_limits()
            || target_mm.iter().zip(travel_mm).all(|(mm, [least, greatest])| (least..=greatest).contains(mm))
    }

    fn plan(&mut self, target_mm: Point, feed_mm_per_min: f64, now: Instant) {
        if self.defects.ignores_moves {
            return;
        }
        let speed_mm_per_s = self.settings.speed_mm_per_s(feed_mm_per_min);
        self.world.lock().motion.push(target_mm, speed_mm_per_s, now);
        self.watch_limits();
    }

    /// Homes: z to its switch first, then x and y, and off the switches again.
    fn home(&mut self, now: Instant) {
        // One report comes unasked; then `?` is not answered until the end.
        self.mode = Mode::Homing { gives_up_at: None };
        self.ask_for_report(now);
        if std::mem::take(&mut self.defects.homing_fails) {
            self.mode = Mode::Homing { gives_up_at: Some(now + HOMING_GIVES_UP) };
            return;
        }
        let [home_x, home_y, home_z] = self.home_mm();
        let [end_x, end_y, end_z] = self.home_ends_mm();
        let speed_mm_per_s = self.settings.seek_mm_per_s();
        let mut world = self.world.lock();
        world.motion.lose_steps(0.0);
        let [x, y, _] = world.motion.true_mm(now);
        let waypoints = [[x, y, end_z], [x, y, home_z], [end_x, end_y, home_z], [home_x, home_y, home_z]];
        for true_mm in waypoints {
            world.motion.push_true(true_mm, speed_mm_per_s, now);
        }
    }
}

impl Modal {
    /// What `$G` prints.
    fn line(&self) -> String {
        let motion = match self.motion {
            MotionMode::Rapid => 0,
            MotionMode::Feed => 1,
        };
        let distance = if self.relative { 91 } else { 90 };
        let feed = self.feed_mm_per_min.unwrap_or_default();
        format!("[GC:G{motion} G54 G17 G21 G{distance} G94 M5 M9 T0 F{feed:.0} S0]\r\n")
    }
}
