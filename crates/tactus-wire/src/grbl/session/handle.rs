//! Handles the controller's responses.

use core::time::Duration;

use super::phase::{Phase, Purpose, Query, Wanted};
use super::{Action, Failure, SAME_PLACE_MM, Session, SessionError, alarm};
use crate::grbl::active_move::ActiveMove;
use crate::grbl::{FEED_HOLD, MachineState, Response, StatusReport, error_meaning};
use crate::stage::{Controller, Judgement, Whereabouts, distance_mm};

/// Longest time for `$X`.
const UNLOCK_TIMEOUT: Duration = Duration::from_secs(2);

/// Reports that must agree before a look is believed: a report has no number, so the first may be a copy of an earlier one.
const LOOKS: u32 = 2;

/// Reports after which a look without two that agree has failed.
const LOOKS_MAX: u32 = 8;

/// Resets in a row of a controller that does not come out of a hold: a door may be open.
const FREES_MAX: u32 = 5;

/// The error that may precede the banner at boot. It answers no line.
const ERROR_AT_BOOT: u8 = 7;

impl Session {
    /// Handles a line.
    pub(super) fn handle(&mut self, now: Duration, response: Response) {
        if self.phase == Phase::Over {
            return;
        }
        match response {
            Response::Ok => self.handle_ok(now),
            Response::Error(code) => self.handle_error(now, code),
            Response::Alarm(code) => self.handle_alarm(code),
            Response::Banner(banner) => self.handle_banner(now, &banner),
            Response::Status(report) => self.handle_report(now, &report),
            Response::Unknown(_) => self.unknown_lines += 1,
            Response::Setting { number, value } => self.settings.take(number, value),
            Response::Feedback(text) => self.handle_feedback(now, &text),
            Response::Message(_) | Response::Probe { .. } => {}
        }
    }

    /// Ignores an `ok` that does not answer the last line: the controller answers noise on the link, too.
    fn handle_ok(&mut self, now: Duration) {
        if let Phase::Preparing(preparation) = self.phase {
            if !preparation.asked {
                self.ask_feed(now, preparation);
            } else if preparation.told {
                self.feed = Some(preparation.feed);
                self.begin_move(now, preparation.target_mm, preparation.speed_mm_per_s);
            }
        } else if let Phase::Moving(travel) = &mut self.phase
            && travel.awaits_ok()
        {
            travel.accept(now);
            self.poll.at_once();
        } else if let Phase::Homing { accepted: accepted @ None, .. } = &mut self.phase {
            *accepted = Some(now);
            self.poll.at_once();
        } else if let Phase::Unlocking { .. } = self.phase {
            self.ask_position(now, Purpose::Clear);
        } else if let Phase::Asking { query, .. } = self.phase {
            self.handle_answered(now, query);
        }
    }

    /// Takes the version from the answer to `$I`, and the feed from the answer to `$G`.
    fn handle_feedback(&mut self, now: Duration, text: &str) {
        if let Phase::Preparing(preparation) = &mut self.phase
            && preparation.asked
        {
            match preparation.feed.is_told(text) {
                Some(true) => preparation.told = true,
                Some(false) => {
                    let preparation = *preparation;
                    self.retry_feed(now, preparation, format!("the controller has understood [{text}]"));
                }
                None => {}
            }
        }
        if let Phase::Asking { query: Query::Build, .. } = self.phase
            && text.starts_with("VER:")
        {
            self.identity.push_str(", ");
            self.identity.push_str(text.trim_end_matches(':'));
        }
    }

    /// Handles the end of a query that precedes the controller's acceptance.
    fn handle_answered(&mut self, now: Duration, query: Query) {
        if query == Query::Build {
            return self.ask(now, Query::Settings, 1);
        }
        if let Err(error) = self.settings.check(&self.config) {
            return self.fail(error);
        }
        if let Some(offset_mm) = self.work_frame.foreign_mm() {
            return self.fail(SessionError::of_work_frame(offset_mm));
        }
        self.homed = self.recalled.take().is_some_and(|known| self.stands_as_known(known));
        self.phase = Phase::Ready;
        let (identity, settings) = (self.identity.clone(), self.settings.list());
        self.actions.push(Action::Connected(Controller { identity, settings }));
        self.report();
    }

