//! Handles messages from devices.

use core::time::Duration;

use super::axis_state::{AxisState, Reference};
use super::phase::Phase;
use super::request::{Answer, Pending, Request, SlotRequest};
use super::{Action, Failure, Session, SessionError};
use crate::stage::Alarm;
use crate::zaber::{Flag, Header, Message, Rejection, Severity};

impl Session {
    /// Handles a message.
    pub(super) fn handle(&mut self, now: Duration, message: &Message) {
        match message {
            _ if matches!(self.phase, Phase::Over) => {}
            Message::Reply { header, accepted, busy, flag, data } => {
                self.handle_reply(now, *header, *accepted, *busy, *flag, data);
            }
            Message::Alert { header, flag, .. } => self.handle_alert(now, *header, *flag),
            Message::Info { .. } => {}
        }
    }

    fn handle_reply(
        &mut self,
        now: Duration,
        header: Header,
        accepted: bool,
        busy: bool,
        flag: Flag,
        data: &str,
    ) {
        if let Phase::Stopping(stop) = &mut self.phase
            && header.id == Some(stop.id)
        {
            if accepted {
                stop.unheard.retain(|device| *device != header.device);
            }
            return;
        }
        let Some(pending) = self.pending.filter(|pending| self.is_answer(pending, header)) else {
            self.ignored += 1;
            return;
        };
        let request = pending.request;
        if !accepted {
            return self.handle_rejection(now, request, &Rejection::parse(data));
        }
        let Some(answer) = request.request.read(data) else {
            self.ignored += 1;
            return;
        };
        self.pending = None;
        if !self.take_answer(request, busy, answer.clone()) || request.request.is_of_device() {
            return;
        }
        let all = if let Answer::Flags(flags) = &answer { Some(&flags[..]) } else { None };
        if self.handle_flags(now, request, flag, all) && self.queue.is_empty() {
            self.conclude(now);
        }
    }

    fn is_answer(&self, pending: &Pending, header: Header) -> bool {
        let SlotRequest { slot, request } = pending.request;
        let Some(state) = self.axes.get(slot) else { return false };
        let axis = if request.is_of_device() { 0 } else { state.axis.number };
        header == Header { device: state.axis.device, axis, id: Some(pending.id) }
    }

    /// Takes the data of an answer. False if they end the session.
    fn take_answer(
        &mut self,
        SlotRequest { slot, request }: SlotRequest,
        busy: bool,
        answer: Answer,
    ) -> bool {
        let Some(state) = self.axes.get_mut(slot) else { return true };
        if !request.is_of_device() {
            state.busy = busy;
        }
        match (request, answer) {
            (Request::Position, Answer::Number(number)) => state.position = number,
            (Request::Resolution, Answer::Number(found)) => {
                let needed = state.axis.resolution.map_or(found, i64::from);
                if found != needed {
                    let name = state.name;
                    self.fail(SessionError::Setting { setting: "resolution", name, found, needed });
                    return false;
                }
            }
            (Request::LimitMin, Answer::Number(number)) => state.limit_min = number,
            (Request::LimitMax, Answer::Number(number)) => state.limit_max = number,
            (Request::AxisCount, Answer::Number(axis_count)) if axis_count < i64::from(state.axis.number) => {
                let (device, number, name) = (state.axis.device, state.axis.number, state.name);
                self.fail(SessionError::NoAxis { device, number, name, axis_count });
                return false;
            }
            (Request::Version, Answer::Text(version)) => {
                let device = state.axis.device;
                let separator = if self.identity.is_empty() { "" } else { ", " };
                let device = format!("{separator}device {device} firmware {version}");
                self.identity.push_str(&device);
            }
            _ => {}
        }
        true
    }

