//! Steps that a session takes: reports, holds, resets and queries.

use core::time::Duration;

use super::phase::{Phase, Purpose, Query};
use super::{Action, Failure, Session, SessionError, alarm};
use crate::grbl::{FEED_HOLD, MachineState, SOFT_RESET, STATUS_QUERY};
use crate::stage::{Report, Status};

/// Interval of status reports at standstill.
const POLL_IDLE: Duration = Duration::from_millis(100);

/// Interval of status reports in motion, or while waiting for one.
const POLL_MOVING: Duration = Duration::from_millis(50);

/// Longest time from a reset to the banner. Some boards run a boot loader first.
const BANNER_TIMEOUT: Duration = Duration::from_secs(2);

/// Longest time to the answer to `$I` or `$$`.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Attempts at `$I` and `$$`.
const TRIES_MAX: u32 = 3;

/// Attempts at a reset.
const RESETS_MAX: u32 = 4;

impl Session {
    /// Reports position and status.
    pub(super) fn report(&mut self) {
        let report = Report {
            position_mm: self.position_mm,
            status: self.status(),
            alarm: self.alarm.filter(|code| *code != 0).map(alarm),
        };
        self.actions.push(Action::Report(report));
    }

    /// Ends the command under way.
    pub(super) fn done(&mut self, result: Result<[f64; 3], Failure>) {
        self.actions.push(Action::Done(result));
    }

    /// Ends the session, stopping any motion.
    pub(super) fn fail(&mut self, error: SessionError) {
        match self.phase {
            Phase::Homing { .. } => self.send(SOFT_RESET),
            Phase::Ready | Phase::Moving(_) | Phase::Holding { .. } => self.send(FEED_HOLD),
            Phase::Resetting { .. }
            | Phase::Looking { .. }
            | Phase::Asking { .. }
            | Phase::Unlocking { .. }
            | Phase::Over => {}
        }
        self.phase = Phase::Over;
        self.actions.push(Action::Failed(error));
    }

    /// Decelerates to a standstill. The command under way then ends with `failure`.
    pub(super) fn hold(&mut self, now: Duration, failure: Option<Failure>) {
        self.send(FEED_HOLD);
        self.phase = Phase::Holding { failure, since: now };
        self.poll.at_once();
    }

    /// Resets the controller, for the `resets`th time.
    pub(super) fn reset(&mut self, now: Duration, purpose: Purpose, resets: u32) {
        self.send(SOFT_RESET);
        self.phase = Phase::Resetting { purpose, resets, deadline: now + BANNER_TIMEOUT };
    }

    /// Requests the position, after a reset or for a command.
    pub(super) fn ask_position(&mut self, now: Duration, purpose: Purpose) {
        self.phase = Phase::Looking { purpose, since: now };
        self.poll.at_once();
    }

    /// Begins the command to look where the stage stands, which is at the target if there is one.
    pub(super) fn begin_look(&mut self, now: Duration, target_mm: Option<[f64; 3]>) {
        self.ask_position(now, Purpose::Look { target_mm, reports: 0 });
    }

    /// Queries the controller, for the `tries`th time.
    pub(super) fn ask(&mut self, now: Duration, query: Query, tries: u32) {
        if query == Query::Settings {
            self.settings.forget();
        }
        self.send_line(query.line());
        self.phase = Phase::Asking { query, tries, deadline: now + ANSWER_TIMEOUT };
    }

    /// Handles a phase that has taken too long.
    pub(super) fn overdue(&mut self, now: Duration) {
        match self.phase.clone() {
            Phase::Resetting { resets, .. } if resets >= RESETS_MAX => {
                self.fail(SessionError::NoBanner { resets });
            }
            Phase::Resetting { purpose, resets, .. } => self.reset(now, purpose, resets + 1),
            Phase::Moving(travel) => {
                let (target_mm, waited) = (travel.arrival().target_mm(), travel.arrival().waited(now));
                let failure = Failure::Overdue { target_mm, position_mm: self.position_mm, waited };
                self.hold(now, Some(failure));
            }
            Phase::Asking { query, tries, .. } if tries >= TRIES_MAX => {
                self.fail(SessionError::Silent { query: query.line() });
            }
            Phase::Asking { query, tries, .. } => self.ask(now, query, tries + 1),
            Phase::Homing { .. } => self.fail(SessionError::Silent { query: "that it is homed" }),
            Phase::Unlocking { .. } => self.fail(SessionError::Silent { query: "to $X" }),
            Phase::Holding { failure, .. } => self.reset(now, Purpose::Stop { failure, held_mm: None }, 1),
            Phase::Looking { .. } | Phase::Ready | Phase::Over => {}
        }
    }

    /// Requests a report if it is due, and returns the actions.
    pub(super) fn finish(&mut self, now: Duration) -> Vec<Action> {
        if self.poll_interval().is_some_and(|interval| now >= self.poll.next(interval)) {
            self.poll.sent(now);
            if self.poll.is_repeated() && matches!(self.phase, Phase::Holding { .. }) {
                self.send(FEED_HOLD);
            }
            self.send(STATUS_QUERY);
        }
        core::mem::take(&mut self.actions)
    }

    /// Interval of requests for a report; `None` if they would not be answered.
    pub(super) fn poll_interval(&self) -> Option<Duration> {
        match self.phase {
            Phase::Resetting { .. } | Phase::Asking { .. } | Phase::Unlocking { .. } | Phase::Over => None,
            Phase::Homing { accepted, .. } => accepted.map(|_| POLL_MOVING),
            // A query now would only delay the one that follows the `ok`.
            Phase::Moving(ref travel) if travel.awaits_ok() => Some(POLL_IDLE),
            Phase::Ready if !self.moves() => Some(POLL_IDLE),
            Phase::Ready | Phase::Moving(_) | Phase::Holding { .. } | Phase::Looking { .. } => {
                Some(POLL_MOVING)
            }
        }
    }

    /// True if the stage moves, by the last report.
    pub(super) fn moves(&self) -> bool {
        use MachineState::{Holding, Home, Jog, Run};
        self.state.is_some_and(|state| matches!(state, Run | Jog | Holding | Home))
    }

    pub(super) fn send(&mut self, byte: u8) {
        self.actions.push(Action::Send(vec![byte]));
    }

    pub(super) fn send_line(&mut self, line: &str) {
        self.actions.push(Action::Send(format!("{line}\n").into_bytes()));
    }

    fn status(&self) -> Status {
        use MachineState::{Alarm, Check, Door, Hold, Holding, Home, Idle, Jog, Run, Sleep, Tool};
        if matches!(self.phase, Phase::Homing { .. }) {
            return Status::Homing;
        }
        if self.alarm.is_some() {
            return Status::Alarm;
        }
        match self.state {
            Some(Run | Jog) => Status::Moving,
            Some(Holding | Hold | Door | Tool) => Status::Hold,
            Some(Home) => Status::Homing,
            // An unreported alarm: locked since the start, until homing unlocks it.
            Some(Idle | Check | Sleep | Alarm) | None if !self.homed => Status::Unhomed,
            Some(Idle | Check | Sleep | Alarm) | None => Status::Idle,
        }
    }
}