    /// True if the controller is where the last session left it, and has not been reset since by others. Switched on anew, or reset
    /// in motion, it would be in alarm, because homing is on (`$22`); without that lock it would count from 0 again.
    fn stands_as_known(&self, known: Whereabouts) -> bool {
        let counts_anew = distance_mm(self.config.to_machine(self.position_mm), [0.0; 3]) < SAME_PLACE_MM;
        self.state == Some(MachineState::Idle)
            && self.alarm.is_none()
            && !counts_anew
            && known.holds(self.position_mm, self.config.tolerance_mm)
    }

    fn handle_error(&mut self, now: Duration, code: u8) {
        if code == ERROR_AT_BOOT {
            return;
        }
        if let Phase::Asking { query, .. } = self.phase {
            return match query {
                // It has no version to tell.
                Query::Build => self.handle_answered(now, query),
                Query::Settings => self.fail(SessionError::Refused {
                    query: query.line(),
                    code,
                    meaning: error_meaning(code),
                }),
            };
        }
        let reason = format!("error {code}: {}", error_meaning(code));
        if let Phase::Preparing(preparation) = self.phase {
            return self.retry_feed(now, preparation, reason);
        }
        if let Phase::Moving(travel) = &self.phase
            && travel.awaits_ok()
        {
            // The refusal may be a copy of an earlier one: whatever the controller holds is discarded.
            let command = travel.line().to_owned();
            return self.hold(now, Some(Failure::Refused { command, reason }));
        }
        let command = if let Phase::Homing { accepted: None, .. } = self.phase {
            "$H".to_owned()
        } else if let Phase::Unlocking { .. } = self.phase {
            "$X".to_owned()
        } else {
            return;
        };
        self.phase = Phase::Ready;
        self.report();
        self.done(Err(Failure::Refused { command, reason }));
    }

    /// Handles an alarm from a line; the number is 0 if only a status report showed it.
    fn handle_alarm(&mut self, code: u8) {
        self.alarm = Some(code);
        self.state = Some(MachineState::Alarm);
        self.homed = false;
        self.recalled = None;
        self.forget_modes();
        let ended = match &self.phase {
            Phase::Preparing(_)
            | Phase::Moving(_)
            | Phase::Homing { .. }
            | Phase::Unlocking { .. }
            | Phase::Looking { purpose: Purpose::Clear | Purpose::Look { .. }, .. } => true,
            Phase::Holding { failure, .. } => failure.is_some(),
            // A reset may raise an alarm; its banner follows.
            Phase::Resetting { .. } | Phase::Looking { .. } | Phase::Asking { .. } | Phase::Over => {
                return self.report();
            }
            Phase::Ready => false,
        };
        self.phase = Phase::Ready;
        self.report();
        if ended {
            self.done(Err(Failure::Alarm(alarm(code))));
        }
    }

    fn handle_banner(&mut self, now: Duration, banner: &str) {
        if !matches!(self.phase, Phase::Resetting { resets: 1.., .. }) {
            self.recalled = None;
        }
        self.poll.reset();
        self.forget_modes();
        self.work_frame.forget();
        self.state = None;
        banner.clone_into(&mut self.identity);
        let failure = match core::mem::replace(&mut self.phase, Phase::Ready) {
            Phase::Resetting { purpose: Purpose::Clear, .. } => {
                self.send_line("$X");
                self.phase = Phase::Unlocking { deadline: now + UNLOCK_TIMEOUT };
                return;
            }
            Phase::Resetting { purpose, .. } => return self.ask_position(now, purpose),
            // The banner at opening, and the one after the reset.
            Phase::Looking { purpose: Purpose::Greet, .. } | Phase::Asking { .. } => {
                return self.ask_position(now, Purpose::Greet);
            }
            Phase::Looking { purpose: Purpose::Stop { failure, .. }, .. }
            | Phase::Holding { failure, .. } => failure,
            Phase::Preparing(_)
            | Phase::Moving(_)
            | Phase::Homing { .. }
            | Phase::Unlocking { .. }
            | Phase::Looking { purpose: Purpose::Clear | Purpose::Look { .. }, .. } => Some(Failure::Unhomed),
            Phase::Looking { purpose: Purpose::Recover, .. } | Phase::Ready | Phase::Over => None,
        };
        self.homed = false;
        self.actions.push(Action::Suspect { why: format!("the controller was reset: {banner}") });
        self.report();
        if let Some(failure) = failure {
            self.done(Err(failure));
        }
        self.ask_position(now, Purpose::Recover);
    }

