//! The host's side of the conversation.

use core::time::Duration;

use super::ticks::{Placed, Ticks};
use super::{
    Checksum, ControllerInfo, Decoder, DecoderStats, ErrorCode, Frame, FrameError, InfoError, MatrixInfo,
    Packet, SensorInfo, acquire, id, query_controller, query_matrix, query_sensor,
};

/// A question that is not answered is asked again after this; an acquisition without fresh frames too.
pub const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// How often a question is asked before the link is given up: well over the 8 s that the controller takes to boot.
const ASKED_MAX: u32 = 15;

/// A conversation over one connection: switch the acquisition off, ask who is there, switch it on, read frames.
///
/// Call [`start`](Self::start) once, [`receive`](Self::receive) with what arrives and
/// [`timer`](Self::timer) when [`deadline`](Self::deadline) has come; do what the actions say, in their
/// order. Times never go back. After [`Action::Failed`] it does nothing more: open the link anew.
#[derive(Debug)]
pub struct Session {
    config: Config,
    decoder: Decoder,
    ticks: Ticks,
    state: State,
    device: Device,
    stale_frames: u64,
}

/// What is asked of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// Elements of a frame; a frame with another number ends the session.
    pub elements: usize,
    /// Frames per second.
    pub fps: u16,
    /// Have frames run-length encoded.
    pub run_length: bool,
    /// How the controller's firmware closes packets, both ways.
    pub checksum: Checksum,
}

/// What is there, as it says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Device {
    /// The controller.
    pub controller: ControllerInfo,
    /// The sensor.
    pub sensor: SensorInfo,
    /// The sensor's first matrix.
    pub matrix: MatrixInfo,
}

/// What the session wants done, or tells.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Write these bytes.
    Send(Vec<u8>),
    /// Frames flow from here on; comes just before the first, and again before the first after [`Action::Lost`].
    Connected(Box<Device>),
    /// A fresh reading.
    Frame(Reading),
    /// Frames have ceased; the session tries to have them again.
    Lost(Loss),
    /// The session is over.
    Failed(SessionError),
}

/// One reading.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reading {
    /// The controller's clock at the sampling, unwrapped.
    pub tick_ms: u64,
    /// The ticks of earlier readings are from another clock: this is the first reading, or the clock has jumped.
    pub new_clock: bool,
    /// Raw counts, row-major.
    pub counts: Vec<u16>,
}

/// Why frames have ceased.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Loss {
    /// None came.
    #[error("no fresh frame for {} s", ANSWER_TIMEOUT.as_secs())]
    Silent,
    /// The controller sent its boot message.
    #[error("the controller has restarted")]
    Restarted,
}

/// Why a session is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SessionError {
    /// A question was asked again and again without an answer.
    #[error("the controller did not answer {asked} times to {question}")]
    Silent {
        /// What was asked.
        question: &'static str,
        /// How often.
        asked: u32,
    },
    /// The controller refused.
    #[error("the controller refused {question}: error {}, {}", code.0, code.meaning())]
    Refused {
        /// What was asked.
        question: &'static str,
        /// Why.
        code: ErrorCode,
    },
    /// The controller answers in another form.
    #[error("{0}")]
    Answer(#[from] InfoError),
    /// The controller sends other frames.
    #[error("{0}")]
    Frame(#[from] FrameError),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Asking { question: Question, asked: u32, deadline: Duration },
    Running { deadline: Duration },
    Over,
}

/// The questions in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Question {
    SwitchOff,
    Controller,
    Sensor,
    Matrix,
    /// Answered by the first fresh frame, not by the acknowledgement.
    SwitchOn,
}

impl Session {
    /// A session that has not started.
    pub fn new(config: Config) -> Self {
        // Room for the longest reply and for other arrays, so that those can be named in the error.
        let max_payload_bytes = (5 + 4 * config.elements).max(1024);
        Self {
            config,
            decoder: Decoder::with_max_payload(max_payload_bytes).with_checksum(config.checksum),
            ticks: Ticks::default(),
            state: State::Over,
            device: Device::default(),
            stale_frames: 0,
        }
    }

