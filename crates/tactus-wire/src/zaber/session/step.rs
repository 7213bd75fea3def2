//! The steps that a session takes by itself.

use core::time::Duration;

use super::phase::{Phase, Stop};
use super::request::{Pending, Request, SlotRequest};
use super::{Action, Failure, Session, SessionError};
use crate::stage::{Alarm, Report, Session as _, Status};
use crate::zaber::HostCommand;

/// Between rounds of questions while the stage stands.
const POLL_IDLE: Duration = Duration::from_millis(100);

/// Between rounds at least, while the stage moves: as fast as replies come, which take longer, but not in no
/// time where they take none.
const POLL_MOVING: Duration = Duration::from_millis(10);

/// For how long a stop is sent again to a device that does not confirm it.
const STOP_SILENCE_MAX: Duration = Duration::from_secs(2);

impl Session {
    /// Tells where the stage is and what it does.
    pub(super) fn report(&mut self) {
        let report = Report { position_mm: self.position_mm(), status: self.status(), alarm: self.alarm };
        self.actions.push(Action::Report(report));
    }

    /// Ends the command in hand.
    pub(super) fn done(&mut self, result: Result<[f64; 3], Failure>) {
        self.actions.push(Action::Done(result));
    }

    /// Ends the session; whatever moves is told to stop.
    pub(super) fn fail(&mut self, error: SessionError) {
        if !matches!(self.phase, Phase::Greeting | Phase::Over) {
            self.send_stop("stop");
        }
        self.phase = Phase::Over;
        self.queue.clear();
        self.pending = None;
        self.actions.push(Action::Failed(error));
    }

    /// Stops everything, whereupon the command in hand ends with `failure`.
    pub(super) fn halt(&mut self, now: Duration, failure: Option<Failure>) {
        self.queue.clear();
        self.pending = None;
        self.round_ended = Some(now);
        self.at_once = true;
        self.send_stop("stop");
        self.phase = Phase::Stopping(Stop {
            failure,
            since: now,
            sent: now,
            id: self.last_id,
            unheard: self.devices(),
            unheard_since: now,
            is_hard: false,
        });
    }

    /// Sends the stop that is under way again. What was asked before it proves nothing any more.
    pub(super) fn repeat_stop(&mut self, now: Duration, text: &str) {
        self.send_stop(text);
        let (id, devices) = (self.last_id, self.devices());
        if let Phase::Stopping(stop) = &mut self.phase {
            if stop.unheard.is_empty() {
                stop.unheard_since = now;
            }
            (stop.id, stop.sent, stop.unheard) = (id, now, devices);
        }
        self.queue.clear();
        self.pending = None;
        self.round_ended = Some(now);
        self.at_once = true;
    }

    /// Tells all devices of the port at once to stop.
    pub(super) fn send_stop(&mut self, text: &str) {
        let id = self.next_id();
        self.send(&HostCommand { device: 0, axis: 0, id: Some(id), text: text.to_owned() });
    }

    /// Does what follows when a phase has taken too long.
    pub(super) fn overdue(&mut self, now: Duration) {
        match self.phase.clone() {
            Phase::Moving(travel) => {
                let (target_mm, position_mm) = (travel.arrival.target_mm(), self.position_mm());
                let waited = travel.arrival.waited(now);
                self.halt(now, Some(Failure::Overdue { target_mm, position_mm, waited }));
            }
            Phase::Homing { .. } => {
                self.halt(now, Some(Failure::refused("home", "the reference was not found in time")));
            }
            Phase::Stopping(stop) => self.stop_overdue(now, &stop),
            Phase::Greeting | Phase::Ready | Phase::Clearing | Phase::Over => {}
        }
    }

    fn stop_overdue(&mut self, now: Duration, stop: &Stop) {
        if let Some(device) = stop.unheard.first()
            && now.saturating_sub(stop.unheard_since) >= STOP_SILENCE_MAX
        {
            return self.fail(SessionError::Silent { device: *device, command: stop.text().to_owned() });
        }
        if now < stop.too_long() {
            return self.repeat_stop(now, stop.text());
        }
        self.homed = false;
        if stop.is_hard {
            // A stage that still says that it moves can neither be believed nor waited for.
            return self.end_stop();
        }
        if let Phase::Stopping(stop) = &mut self.phase {
            stop.is_hard = true;
        }
        self.repeat_stop(now, "estop");
    }

    /// No answer has come in time: the request is asked again, unless that would move something twice.
    pub(super) fn unanswered(&mut self, now: Duration) {
        let Some(pending) = self.pending else { return };
        let SlotRequest { slot, request } = pending.request;
        if request.moves() {
            return self
                .halt(now, Some(Failure::refused(&request.text(), "no answer came; the stage was stopped")));
        }
        if pending.is_silent(now) {
            let device = self.device_of(slot);
            return self.fail(if matches!(self.phase, Phase::Greeting) {
                SessionError::NoDevice { device }
            } else {
                SessionError::Silent { device, command: request.text() }
            });
        }
        self.pending = Some(Pending { sent: now, ..pending });
        self.send_request(pending.request, pending.id);
    }