    fn handle_report(&mut self, now: Duration, report: &StatusReport) {
        let asked = self.poll.answered(now);
        self.state = Some(report.state);
        self.position_mm = self.config.to_stage(self.work_frame.take(report));
        if asked.is_some() {
            self.take_stand();
        }
        if report.state != MachineState::Alarm {
            self.alarm = None;
        } else if self.alarm.is_none() && (self.homed || matches!(self.phase, Phase::Moving(_))) {
            // The alarm's own line was lost.
            return self.handle_alarm(0);
        }
        let asked_since = |since: Duration| asked.is_some_and(|asked| asked >= since);
        match self.phase.clone() {
            Phase::Moving(travel) => self.judge(now, asked, travel),
            Phase::Homing { accepted: Some(accepted), .. } if asked_since(accepted) => self.conclude_homing(),
            Phase::Holding { failure, since } if asked_since(since) => self.conclude_hold(now, failure),
            Phase::Looking { purpose, since } if asked_since(since) => self.conclude_look(now, purpose),
            Phase::Homing { .. }
            | Phase::Holding { .. }
            | Phase::Looking { .. }
            | Phase::Resetting { .. }
            | Phase::Asking { .. }
            | Phase::Preparing(_)
            | Phase::Unlocking { .. }
            | Phase::Ready
            | Phase::Over => self.report(),
        }
    }

    /// Notes whether this report and the last one agree on where the stage stands.
    fn take_stand(&mut self) {
        let stands = self.state == Some(MachineState::Idle);
        let agrees = |stood_mm: [f64; 3]| distance_mm(stood_mm, self.position_mm) < SAME_PLACE_MM;
        self.is_steady = stands && self.stood_mm.is_some_and(agrees);
        self.stood_mm = stands.then_some(self.position_mm);
    }

    fn judge(&mut self, now: Duration, asked: Option<Duration>, mut travel: ActiveMove) {
        let (position_mm, tolerance_mm) = (self.position_mm, self.config.tolerance_mm);
        let target_mm = travel.arrival().target_mm();
        if travel.strays(now, position_mm, tolerance_mm) {
            self.report();
            return self.hold(now, Some(Failure::Astray { target_mm, position_mm }));
        }
        let stands = (self.state == Some(MachineState::Idle), self.moves());
        match travel.judge(now, asked, stands, position_mm, tolerance_mm) {
            Judgement::Underway => {
                self.phase = Phase::Moving(travel);
                self.report();
            }
            Judgement::Done => {
                self.parsed_mm = Some(travel.parsed_mm());
                self.bound_mm = None;
                self.is_proved |= travel.is_absolute();
                self.phase = Phase::Ready;
                self.report();
                self.done(Ok(position_mm));
            }
            // The line may still wait in the controller: it is discarded.
            Judgement::NotThere => {
                self.report();
                self.hold(now, Some(Failure::NotThere { target_mm, position_mm }));
            }
        }
    }

    fn conclude_homing(&mut self) {
        match self.state {
            // An `ok` may be a copy of an earlier one, and the stage not have set out. A second report comes only after homing.
            Some(MachineState::Idle) if !self.is_steady || self.work_frame.is_unknown() => {
                self.poll.at_once();
                self.report();
            }
            Some(MachineState::Idle) => {
                self.phase = Phase::Ready;
                let offset = self.work_frame.foreign_mm().map(SessionError::of_work_frame);
                self.homed = offset.is_none();
                self.report();
                let refused = |error: SessionError| Err(Failure::refused("$H", error.to_string()));
                self.done(offset.map_or(Ok(self.position_mm), refused));
            }
            Some(MachineState::Alarm) => self.handle_alarm(0),
            _ => self.report(),
        }
    }

