//! Steps that a session takes: reports, holds, resets and queries.

use core::time::Duration;

use super::phase::{Phase, Preparation, Purpose, Query, Wanted};
use super::{Action, Failure, Session, SessionError, alarm};
use crate::grbl::active_move::{ActiveMove, Way};
use crate::grbl::feed::Feed;
use crate::grbl::{FEED_HOLD, MachineState, SOFT_RESET, STATUS_QUERY};
use crate::stage::{Report, Status, distance_mm};

/// Interval of status reports at standstill.
const POLL_IDLE: Duration = Duration::from_millis(100);

/// Interval of status reports in motion, or while waiting for one.
const POLL_MOVING: Duration = Duration::from_millis(20);

/// Interval of status reports while a line has not been accepted. A query delays the answer.
const POLL_SENT: Duration = Duration::from_millis(50);

/// A report that has not arrived after this is requested again. It usually takes 5-60 ms.
const REPORT_TIMEOUT: Duration = Duration::from_millis(250);

/// The same in motion.
const REPORT_TIMEOUT_MOVING: Duration = Duration::from_millis(100);

/// A stage that moves without a report for this long is stopped.
const UNWATCHED_MAX: Duration = Duration::from_millis(300);

/// Longest time to the answer to a feed, or to `$G`.
const FEED_TIMEOUT: Duration = Duration::from_millis(500);

/// Longest time from a reset to the banner. Some boards run a boot loader first.
const BANNER_TIMEOUT: Duration = Duration::from_secs(2);

/// Longest time to the answer to `$I` or `$$`.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Attempts at `$I` and `$$`.
const TRIES_MAX: u32 = 3;

