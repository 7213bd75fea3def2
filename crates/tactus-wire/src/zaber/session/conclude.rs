//! Continues when all requests of a batch or a round have been answered.

use core::time::Duration;

use super::axis_state::Reference;
use super::phase::Phase;
use super::request::{Request, SlotRequest};
use super::{Action, Failure, Session};
use crate::stage::{Controller, Judgement, distance_mm};

impl Session {
    /// Continues after the last answer of a batch or a round.
    pub(super) fn conclude(&mut self, now: Duration) {
        let was_round = self.round_began.is_some() && self.round_ended.is_none();
        self.round_ended = Some(now);
        match &mut self.phase {
            Phase::Greeting => self.conclude_greeting(now),
            Phase::Ready | Phase::Over => self.report(),
            Phase::Moving(travel) if !was_round => {
                travel.set_out = true;
                self.at_once = true;
            }
            Phase::Homing { .. } | Phase::Looking { .. } if !was_round => self.at_once = true,
            Phase::Moving(_) => self.judge(now),
            Phase::Homing { .. } => self.conclude_homing(),
            Phase::Clearing => self.conclude_clearing(),
            Phase::Looking { .. } => self.conclude_look(),
            Phase::Stopping(_) => self.conclude_stop(),
        }
    }

    fn conclude_greeting(&mut self, now: Duration) {
        self.phase = Phase::Ready;
        self.renew_alarm();
        self.homed = self.config.trusts_reference && self.is_referenced() && self.alarm.is_none();
        let (identity, settings) = (self.identity.clone(), self.settings());
        self.actions.push(Action::Connected(Controller { identity, settings }));
        self.report();
        // Its motion was started by someone who is gone, perhaps by this host before the link broke.
        if self.moves() {
            self.halt_all(now, None);
        }
    }

    fn judge(&mut self, now: Duration) {
        self.report();
        // The next round requests the list of warnings, if it is needed.
        let moves = self.axes.iter().any(|state| state.busy || state.needs_list);
        let position_mm = self.position_mm();
        let Phase::Moving(travel) = &mut self.phase else { return };
        let target_mm = travel.arrival.target_mm();
        if travel.course.strays(now, position_mm, self.config.tolerance_mm) {
            return self.halt_all(now, Some(Failure::Astray { target_mm, position_mm }));
        }
        let result = match travel.arrival.judge(now, !moves, position_mm, self.config.tolerance_mm) {
            Judgement::Underway => return,
            Judgement::Done => Ok(position_mm),
            Judgement::NotThere => Err(Failure::NotThere { target_mm, position_mm }),
        };
        self.phase = Phase::Ready;
        self.done(result);
    }

    fn conclude_homing(&mut self) {
        let Phase::Homing { group, then, .. } = &mut self.phase else { return };
        let of_group = |slot: &usize| self.axes.get(*slot);
        // The next round requests the list of warnings, if it is needed.
        if group.iter().filter_map(of_group).any(|state| state.busy || state.needs_list) {
            return self.report();
        }
        let has_failed = group.iter().filter_map(of_group).any(|state| state.reference == Reference::Lost);
        let next = then.take().filter(|slots| !slots.is_empty());
        if has_failed {
            self.phase = Phase::Ready;
            self.report();
            self.done(Err(Failure::Unhomed));
        } else if let Some(next) = next {
            self.report();
            self.home_group(next);
        } else {
            self.phase = Phase::Ready;
            self.homed = self.is_referenced() && self.alarm.is_none();
            self.report();
            let result = if self.homed { Ok(self.position_mm()) } else { Err(Failure::Unhomed) };
            self.done(result);
        }
    }

    fn conclude_clearing(&mut self) {
        self.phase = Phase::Ready;
        self.renew_alarm();
        self.report();
        let result = self.alarm.map_or(Ok(self.position_mm()), |alarm| Err(Failure::Alarm(alarm)));
        self.done(result);
    }

    fn conclude_look(&mut self) {
        self.report();
        // The next round requests the list of warnings, if it is needed.
        if self.axes.iter().any(|state| state.needs_list) {
            self.at_once = true;
            return;
        }
        let Phase::Looking { target_mm } = core::mem::replace(&mut self.phase, Phase::Ready) else { return };
        let (position_mm, tolerance_mm, moves) = (self.position_mm(), self.config.tolerance_mm, self.moves());
        let elsewhere = target_mm.filter(|target_mm| distance_mm(*target_mm, position_mm) > tolerance_mm);
        let result = self.check_alarm().and_then(|()| self.check_homed()).and(match elsewhere {
            _ if moves => Err(Failure::NotIdle { position_mm }),
            Some(target_mm) => Err(Failure::NotThere { target_mm, position_mm }),
            None => Ok(position_mm),
        });
        self.done(result);
    }

    fn conclude_stop(&mut self) {
        let (moves, began) = (self.moves(), self.round_began);
        let Phase::Stopping(stop) = &self.phase else { return };
        let is_later = began.is_some_and(|began| began >= stop.sent);
        if moves || !stop.unheard.is_empty() || !is_later {
            return self.report();
        }
        self.end_stop();
    }

    fn is_referenced(&self) -> bool {
        self.axes.iter().all(|state| state.reference == Reference::Known)
    }

    /// Ends a stop: the stage stands still, or has been waited for long enough.
    pub(super) fn end_stop(&mut self) {
        let phase = core::mem::replace(&mut self.phase, Phase::Ready);
        self.report();
        if let Phase::Stopping(stop) = phase
            && let Some(failure) = stop.failure
        {
            let position_mm = self.position_mm();
            self.done(Err(failure.at(position_mm)));
        }
    }

    /// Homes the axes in these slots.
    pub(super) fn home_group(&mut self, slots: Vec<usize>) {
        self.begin_batch();
        let homing_speed = self.config.homing_speed_mm_per_s;
        for slot in &slots {
            let speed = self.axes.get(*slot).and_then(|state| state.axis.speed_setting(homing_speed?));
            self.queue.extend(speed.map(|speed| SlotRequest { slot: *slot, request: Request::Speed(speed) }));
        }
        self.queue.extend(slots.iter().map(|slot| SlotRequest { slot: *slot, request: Request::Home }));
        if let Phase::Homing { group, .. } = &mut self.phase {
            *group = slots;
        }
    }
}
