//! The host's side of a connection to Zaber devices.

mod axis_state;
mod conclude;
mod error;
mod handle;
mod phase;
mod request;
mod step;

use core::time::Duration;
use std::collections::VecDeque;

use axis_state::AxisState;
use phase::{ActiveMove, Phase};
use request::{Pending, Request, SlotRequest};

use super::path::axis_move;
use super::{Config, ConfigError, Decoder, Flag, HostCommand};
use crate::stage::{
    self, Alarm, ArrivalCheck, AxisName, Cause, Course, Failure, Session as _, Setting, Shape, distance_mm,
};

pub use error::SessionError;

type Action = stage::Action<SessionError>;

/// Longest time for homing. The longest axes take about a minute at Zaber's default approach speeds.
const HOMING_TIMEOUT: Duration = Duration::from_mins(2);

/// The host's side of one connection to all devices of a stage; see [`stage::Session`].
///
/// One request is pending at a time, and its answer has the same message id. Only a stop overtakes it. So no axis ever has
/// more than one pending move. An unanswered query or setting is sent again. An unanswered move or homing is never sent
/// again: the stage is stopped instead.
///
/// The position counts as known from a successful homing; with [`Config::trusts_reference`] also from the start, if the
/// stage reports a reference position. It becomes unknown by a fault, a lost reference (which shows a restart), or an
/// emergency stop.
#[derive(Debug)]
pub struct Session {
    config: Config,
    decoder: Decoder,
    axes: Vec<AxisState>,
    phase: Phase,
    /// Requests of the present batch or round that have not been sent.
    queue: VecDeque<SlotRequest>,
    pending: Option<Pending>,
    last_id: u8,
    /// When the last round of position queries began.
    round_began: Option<Duration>,
    /// When that round ended; `None` while it is under way.
    round_ended: Option<Duration>,
    /// The next round does not wait for the interval.
    at_once: bool,
    homed: bool,
    alarm: Option<Alarm>,
    identity: String,
    ignored: u64,
    actions: Vec<Action>,
}

impl Session {
    /// A session that has not started.
    ///
    /// # Errors
    /// If the configuration is invalid; see [`Config::check`].
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        config.check()?;
        let axes = config.named_axes().map(|(name, axis)| AxisState::new(name, axis)).collect();
        Ok(Self {
            config,
            decoder: Decoder::default(),
            axes,
            phase: Phase::Over,
            queue: VecDeque::new(),
            pending: None,
            last_id: 99,
            round_began: None,
            round_ended: None,
            at_once: false,
            homed: false,
            alarm: None,
            identity: String::new(),
            ignored: 0,
            actions: Vec::new(),
        })
    }

    /// The axes' travel, in mm.
    fn settings(&self) -> Vec<Setting> {
        let told = |state: &AxisState| Setting {
            name: "limit.min, limit.max".to_owned(),
            value: format!("{}, {}", state.limit_min, state.limit_max),
            meaning: format!("{}: {}", state.name, state.travel()),
        };
        self.axes.iter().map(told).collect()
    }

    /// Queues the moves of the axes; `None` if the stage already stands at the target.
    fn plan(
        &mut self,
        now: Duration,
        command: &str,
        target_mm: [f64; 3],
        speed_mm_per_s: f64,
    ) -> Result<Option<ActiveMove>, Failure> {
        let mut targets = Vec::new();
        let mut reached_mm = [0.0; 3];
        for (slot, state) in self.axes.iter().enumerate() {
            let wanted_mm = state.name.of(target_mm);
            let target = state.axis.microsteps(wanted_mm).filter(|target| state.allows(*target));
            let Some(target) = target else {
                let reason = format!("{} cannot go to {wanted_mm:.3} mm: {}", state.name, state.travel());
                return Err(Failure::Refused { command: command.to_owned(), reason });
            };
            state.name.set(&mut reached_mm, state.axis.position_mm(target));
            targets.push((slot, target));
        }
        targets.retain(|(slot, target)| self.axes.get(*slot).is_some_and(|state| state.position != *target));
        if targets.is_empty() {
            return Ok(None);
        }
        let from_mm = self.position_mm();
        let path_mm = distance_mm(from_mm, reached_mm);
        let accel = self.config.accel_mm_per_s2;
        let (mut settings, mut moves) = (Vec::new(), Vec::new());
        for (slot, target) in targets {
            let Some(state) = self.axes.get(slot) else { continue };
            let way_mm = state.name.of(reached_mm) - state.name.of(from_mm);
            let Some(axis_move) = axis_move(&state.axis, target, way_mm, path_mm, speed_mm_per_s, accel)
            else {
                let reason = format!("the speed is outside the range of the controller of {}", state.name);
                return Err(Failure::Refused { command: command.to_owned(), reason });
            };
            settings.push(SlotRequest { slot, request: Request::Speed(axis_move.speed) });
            settings
                .extend(axis_move.accel.map(|accel| SlotRequest { slot, request: Request::Accel(accel) }));
            moves.push(SlotRequest { slot, request: Request::Move(axis_move.target_microsteps) });
        }
        self.begin_batch();
        self.queue.extend(settings.into_iter().chain(moves));
        let expected_s = path_mm / speed_mm_per_s + accel.map_or(0.0, |accel| speed_mm_per_s / accel);
        let arrival = ArrivalCheck::new(now, reached_mm, expected_s);
        let course = Course::new(now, from_mm, reached_mm, speed_mm_per_s, Shape::Box);
        let command = command.to_owned();
        Ok(Some(ActiveMove { command, arrival, course, set_out: false }))
    }

    fn is_over(&self) -> bool {
        matches!(self.phase, Phase::Over)
    }

    fn check_ready(&self, command: &str) -> Result<(), Failure> {
        if self.is_ready() { Ok(()) } else { Err(Failure::refused(command, "another command is under way")) }
    }

    fn check_stands(&self, command: &str) -> Result<(), Failure> {
        if self.moves() {
            return Err(Failure::refused(command, "the stage is being moved, by its knob or another host"));
        }
        Ok(())
    }

    fn check_alarm(&self) -> Result<(), Failure> {
        self.alarm.map_or(Ok(()), |alarm| Err(Failure::Alarm(alarm)))
    }

    fn check_homed(&self) -> Result<(), Failure> {
        if self.homed { Ok(()) } else { Err(Failure::Unhomed) }
    }

    fn check_numbers(&self, command: &str, target_mm: [f64; 3], speed_mm_per_s: f64) -> Result<(), Failure> {
        if !target_mm.iter().all(|mm| mm.is_finite()) {
            return Err(Failure::refused(command, "the target is not finite"));
        }
        let missing = AxisName::ALL
            .into_iter()
            .filter(|name| self.axes.iter().all(|state| state.name != *name))
            .any(|name| name.of(target_mm).abs() > self.config.tolerance_mm);
        if missing {
            return Err(Failure::refused(command, "the target needs an axis that the stage lacks"));
        }
        if !(speed_mm_per_s.is_finite() && speed_mm_per_s > 0.0) {
            return Err(Failure::refused(command, "the speed is too low or not a number"));
        }
        Ok(())
    }
}