    fn handle_rejection(&mut self, now: Duration, request: SlotRequest, rejection: &Rejection) {
        let command = request.request.text();
        let moving = matches!(self.phase, Phase::Moving(_) | Phase::Homing { .. });
        match request.request {
            Request::Move(_) | Request::Home | Request::Speed(_) | Request::Accel(_) if moving => {
                let name =
                    self.axes.get(request.slot).map(|state| state.name.to_string()).unwrap_or_default();
                let failure = Failure::Refused { command, reason: format!("{name}: {rejection}") };
                self.halt_all(now, Some(failure));
            }
            // The warnings show what is still wrong.
            Request::Clear | Request::Enable => {
                self.pending = None;
            }
            // It is sent again after the timeout.
            request if *rejection == Rejection::Again && !request.moves() => {}
            Request::Checksums
            | Request::Version
            | Request::AxisCount
            | Request::Resolution
            | Request::LimitMin
            | Request::LimitMax
            | Request::Position
            | Request::Warnings
            | Request::Speed(_)
            | Request::Accel(_)
            | Request::Move(_)
            | Request::Home => {
                let device = self.device_of(request.slot);
                self.fail(SessionError::Refused { device, command, rejection: rejection.clone() });
            }
        }
    }

    /// An alert has no id and may be old, so it is believed only if it reports a problem.
    fn handle_alert(&mut self, now: Duration, header: Header, flag: Flag) {
        let is_meant = |state: &AxisState| {
            state.axis.device == header.device && (header.axis == 0 || header.axis == state.axis.number)
        };
        let severity = flag.severity();
        if self.axes.iter().any(is_meant) && !matches!(severity, Severity::None | Severity::Notice) {
            self.at_once = true;
        }
        if header.axis != 0
            && let Some(slot) = self.axes.iter().position(is_meant)
            && severity == Severity::Fault
        {
            self.handle_flags(now, SlotRequest { slot, request: Request::Warnings }, flag, None);
        }
    }

    /// Takes the flags of an axis. False if they end the command under way.
    fn handle_flags(
        &mut self,
        now: Duration,
        SlotRequest { slot, request }: SlotRequest,
        flag: Flag,
        all: Option<&[Flag]>,
    ) -> bool {
        let Some(state) = self.axes.get_mut(slot) else { return true };
        let is_new_fault = state.take_flags(flag, all);
        // Both flags stay until the next command, so only a new one shows an interruption.
        let is_others = matches!(flag, Flag::MANUAL_CONTROL | Flag::INTERRUPTED);
        if request.moves() {
            state.is_ours = !is_others;
        }
        let (name, is_lost, is_ours) = (state.name, state.reference == Reference::Lost, state.is_ours);
        if matches!(self.phase, Phase::Greeting | Phase::Clearing) {
            return true;
        }
        self.renew_alarm();
        if is_new_fault && let Some(alarm) = self.alarm {
            self.homed = false;
            self.fault(now, alarm);
            return false;
        }
        if is_lost && self.homed {
            self.homed = false;
            let why =
                format!("{name} no longer knows where it is: it was restarted, or pushed while it stood");
            self.actions.push(Action::Suspect { why });
            if let Phase::Moving(_) = self.phase {
                self.halt_all(now, Some(Failure::Unhomed));
                return false;
            }
        }
        let is_command = matches!(&self.phase, Phase::Moving(_) | Phase::Homing { .. });
        if is_command && is_ours && is_others {
            let position_mm = self.position_mm();
            self.halt_all(
                now,
                Some(Failure::Interrupted { axis: name, meaning: flag.meaning(), position_mm }),
            );
            return false;
        }
        true
    }

    /// Handles a fault of an axis: stops the others. The command under way ends when all stand still.
    fn fault(&mut self, now: Duration, alarm: Alarm) {
        match &mut self.phase {
            Phase::Stopping(stop) => {
                if stop.failure.is_some() {
                    stop.failure = Some(Failure::Alarm(alarm));
                }
                self.queue.clear();
                self.pending = None;
                self.at_once = true;
            }
            Phase::Moving(_) | Phase::Homing { .. } | Phase::Looking { .. } => {
                self.halt_all(now, Some(Failure::Alarm(alarm)));
            }
            Phase::Greeting | Phase::Ready | Phase::Clearing | Phase::Over => self.halt_all(now, None),
        }
        self.report();
    }
}