    /// Hands out what is to be done.
    pub(super) fn finish(&mut self, now: Duration) -> Vec<Action> {
        self.proceed(now);
        core::mem::take(&mut self.actions)
    }

    /// Asks the next request, if none stands and it is time.
    pub(super) fn proceed(&mut self, now: Duration) {
        if self.pending.is_some() || matches!(self.phase, Phase::Over) {
            return;
        }
        if self.queue.is_empty() && self.next_round().is_some_and(|next| now >= next) {
            self.begin_round(now);
        }
        if let Some(request) = self.queue.pop_front() {
            let id = self.next_id();
            self.pending = Some(Pending { request, id, since: now, sent: now });
            self.send_request(request, id);
        }
    }

    /// When to ask for the positions again; `None` while something else is being asked, or nothing at all.
    pub(super) fn next_round(&self) -> Option<Duration> {
        if self.pending.is_some() || !self.queue.is_empty() {
            return None;
        }
        let interval = match &self.phase {
            Phase::Greeting | Phase::Clearing | Phase::Over => return None,
            _ if self.at_once => Duration::ZERO,
            Phase::Ready if !self.moves() => POLL_IDLE,
            Phase::Ready | Phase::Moving(_) | Phase::Homing { .. } | Phase::Stopping(_) => POLL_MOVING,
        };
        Some(self.round_began.map_or(Duration::ZERO, |began| began + interval))
    }

    fn begin_round(&mut self, now: Duration) {
        (self.round_began, self.round_ended, self.at_once) = (Some(now), None, false);
        for (slot, state) in self.axes.iter().enumerate() {
            self.queue.push_back(SlotRequest { slot, request: Request::Position });
            if state.needs_list {
                self.queue.push_back(SlotRequest { slot, request: Request::Warnings });
            }
        }
    }

    /// What is put in the queue next is no round; what was left of one is not asked any more.
    pub(super) fn begin_batch(&mut self) {
        self.queue.clear();
        for state in &mut self.axes {
            state.is_ours = false;
        }
        self.round_ended = self.round_ended.or(self.round_began).or(Some(Duration::ZERO));
    }

    /// The alarm is what the axes say now.
    pub(super) fn renew_alarm(&mut self) {
        let mut faults = self.axes.iter().filter_map(|state| Some((state.name, state.fault?)));
        self.alarm = faults.next_back().map(|(name, flag)| Alarm {
            code: flag.code(),
            axis: Some(name),
            meaning: flag.meaning(),
        });
    }

    /// True if an axis says that it moves.
    pub(super) fn moves(&self) -> bool {
        self.axes.iter().any(|state| state.busy)
    }

    pub(super) fn position_mm(&self) -> [f64; 3] {
        let mut position_mm = [0.0; 3];
        for state in &self.axes {
            state.name.set(&mut position_mm, state.axis.position_mm(state.position));
        }
        position_mm
    }

    /// True if every device has been set to send checksums.
    pub(super) fn needs_checksums(&self) -> bool {
        self.config.checksums && !matches!(self.phase, Phase::Greeting)
    }

    /// Address of the device of the axis in a slot.
    pub(super) fn device_of(&self, slot: usize) -> u8 {
        self.axes.get(slot).map_or(0, |state| state.axis.device)
    }

    fn devices(&self) -> Vec<u8> {
        let mut devices: Vec<u8> = self.axes.iter().map(|state| state.axis.device).collect();
        devices.sort_unstable();
        devices.dedup();
        devices
    }

    fn send_request(&mut self, SlotRequest { slot, request }: SlotRequest, id: u8) {
        let Some(state) = self.axes.get(slot) else { return };
        let axis = if request.is_of_device() { 0 } else { state.axis.number };
        self.send(&HostCommand { device: state.axis.device, axis, id: Some(id), text: request.text() });
    }

    fn send(&mut self, command: &HostCommand) {
        self.actions.push(Action::Send(command.encode(self.config.checksums)));
    }

    /// Ids go round; the stop's is not used again while it is under way.
    fn next_id(&mut self) -> u8 {
        let taken = if let Phase::Stopping(stop) = &self.phase { Some(stop.id) } else { None };
        self.last_id = (self.last_id + 1) % 100;
        if Some(self.last_id) == taken {
            self.last_id = (self.last_id + 1) % 100;
        }
        self.last_id
    }

    fn status(&self) -> Status {
        if matches!(self.phase, Phase::Homing { .. }) {
            Status::Homing
        } else if self.is_stopping() && self.moves() {
            Status::Hold
        } else if self.alarm.is_some() {
            Status::Alarm
        } else if self.moves() {
            Status::Moving
        } else if self.homed {
            Status::Idle
        } else {
            Status::Unhomed
        }
    }
}