impl stage::Session for Session {
    type Error = SessionError;

    fn cause(error: &SessionError) -> Cause {
        error.cause()
    }

    fn is_ready(&self) -> bool {
        matches!(self.phase, Phase::Ready)
    }

    fn is_stopping(&self) -> bool {
        matches!(self.phase, Phase::Stopping(_))
    }

    fn deadline(&self) -> Option<Duration> {
        let answer = self.pending.as_ref().map(Pending::overdue);
        [self.phase.deadline(), answer, self.next_round()].into_iter().flatten().min()
    }

    fn unknown_lines(&self) -> u64 {
        self.ignored + self.decoder.dropped()
    }

    /// Queries the identity, limits and position of each device and axis. Moves nothing, but stops a stage that is already
    /// moving.
    fn start(&mut self, now: Duration) -> Vec<Action> {
        self.phase = Phase::Greeting;
        let mut devices = Vec::new();
        for slot in 0..self.axes.len() {
            let device = self.device_of(slot);
            if !devices.contains(&device) {
                devices.push(device);
                if self.config.checksums {
                    self.queue.push_back(SlotRequest { slot, request: Request::Checksums });
                }
                self.queue.push_back(SlotRequest { slot, request: Request::Version });
            }
            self.queue.push_back(SlotRequest { slot, request: Request::AxisCount });
            if self.axes.get(slot).is_some_and(|state| state.axis.resolution.is_some()) {
                self.queue.push_back(SlotRequest { slot, request: Request::Resolution });
            }
            for request in [Request::LimitMin, Request::LimitMax, Request::Warnings, Request::Position] {
                self.queue.push_back(SlotRequest { slot, request });
            }
        }
        self.finish(now)
    }

