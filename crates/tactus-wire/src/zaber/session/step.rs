//! Steps that a session takes: reports, stops and rounds of queries.

use core::time::Duration;

use super::phase::{Phase, Stop};
use super::request::{MOTION_REPLY_TIMEOUT, Pending, Request, SlotRequest};
use super::{Action, Failure, Session, SessionError};
use crate::stage::{Alarm, Report, Session as _, Status};
use crate::zaber::HostCommand;

/// Interval of position rounds at standstill.
const POLL_IDLE: Duration = Duration::from_millis(100);

/// Least interval of rounds in motion. Real replies take longer; the limit is for links whose replies take no time.
const POLL_MOVING: Duration = Duration::from_millis(10);

/// How long a stop is repeated to a device that does not confirm it.
const STOP_SILENCE_MAX: Duration = Duration::from_secs(2);

impl Session {
    /// Reports position and status.
    pub(super) fn report(&mut self) {
        let report = Report { position_mm: self.position_mm(), status: self.status(), alarm: self.alarm };
        self.actions.push(Action::Report(report));
    }

    /// Ends the command under way.
    pub(super) fn done(&mut self, result: Result<[f64; 3], Failure>) {
        self.actions.push(Action::Done(result));
    }

    /// Ends the session, stopping any motion.
    pub(super) fn fail(&mut self, error: SessionError) {
        if !matches!(self.phase, Phase::Greeting | Phase::Over) {
            self.send_stop("stop");
        }
        self.phase = Phase::Over;
        self.queue.clear();
        self.pending = None;
        self.actions.push(Action::Failed(error));
    }

    /// Begins the command to look where the stage stands, which is at the target if there is one. A round that is under
    /// way does not count.
    pub(super) fn begin_look(&mut self, now: Duration, target_mm: Option<[f64; 3]>) {
        self.queue.clear();
        self.round_ended = Some(now);
        self.at_once = true;
        self.phase = Phase::Looking { target_mm };
    }

    /// Stops all axes. The command under way then ends with `failure`.
    pub(super) fn halt_all(&mut self, now: Duration, failure: Option<Failure>) {
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

    /// Sends the present stop again. Answers to earlier requests are no longer used.
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

    /// Sends a stop to all devices on the port at once.
    pub(super) fn send_stop(&mut self, text: &str) {
        let id = self.next_id();
        self.send(&HostCommand { device: 0, axis: 0, id: Some(id), text: text.to_owned() });
    }

    /// Handles a phase that has taken too long.
    pub(super) fn overdue(&mut self, now: Duration) {
        match self.phase.clone() {
            Phase::Moving(travel) => {
                let (target_mm, position_mm) = (travel.arrival.target_mm(), self.position_mm());
                let waited = travel.arrival.waited(now);
                self.halt_all(now, Some(Failure::Overdue { target_mm, position_mm, waited }));
            }
            Phase::Homing { .. } => {
                self.halt_all(now, Some(Failure::refused("home", "the reference was not found in time")));
            }
            Phase::Stopping(stop) => self.stop_overdue(now, &stop),
            Phase::Greeting | Phase::Ready | Phase::Clearing | Phase::Looking { .. } | Phase::Over => {}
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
            // A stage that still reports motion cannot be believed, and would not stop.
            return self.end_stop();
        }
        if let Phase::Stopping(stop) = &mut self.phase {
            stop.is_hard = true;
        }
        self.repeat_stop(now, "estop");
    }

    /// Handles a missing answer: sends the request again, unless that could cause a motion twice.
    pub(super) fn unanswered(&mut self, now: Duration) {
        let Some(pending) = self.pending else { return };
        let SlotRequest { slot, request } = pending.request;
        if request.moves() {
            let failure = Failure::Unanswered { command: request.text(), waited: MOTION_REPLY_TIMEOUT };
            return self.halt_all(now, Some(failure));
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

    /// Sends what is due, and returns the actions.
    pub(super) fn finish(&mut self, now: Duration) -> Vec<Action> {
        self.proceed(now);
        core::mem::take(&mut self.actions)
    }

    /// Sends the next request, if none is pending and it is due.
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

    /// When to start the next round of position queries; `None` while other requests are sent, or none at all.
    pub(super) fn next_round(&self) -> Option<Duration> {
        if self.pending.is_some() || !self.queue.is_empty() {
            return None;
        }
        let interval = match &self.phase {
            Phase::Greeting | Phase::Clearing | Phase::Over => return None,
            _ if self.at_once => Duration::ZERO,
            Phase::Ready if !self.moves() => POLL_IDLE,
            Phase::Ready
            | Phase::Moving(_)
            | Phase::Homing { .. }
            | Phase::Looking { .. }
            | Phase::Stopping(_) => POLL_MOVING,
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

    /// Prepares the queue for requests that are not a round. Drops the rest of a round.
    pub(super) fn begin_batch(&mut self) {
        self.queue.clear();
        for state in &mut self.axes {
            state.is_ours = false;
        }
        self.round_ended = self.round_ended.or(self.round_began).or(Some(Duration::ZERO));
    }

    /// Sets the alarm from the axes' faults.
    pub(super) fn renew_alarm(&mut self) {
        let mut faults = self.axes.iter().filter_map(|state| Some((state.name, state.fault?)));
        self.alarm = faults.next_back().map(|(name, flag)| Alarm {
            code: flag.code(),
            axis: Some(name),
            meaning: flag.meaning(),
        });
    }

    /// True if an axis reports motion.
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
        let command = HostCommand { device: state.axis.device, axis, id: Some(id), text: request.text() };
        if request.moves() {
            self.actions.push(Action::Move(command.encode(self.config.checksums)));
        } else {
            self.send(&command);
        }
    }

    fn send(&mut self, command: &HostCommand) {
        self.actions.push(Action::Send(command.encode(self.config.checksums)));
    }

    /// Ids start again at 0 after 99. The id of a stop is not used again while it is under way.
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
