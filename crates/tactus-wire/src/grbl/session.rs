//! The host's side of a connection to a Grbl controller.

mod error;
mod handle;
mod phase;
mod step;

use core::time::Duration;

use phase::{Phase, Purpose, Wanted};

use super::feed::Feed;
use super::poll::StatusPoll;
use super::settings::Settings;
use super::work_frame::WorkFrame;
use super::{Config, ConfigError, FEED_HOLD, MachineState, Response, SOFT_RESET, alarm_meaning};
use crate::lines::Lines;
use crate::stage::{self, Alarm, Cause, Failure, Session as _, Whereabouts};

pub use error::SessionError;

type Action = stage::Action<SessionError>;

/// How long to wait for a banner that the controller sends when the port is opened.
const LISTEN: Duration = Duration::from_millis(500);

/// Longest time for homing. The controller itself gives up after about 24 s.
const HOMING_TIMEOUT: Duration = Duration::from_mins(1);

/// Lowest speed that can be sent: a feed in mm/min has three decimals.
const SPEED_MIN_MM_PER_S: f64 = 0.001 / 60.0;

/// Half of the reporting resolution. Positions closer than this are equal.
const SAME_PLACE_MM: f64 = 0.0005;

/// The host's side of one connection to a controller; see [`stage::Session`]. The controller's coordinates are those of its
/// machine frame. A controller with another work frame (`G54`, `G92`) is refused, because nobody would know which of the two
/// the rig file means.
///
/// The position counts as known from a successful homing until an alarm, a reset by others, or a stop that had to reset
/// the controller in motion. It survives a loss of the link: see `docs/decisions/0063-the-way-up-survives-a-reconnect.md`.
#[derive(Debug)]
pub struct Session {
    config: Config,
    lines: Lines,
    poll: StatusPoll,
    phase: Phase,
    homed: bool,
    /// Number of the present alarm; 0 if it was not reported.
    alarm: Option<u8>,
    /// The banner, and the version from `$I`.
    identity: String,
    settings: Settings,
    /// As last reported since the last reset.
    state: Option<MachineState>,
    position_mm: [f64; 3],
    work_frame: WorkFrame,
    /// The feed that the controller has confirmed, with the modes of a move. A reset forgets both.
    feed: Option<Feed>,
    /// Where the controller's parser stands after the last move, in its coordinates.
    parsed_mm: Option<[f64; 3]>,
    /// A move to absolute coordinates has arrived since homing, so that reports are known to have no offset.
    is_proved: bool,
    /// Position of the last report, if it said that the stage stands.
    stood_mm: Option<[f64; 3]>,
    /// The last two reports agree on where it stands.
    is_steady: bool,
    /// Resets in a row after which the controller was in a hold.
    frees: u32,
    /// What the session of the last connection knew, unless the controller has been reset since by others.
    recalled: Option<Whereabouts>,
    /// End of the last move that has set out and has neither arrived nor been stopped.
    bound_mm: Option<[f64; 3]>,
    unknown_lines: u64,
    actions: Vec<Action>,
}