    /// Homes z first, so that the tip is clear, then the others together.
    fn home(&mut self, now: Duration) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        let checked = self.check_ready("home").and_then(|()| self.check_alarm());
        if let Err(failure) = checked.and_then(|()| self.check_stands("home")) {
            self.done(Err(failure));
            return self.finish(now);
        }
        self.homed = false;
        let is_z = |slot: &usize| self.axes.get(*slot).is_some_and(|state| state.name == AxisName::Z);
        let (first, then): (Vec<usize>, Vec<usize>) = (0..self.axes.len()).partition(is_z);
        self.phase = Phase::Homing { group: Vec::new(), then: Some(then), deadline: now + HOMING_TIMEOUT };
        self.home_group(first);
        self.report();
        self.finish(now)
    }

    /// Sets each axis to its component of the speed, so that all arrive at the same time.
    ///
    /// The axes start one after another, about 5 ms apart at 115200 baud (a request and its answer). The path deviates
    /// from a straight line accordingly.
    fn move_to(&mut self, now: Duration, target_mm: [f64; 3], speed_mm_per_s: f64) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        let [x, y, z] = target_mm;
        let command = format!("move to {x:.3} {y:.3} {z:.3} mm at {speed_mm_per_s:.3} mm/s");
        let checked = self
            .check_ready(&command)
            .and_then(|()| self.check_numbers(&command, target_mm, speed_mm_per_s))
            .and_then(|()| self.check_alarm())
            .and_then(|()| self.check_homed())
            .and_then(|()| self.check_stands(&command))
            .and_then(|()| self.plan(now, &command, target_mm, speed_mm_per_s));
        match checked {
            Err(failure) => self.done(Err(failure)),
            Ok(None) => self.begin_look(now, Some(target_mm)),
            Ok(Some(travel)) => {
                self.phase = Phase::Moving(travel);
            }
        }
        self.finish(now)
    }

    /// A new round of queries answers it.
    fn look(&mut self, now: Duration) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        match self.check_ready("get pos").and_then(|()| self.check_alarm()) {
            Err(failure) => self.done(Err(failure)),
            Ok(()) => self.begin_look(now, None),
        }
        self.finish(now)
    }

    /// Clears the warnings of every axis, and enables drivers that are off.
    fn clear_alarm(&mut self, now: Duration) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        if let Err(failure) = self.check_ready("warnings clear") {
            self.done(Err(failure));
        } else if self.alarm.is_none() {
            self.done(Ok(self.position_mm()));
        } else {
            self.homed = false;
            self.phase = Phase::Clearing;
            self.begin_batch();
            for slot in 0..self.axes.len() {
                self.queue.push_back(SlotRequest { slot, request: Request::Clear });
                let is_off = |state: &AxisState| state.fault.is_some_and(Flag::driver_is_off);
                if self.axes.get(slot).is_some_and(is_off) {
                    self.queue.push_back(SlotRequest { slot, request: Request::Enable });
                }
                self.queue.push_back(SlotRequest { slot, request: Request::Warnings });
            }
        }
        self.finish(now)
    }

    /// Stops all devices on the port. The axes decelerate and keep their position. The stop ends when every device has
    /// confirmed it and every axis reports standstill. If an axis still moves after 3 s, `estop` follows, and the
    /// position is then suspect.
    fn stop(&mut self, now: Duration) -> Vec<Action> {
        let stopped = Failure::Stopped { position_mm: self.position_mm() };
        match &self.phase {
            Phase::Over => {}
            Phase::Greeting => self.send_stop("stop"),
            Phase::Ready => self.halt_all(now, None),
            Phase::Moving(_) | Phase::Homing { .. } | Phase::Clearing | Phase::Looking { .. } => {
                self.halt_all(now, Some(stopped));
            }
            Phase::Stopping(stop) => {
                let text = stop.text();
                self.repeat_stop(now, text);
            }
        }
        self.finish(now)
    }

    /// Another axis may have set out already, so all are stopped.
    fn withhold(&mut self, now: Duration) -> Vec<Action> {
        if matches!(self.phase, Phase::Moving(_) | Phase::Homing { .. }) {
            self.halt_all(now, Some(Failure::Withheld));
        }
        self.finish(now)
    }

    fn halt(&self) -> Vec<u8> {
        HostCommand { device: 0, axis: 0, id: None, text: "stop".to_owned() }.encode(self.config.checksums)
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut decoder = core::mem::take(&mut self.decoder);
        decoder.push(bytes, |message| {
            self.handle(now, &message);
            // The answer to a request lets the next one go out, whatever else has arrived.
            self.proceed(now);
        });
        if self.needs_checksums() {
            decoder.require_checksums();
        }
        self.decoder = decoder;
        self.finish(now)
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        if self.phase.deadline().is_some_and(|deadline| now >= deadline) {
            self.overdue(now);
        }
        if self.pending.as_ref().is_some_and(|pending| now >= pending.overdue()) {
            self.unanswered(now);
        }
        self.finish(now)
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