    fn conclude_hold(&mut self, now: Duration, failure: Option<Failure>) {
        self.report();
        if self.state == Some(MachineState::Alarm) {
            self.phase = Phase::Ready;
            if let Some(failure) = failure {
                self.done(Err(failure.at(self.position_mm)));
            }
        } else if !self.moves() {
            let held_mm = Some(self.position_mm);
            self.reset(now, Purpose::Stop { failure, held_mm }, 1);
        } else if self.state != Some(MachineState::Holding) {
            self.send(FEED_HOLD);
        }
    }

    /// Goes on with a command that asked where the stage stands, if enough reports have come.
    fn conclude_wanted(&mut self, now: Duration, wanted: Wanted, reports: u32) {
        let position_mm = self.position_mm;
        self.report();
        let stands = if self.state == Some(MachineState::Idle) {
            Ok(())
        } else {
            Err(Failure::NotIdle { position_mm })
        };
        let checked = self.check_alarm().and_then(|()| self.check_homed()).and(stands);
        let is_known = match wanted {
            Wanted::Position | Wanted::At(_) => reports >= LOOKS && self.is_steady,
            Wanted::Move { .. } => self.base_mm().is_some(),
        };
        if checked.is_ok() && !is_known {
            if reports < LOOKS_MAX {
                return self.ask_position(now, Purpose::Look { wanted, reports });
            }
            let reason = "it says that it stands, but every report has another position";
            self.phase = Phase::Ready;
            return self.done(Err(Failure::refused("?", reason)));
        }
        self.phase = Phase::Ready;
        let checked = checked.and_then(|()| self.displaced().map_or(Ok(()), Err));
        match (checked, wanted) {
            (Err(failure), _) => self.done(Err(failure)),
            (Ok(()), Wanted::Move { target_mm, speed_mm_per_s }) => {
                self.begin_move(now, target_mm, speed_mm_per_s);
            }
            (Ok(()), Wanted::At(target_mm))
                if distance_mm(target_mm, position_mm) > self.config.tolerance_mm =>
            {
                self.done(Err(Failure::NotThere { target_mm, position_mm }));
            }
            (Ok(()), Wanted::Position | Wanted::At(_)) => self.done(Ok(position_mm)),
        }
    }

    /// Frees a controller that is in a hold after a reset: a hold may have come after it, from the guard of the driver, from
    /// somebody's button. While it decelerates, a reset would cost the position.
    fn free(&mut self, now: Duration, purpose: Purpose) {
        match purpose {
            Purpose::Stop { failure, .. } if self.moves() => self.hold(now, failure),
            purpose @ (Purpose::Greet
            | Purpose::Recover
            | Purpose::Clear
            | Purpose::Look { .. }
            | Purpose::Stop { .. }) => self.reset(now, purpose, 1),
        }
    }

    fn conclude_look(&mut self, now: Duration, purpose: Purpose) {
        let position_mm = self.position_mm;
        if self.is_held() && !matches!(purpose, Purpose::Look { .. }) {
            if self.frees < FREES_MAX {
                self.frees += 1;
                if !matches!(purpose, Purpose::Greet) {
                    self.report();
                }
                return self.free(now, purpose);
            }
        } else {
            self.frees = 0;
        }
        match purpose {
            Purpose::Greet => self.ask(now, Query::Build, 1),
            Purpose::Recover => {
                self.phase = Phase::Ready;
                self.report();
            }
            Purpose::Look { wanted, reports } => self.conclude_wanted(now, wanted, reports + 1),
            Purpose::Clear => {
                self.phase = Phase::Ready;
                self.homed = false;
                self.report();
                let free = if self.is_held() { Err(Failure::NotIdle { position_mm }) } else { Ok(()) };
                self.done(self.check_alarm().and(free).map(|()| position_mm));
            }
            Purpose::Stop { failure, held_mm } => {
                let kept =
                    held_mm.is_some_and(|held| distance_mm(held, position_mm) <= self.config.tolerance_mm);
                // A stage that reports motion after a reset cannot be believed, and would not stop.
                self.homed &= kept && !self.moves();
                self.bound_mm = None;
                self.phase = Phase::Ready;
                self.report();
                if let Some(failure) = failure {
                    self.done(Err(failure.at(position_mm)));
                }
            }
        }
    }
}