impl Session {
    /// A session that has not started.
    ///
    /// # Errors
    /// If the configuration is invalid; see [`Config::check`].
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            config,
            lines: Lines::default(),
            poll: StatusPoll::default(),
            phase: Phase::Over,
            homed: false,
            alarm: None,
            identity: String::new(),
            settings: Settings::default(),
            state: None,
            position_mm: [0.0; 3],
            work_frame: WorkFrame::default(),
            feed: None,
            parsed_mm: None,
            is_proved: false,
            stood_mm: None,
            is_steady: false,
            frees: 0,
            recalled: None,
            bound_mm: None,
            unknown_lines: 0,
            actions: Vec::new(),
        })
    }

    fn is_over(&self) -> bool {
        matches!(self.phase, Phase::Over)
    }

    fn check_ready(&self, command: &str) -> Result<(), Failure> {
        if self.is_ready() { Ok(()) } else { Err(Failure::refused(command, "another command is under way")) }
    }

    fn check_alarm(&self) -> Result<(), Failure> {
        self.alarm.map_or(Ok(()), |code| Err(Failure::Alarm(alarm(code))))
    }

    fn check_homed(&self) -> Result<(), Failure> {
        if self.homed { Ok(()) } else { Err(Failure::Unhomed) }
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
        match &self.phase {
            Phase::Holding { .. } => true,
            Phase::Resetting { purpose, .. } | Phase::Looking { purpose, .. } => {
                matches!(purpose, Purpose::Stop { .. })
            }
            Phase::Ready
            | Phase::Preparing(_)
            | Phase::Moving(_)
            | Phase::Homing { .. }
            | Phase::Unlocking { .. }
            | Phase::Asking { .. }
            | Phase::Over => false,
        }
    }

    fn deadline(&self) -> Option<Duration> {
        let poll = self.poll_interval().map(|interval| self.poll.next(interval, self.report_timeout()));
        [self.phase.deadline(), poll, self.unwatched()].into_iter().flatten().min()
    }

    fn unknown_lines(&self) -> u64 {
        self.unknown_lines + self.lines.dropped()
    }

    fn whereabouts(&self) -> Option<Whereabouts> {
        let (from_mm, to_mm) = (self.position_mm, self.bound_mm.unwrap_or(self.position_mm));
        self.recalled.or(self.homed.then_some(Whereabouts { from_mm, to_mm }))
    }

    fn recall(&mut self, known: Whereabouts) {
        self.recalled = Some(known);
    }

    fn start(&mut self, now: Duration) -> Vec<Action> {
        if self.recalled.is_some() {
            // It may still move, and a reset in motion would cost the position.
            self.send(FEED_HOLD);
        }
        self.phase = Phase::Resetting { purpose: Purpose::Greet, resets: 0, deadline: now + LISTEN };
        self.finish(now)
    }

    fn home(&mut self, now: Duration) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        if let Err(failure) = self.check_ready("$H").and_then(|()| self.check_alarm()) {
            self.done(Err(failure));
            return self.finish(now);
        }
        self.homed = false;
        self.is_proved = false;
        self.bound_mm = None;
        self.forget_modes();
        // `?` is not answered during homing.
        self.poll.reset();
        self.phase = Phase::Homing { deadline: now + HOMING_TIMEOUT, accepted: None };
        self.send_motion("$H");
        self.report();
        self.finish(now)
    }

    fn move_to(&mut self, now: Duration, target_mm: [f64; 3], speed_mm_per_s: f64) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        let [x, y, z] = target_mm;
        let command = format!("move to {x:.3} {y:.3} {z:.3} mm at {speed_mm_per_s:.3} mm/s");
        let checked = self
            .check_ready(&command)
            .and_then(|()| check_numbers(&command, target_mm, speed_mm_per_s))
            .and_then(|()| self.check_alarm())
            .and_then(|()| self.check_homed());
        match checked {
            Err(failure) => self.done(Err(failure)),
            Ok(()) => self.begin_move(now, target_mm, speed_mm_per_s),
        }
        self.finish(now)
    }

    /// Two reports in a row must say the same: a report has no number, so the first may be a copy of an earlier one.
    fn look(&mut self, now: Duration) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        match self.check_ready("?").and_then(|()| self.check_alarm()) {
            Err(failure) => self.done(Err(failure)),
            Ok(()) => self.begin_look(now, Wanted::Position),
        }
        self.finish(now)
    }

    /// Resets and unlocks the controller with `$X`.
    fn clear_alarm(&mut self, now: Duration) -> Vec<Action> {
        if self.is_over() {
            return Vec::new();
        }
        if let Err(failure) = self.check_ready("$X") {
            self.done(Err(failure));
        } else if self.alarm.is_none() && self.state != Some(MachineState::Alarm) {
            self.done(Ok(self.position_mm));
        } else {
            self.reset(now, Purpose::Clear, 1);
        }
        self.finish(now)
    }

    /// The stage decelerates and keeps its position. At standstill a reset then discards the commands that the controller
    /// still holds. Homing can only be ended by a reset.
    fn stop(&mut self, now: Duration) -> Vec<Action> {
        let stopped = Some(Failure::Stopped { position_mm: self.position_mm });
        match self.phase.clone() {
            // It stands still, and would not answer.
            Phase::Ready if self.alarm.is_some() => self.send(FEED_HOLD),
            Phase::Ready | Phase::Looking { purpose: Purpose::Recover, .. } => self.hold(now, None),
            Phase::Preparing(_)
            | Phase::Moving(_)
            | Phase::Unlocking { .. }
            | Phase::Looking { purpose: Purpose::Clear | Purpose::Look { .. }, .. } => {
                self.hold(now, stopped);
            }
            Phase::Looking { purpose: Purpose::Stop { failure, .. }, .. } => self.hold(now, failure),
            Phase::Holding { .. } => self.send(FEED_HOLD),
            Phase::Homing { .. } => self.reset(now, Purpose::Stop { failure: stopped, held_mm: None }, 1),
            Phase::Looking { purpose: Purpose::Greet, .. } | Phase::Asking { .. } => {
                self.reset(now, Purpose::Greet, 1);
            }
            // It was told to hold at the start, and a reset in motion would cost the position.
            Phase::Resetting { resets: 0, .. } if self.recalled.is_some() => self.send(FEED_HOLD),
            Phase::Resetting { purpose, resets: 0, .. } => self.reset(now, purpose, 1),
            // It has been reset already, so nothing moves. Should a stop that others wrote hold it after that, the look finds it.
            Phase::Resetting { .. } | Phase::Over => {}
        }
        self.finish(now)
    }

    /// The controller has got nothing, so it needs no hold, and the confirmed feed stays.
    fn withhold(&mut self, now: Duration) -> Vec<Action> {
        if matches!(self.phase, Phase::Moving(_) | Phase::Homing { .. }) {
            self.phase = Phase::Ready;
            self.bound_mm = None;
            self.report();
            self.done(Err(Failure::Withheld));
        }
        self.finish(now)
    }

    /// Homing can only be ended by a reset.
    fn halt(&self) -> Vec<u8> {
        vec![if matches!(self.phase, Phase::Homing { .. }) { SOFT_RESET } else { FEED_HOLD }]
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut lines = core::mem::take(&mut self.lines);
        lines.push(bytes, |line| self.handle(now, Response::parse(line)));
        self.lines = lines;
        self.finish(now)
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        if self.phase.deadline().is_some_and(|deadline| now >= deadline) {
            self.overdue(now);
        }
        if self.unwatched().is_some_and(|limit| now >= limit) {
            self.hold_unwatched(now);
        }
        // In an alarm the controller may stay silent until it is reset.
        let excused = self.alarm.is_some() && self.is_ready();
        if self.poll_interval().is_some() && self.poll.is_silent(now) && !excused {
            self.fail(SessionError::Silent { query: "for its status" });
        }
        self.finish(now)
    }
}

fn check_numbers(command: &str, target_mm: [f64; 3], speed_mm_per_s: f64) -> Result<(), Failure> {
    if !target_mm.iter().all(|mm| mm.is_finite()) {
        return Err(Failure::refused(command, "the target is not finite"));
    }
    if !(speed_mm_per_s.is_finite() && speed_mm_per_s >= SPEED_MIN_MM_PER_S) {
        return Err(Failure::refused(command, "the speed is too low or not a number"));
    }
    Ok(())
}

/// An alarm by its number.
fn alarm(code: u8) -> Alarm {
    Alarm { code: code.into(), axis: None, meaning: alarm_meaning(code) }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