    /// When [`timer`](Self::timer) is due; `None` once the session is over.
    pub fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Asking { deadline, .. } | State::Running { deadline } => Some(deadline),
            State::Over => None,
        }
    }

    /// What the decoder met beside good packets.
    pub fn decoder_stats(&self) -> DecoderStats {
        self.decoder.stats()
    }

    /// Frames that were dropped because they came twice or late.
    pub fn stale_frames(&self) -> u64 {
        self.stale_frames
    }

    /// Begins the conversation.
    pub fn start(&mut self, now: Duration) -> Vec<Action> {
        vec![self.ask(now, Question::SwitchOff, 1)]
    }

    /// Takes what arrived.
    pub fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut actions = Vec::new();
        let boots_before = self.decoder.stats().boot_messages;
        self.decoder.push(bytes);
        // The decoder is set aside while its packets, which borrow from it, are handled.
        let mut decoder = core::mem::take(&mut self.decoder);
        while let Some(packet) = decoder.next_packet() {
            // A packet with a wrong checksum is counted there; a lost reply is asked for again.
            let Ok(packet) = packet else { continue };
            if let Err(error) = self.handle(now, &packet, &mut actions) {
                self.state = State::Over;
                actions.push(Action::Failed(error));
            }
        }
        self.decoder = decoder;
        if self.decoder.stats().boot_messages > boots_before {
            self.restart(now, &mut actions);
        }
        actions
    }

    /// Does what is due at [`deadline`](Self::deadline).
    pub fn timer(&mut self, now: Duration) -> Vec<Action> {
        match self.state {
            State::Asking { question, asked, deadline } if now >= deadline => {
                if asked < ASKED_MAX {
                    return vec![self.ask(now, question, asked + 1)];
                }
                self.state = State::Over;
                vec![Action::Failed(SessionError::Silent { question: question.name(), asked })]
            }
            State::Running { deadline } if now >= deadline => {
                vec![Action::Lost(Loss::Silent), self.ask(now, Question::SwitchOn, 1)]
            }
            State::Asking { .. } | State::Running { .. } | State::Over => Vec::new(),
        }
    }

    fn ask(&mut self, now: Duration, question: Question, asked: u32) -> Action {
        self.state = State::Asking { question, asked, deadline: now + ANSWER_TIMEOUT };
        let packet = match question {
            Question::SwitchOff => acquire(false, false, 0),
            Question::Controller => query_controller(),
            Question::Sensor => query_sensor(),
            Question::Matrix => query_matrix(0),
            Question::SwitchOn => acquire(true, self.config.run_length, self.config.fps),
        };
        Action::Send(self.config.checksum.close(packet))
    }

    fn handle(
        &mut self,
        now: Duration,
        packet: &Packet<'_>,
        actions: &mut Vec<Action>,
    ) -> Result<(), SessionError> {
        let State::Asking { question, .. } = self.state else {
            if matches!(self.state, State::Running { .. }) && packet.id == id::FRAME {
                self.handle_frame(now, packet, actions)?;
            }
            return Ok(());
        };
        let next = match (question, packet.id) {
            (Question::SwitchOff, id::ACQUIRE) => Question::Controller,
            (Question::Controller, id::CONTROLLER) => {
                self.device.controller = ControllerInfo::parse(packet)?;
                question.check(self.device.controller.error)?;
                Question::Sensor
            }
            (Question::Sensor, id::SENSOR) => {
                self.device.sensor = SensorInfo::parse(packet)?;
                question.check(self.device.sensor.error)?;
                Question::Matrix
            }
            (Question::Matrix, id::MATRIX) => {
                self.device.matrix = MatrixInfo::parse(packet)?;
                question.check(self.device.matrix.error)?;
                Question::SwitchOn
            }
            (Question::SwitchOn, id::ACQUIRE) => {
                let code = packet.payload.first_chunk().map(|code| ErrorCode(u16::from_le_bytes(*code)));
                return question.check(code.unwrap_or_default());
            }
            (Question::SwitchOn, id::FRAME) => return self.handle_frame(now, packet, actions),
            // Frames of an earlier acquisition, and late answers to questions asked twice.
            _ => return Ok(()),
        };
        actions.push(self.ask(now, next, 1));
        Ok(())
    }

    fn handle_frame(
        &mut self,
        now: Duration,
        packet: &Packet<'_>,
        actions: &mut Vec<Action>,
    ) -> Result<(), SessionError> {
        let Frame { timestamp_ms, counts, .. } = Frame::parse(packet, self.config.elements)?;
        let (tick_ms, new_clock) = match self.ticks.place(now, timestamp_ms) {
            Placed::Next { tick_ms } => (tick_ms, false),
            Placed::NewClock { tick_ms } => (tick_ms, true),
            Placed::Stale => {
                self.stale_frames += 1;
                return Ok(());
            }
        };
        if matches!(self.state, State::Asking { .. }) {
            actions.push(Action::Connected(Box::new(self.device.clone())));
        }
        self.state = State::Running { deadline: now + ANSWER_TIMEOUT };
        actions.push(Action::Frame(Reading { tick_ms, new_clock, counts }));
        Ok(())
    }

    /// Begins anew: the controller forgot what it was told, and takes commands again soon.
    fn restart(&mut self, now: Duration, actions: &mut Vec<Action>) {
        match self.state {
            State::Over => return,
            State::Running { .. } => actions.push(Action::Lost(Loss::Restarted)),
            State::Asking { .. } => {}
        }
        self.ticks = Ticks::default();
        actions.push(self.ask(now, Question::SwitchOff, 1));
    }
}

impl Question {
    fn name(self) -> &'static str {
        match self {
            Self::SwitchOff => "switching the acquisition off",
            Self::Controller => "the query for its configuration",
            Self::Sensor => "the query for its sensor",
            Self::Matrix => "the query for its matrix",
            Self::SwitchOn => "switching the acquisition on",
        }
    }

    fn check(self, code: ErrorCode) -> Result<(), SessionError> {
        if code == ErrorCode::SUCCESS {
            Ok(())
        } else {
            Err(SessionError::Refused { question: self.name(), code })
        }
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