/// Attempts at setting the feed.
const FEEDS_MAX: u32 = 3;

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
            | Phase::Preparing(_)
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
        // It may be moving.
        self.homed &= !matches!(purpose, Purpose::Stop { held_mm: None, .. });
        self.phase = Phase::Resetting { purpose, resets, deadline: now + BANNER_TIMEOUT };
    }

    /// Requests the position, after a reset or for a command.
    pub(super) fn ask_position(&mut self, now: Duration, purpose: Purpose) {
        self.phase = Phase::Looking { purpose, since: now };
        self.poll.at_once();
    }

    /// Asks where the stage stands, for a command.
    pub(super) fn begin_look(&mut self, now: Duration, wanted: Wanted) {
        self.ask_position(now, Purpose::Look { wanted, reports: 0 });
    }

    /// Begins a move, once it is known from where, and at what feed.
    pub(super) fn begin_move(&mut self, now: Duration, target_mm: [f64; 3], speed_mm_per_s: f64) {
        if let Some(failure) = self.displaced() {
            self.phase = Phase::Ready;
            return self.done(Err(failure));
        }
        let Some(base_mm) = self.base_mm() else {
            return self.begin_look(now, Wanted::Move { target_mm, speed_mm_per_s });
        };
        let way = if self.is_proved { Way::Increments } else { Way::Absolute };
        let Some(travel) = ActiveMove::new(now, &self.config, (base_mm, target_mm), speed_mm_per_s, way)
        else {
            return self.begin_look(now, Wanted::At(target_mm));
        };
        let feed = Feed::of(speed_mm_per_s);
        if self.feed != Some(feed) {
            return self.set_feed(now, target_mm, speed_mm_per_s, feed, 1);
        }
        self.parsed_mm = None;
        self.bound_mm = Some(travel.arrival().target_mm());
        self.send_motion(travel.line());
        self.poll.defer(now);
        self.phase = Phase::Moving(travel);
    }

    /// A failure if the stage, by two reports, does not stand where the last move ended. It is reported once: afterwards the
    /// reported position is believed.
    pub(super) fn displaced(&mut self) -> Option<Failure> {
        let (position_mm, tolerance_mm) = (self.position_mm, self.config.tolerance_mm);
        let target_mm = self.config.to_stage(self.parsed_mm.filter(|_| self.is_steady)?);
        if distance_mm(target_mm, position_mm) <= tolerance_mm {
            return None;
        }
        self.parsed_mm = None;
        Some(Failure::NotThere { target_mm, position_mm })
    }

    /// Where an increment is counted from, in the controller's coordinates: where its parser stands, if the report agrees,
    /// or where two reports in a row say that it stands. One report alone may be damaged.
    pub(super) fn base_mm(&self) -> Option<[f64; 3]> {
        let here_mm = self.config.to_machine(self.position_mm);
        let is_near = |parsed_mm: &[f64; 3]| distance_mm(*parsed_mm, here_mm) <= self.config.tolerance_mm;
        let base_mm = self.parsed_mm.filter(is_near).or(self.is_steady.then_some(here_mm));
        base_mm.filter(|_| self.state == Some(MachineState::Idle))
    }

    /// Sets the feed of a move, for the `tries`th time.
    fn set_feed(&mut self, now: Duration, target_mm: [f64; 3], speed_mm_per_s: f64, feed: Feed, tries: u32) {
        self.feed = None;
        self.send_line(&feed.line());
        let deadline = now + FEED_TIMEOUT;
        let (asked, told) = (false, false);
        self.phase =
            Phase::Preparing(Preparation { target_mm, speed_mm_per_s, feed, tries, asked, told, deadline });
    }

    /// Asks for the feed that was set.
    pub(super) fn ask_feed(&mut self, now: Duration, preparation: Preparation) {
        self.send_line("$G");
        self.phase =
            Phase::Preparing(Preparation { asked: true, deadline: now + FEED_TIMEOUT, ..preparation });
    }

    /// Sets the feed again, or gives up the move: nothing has moved yet.
    pub(super) fn retry_feed(&mut self, now: Duration, preparation: Preparation, why: String) {
        let Preparation { target_mm, speed_mm_per_s, feed, tries, .. } = preparation;
        if tries < FEEDS_MAX {
            self.set_feed(now, target_mm, speed_mm_per_s, feed, tries + 1);
        } else {
            self.hold(now, Some(Failure::Refused { command: feed.line(), reason: why }));
        }
    }

    /// Forgets what a reset forgets, and where the stage stood.
    pub(super) fn forget_modes(&mut self) {
        (self.feed, self.parsed_mm, self.stood_mm, self.is_steady) = (None, None, None, false);
    }

    /// When a stage that moves has been without a report for too long.
    pub(super) fn unwatched(&self) -> Option<Duration> {
        let since = self.poll.unanswered().filter(|_| matches!(self.phase, Phase::Moving(_)))?;
        Some(since + UNWATCHED_MAX)
    }

    /// Stops a stage that moves without reports.
    pub(super) fn hold_unwatched(&mut self, now: Duration) {
        if let Phase::Moving(travel) = &self.phase {
            let command = travel.line().to_owned();
            self.hold(now, Some(Failure::Unanswered { command, waited: UNWATCHED_MAX }));
        }
    }

    /// How long to wait for a report.
    pub(super) fn report_timeout(&self) -> Duration {
        if matches!(self.phase, Phase::Moving(_)) { REPORT_TIMEOUT_MOVING } else { REPORT_TIMEOUT }
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
            Phase::Preparing(preparation) => {
                self.retry_feed(now, preparation, "no answer came".to_owned());
            }
            Phase::Moving(travel) => {
                let (target_mm, waited) = (travel.arrival().target_mm(), travel.arrival().waited(now));
                let failure = Failure::Overdue { target_mm, position_mm: self.position_mm, waited };
                self.hold(now, Some(failure));
            }
            Phase::Asking { query, tries, .. } if tries >= TRIES_MAX => {
                self.fail(SessionError::Silent { query: query.line() });
            }
            Phase::Asking { query, tries, .. } => self.ask(now, query, tries + 1),
            Phase::Homing { accepted: Some(_), .. } if self.work_frame.is_unknown() => {
                self.fail(SessionError::Silent { query: "in which frame its positions are (WCO)" });
            }
            Phase::Homing { .. } => self.fail(SessionError::Silent { query: "that it is homed" }),
            Phase::Unlocking { .. } => self.fail(SessionError::Silent { query: "to $X" }),
            Phase::Holding { failure, .. } => self.reset(now, Purpose::Stop { failure, held_mm: None }, 1),
            Phase::Looking { .. } | Phase::Ready | Phase::Over => {}
        }
    }

    /// Requests a report if it is due, and returns the actions.
    pub(super) fn finish(&mut self, now: Duration) -> Vec<Action> {
        if self.poll_interval().is_some_and(|interval| now >= self.poll.next(interval, self.report_timeout()))
        {
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
            Phase::Resetting { .. }
            | Phase::Asking { .. }
            | Phase::Preparing(_)
            | Phase::Unlocking { .. }
            | Phase::Over => None,
            Phase::Homing { accepted, .. } => accepted.map(|_| POLL_MOVING),
            // A query now would only delay the one that follows the `ok`.
            Phase::Moving(ref travel) if travel.awaits_ok() => Some(POLL_SENT),
            Phase::Ready if !self.moves() => Some(self.poll.interval_at_rest(POLL_IDLE)),
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

    /// True if it takes no move until it is reset, by the last report.
    pub(super) fn is_held(&self) -> bool {
        use MachineState::{Check, Door, Hold, Holding, Sleep, Tool};
        self.state.is_some_and(|state| matches!(state, Hold | Holding | Door | Check | Sleep | Tool))
    }

    pub(super) fn send(&mut self, byte: u8) {
        self.actions.push(Action::Send(vec![byte]));
    }

    pub(super) fn send_line(&mut self, line: &str) {
        self.actions.push(Action::Send(format!("{line}\n").into_bytes()));
    }

    /// Sends a line that sets the stage in motion.
    pub(super) fn send_motion(&mut self, line: &str) {
        self.actions.push(Action::Move(format!("{line}\n").into_bytes()));
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
