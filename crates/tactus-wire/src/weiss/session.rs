//! The host's side of the conversation.

use core::time::Duration;

use super::ticks::{Placed, Ticks};
use super::{
    Checksum, ControllerInfo, Decoder, ErrorCode, Frame, FrameError, InfoError, MatrixInfo, Packet,
    SensorInfo, acquire, id, query_controller, query_matrix, query_sensor,
};
use crate::sensor::{self, Action, Cause, Loss, LossEvidence, Reading};

/// Length of a tick of the controller's clock.
pub const TICK: Duration = Duration::from_millis(1);

/// A question that is not answered is asked again after this; an acquisition without fresh frames too.
pub const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// How often a question is asked before the link is given up: well over the 8 s that the controller takes to boot.
const ASKED_MAX: u32 = 15;

/// Reads one connection to a controller: switches the acquisition off, queries the controller, its sensor and matrix,
/// switches the acquisition on, and reads frames.
#[derive(Debug)]
pub struct Session {
    config: Config,
    decoder: Decoder,
    ticks: Ticks,
    state: State,
    device: Device,
    /// Frames that were dropped because they came twice or late.
    stale_frames: u64,
}

/// What is asked of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// Rows of the array. A frame with another number of elements than rows times columns ends the session.
    pub rows: usize,
    /// Columns of the array.
    pub cols: usize,
    /// Frames per second.
    pub fps: u16,
    /// Have frames run-length encoded.
    pub run_length: bool,
    /// How the controller's firmware closes packets, both ways.
    pub checksum: Checksum,
}

/// What the controller reports about itself.
#[derive(Debug, Clone, PartialEq, Default)]
struct Device {
    controller: ControllerInfo,
    sensor: SensorInfo,
    /// The sensor's first matrix.
    matrix: MatrixInfo,
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
        let max_payload_bytes = (5 + 4 * config.elements()).max(1024);
        Self {
            config,
            decoder: Decoder::with_max_payload(max_payload_bytes).with_checksum(config.checksum),
            ticks: Ticks::default(),
            state: State::Over,
            device: Device::default(),
            stale_frames: 0,
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
        let Frame { timestamp_ms, counts, .. } = Frame::parse(packet, self.config.elements())?;
        let (tick_ms, new_clock) = match self.ticks.place(now, timestamp_ms) {
            Placed::Next { tick_ms } => (tick_ms, false),
            Placed::NewClock { tick_ms } => (tick_ms, true),
            Placed::Stale => {
                self.stale_frames += 1;
                return Ok(());
            }
        };
        if matches!(self.state, State::Asking { .. }) {
            actions.push(Action::Connected { identity: Some(self.device.identity()) });
            actions.extend(self.device.mismatch(self.config).map(Action::Warning));
        }
        self.state = State::Running { deadline: now + ANSWER_TIMEOUT };
        actions.push(Action::Reading(Reading {
            tick: Some(tick_ms),
            new_clock,
            evidence: LossEvidence::TimesOnly,
            counts: counts.into_iter().map(f32::from).collect(),
            bad: Vec::new(),
        }));
        Ok(())
    }

    /// Begins anew: the controller forgot what it was told, and takes commands again soon.
    fn restart(&mut self, now: Duration, actions: &mut Vec<Action>) {
        match self.state {
            State::Over => return,
            State::Running { .. } => actions.push(Action::Lost(restarted())),
            State::Asking { .. } => {}
        }
        self.ticks = Ticks::default();
        actions.push(self.ask(now, Question::SwitchOff, 1));
    }
}

impl sensor::Session for Session {
    fn name(&self) -> String {
        match self.config.checksum {
            Checksum::Crc => "weiss-dsa".to_owned(),
            Checksum::Sum8 => "weiss-dsa, sum8".to_owned(),
        }
    }

    fn tick_ns(&self) -> u64 {
        sensor::whole_ns(TICK)
    }

    fn start(&mut self, now: Duration) -> Vec<Action> {
        vec![self.ask(now, Question::SwitchOff, 1)]
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
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
                actions.push(Action::Failed(error.into()));
            }
        }
        self.decoder = decoder;
        if self.decoder.stats().boot_messages > boots_before {
            self.restart(now, &mut actions);
        }
        actions
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        match self.state {
            State::Asking { question, asked, deadline } if now >= deadline => {
                if asked < ASKED_MAX {
                    return vec![self.ask(now, question, asked + 1)];
                }
                self.state = State::Over;
                let error = SessionError::Silent { question: question.name(), asked };
                vec![Action::Failed(error.into())]
            }
            State::Running { deadline } if now >= deadline => {
                vec![Action::Lost(silent()), self.ask(now, Question::SwitchOn, 1)]
            }
            State::Asking { .. } | State::Running { .. } | State::Over => Vec::new(),
        }
    }

    fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Asking { deadline, .. } | State::Running { deadline } => Some(deadline),
            State::Over => None,
        }
    }

    fn quality(&self) -> String {
        let (stats, stale) = (self.decoder.stats(), self.stale_frames);
        format!(
            "{} bad checksums, {} bytes skipped, {stale} stale frames",
            stats.bad_checksums, stats.skipped_bytes
        )
    }
}

impl Config {
    fn elements(&self) -> usize {
        self.rows * self.cols
    }
}

impl Device {
    fn identity(&self) -> String {
        let Self { controller, sensor, .. } = self;
        format!(
            "controller serial {}, software {}, sensor serial {}",
            controller.serial_number, controller.software_version, sensor.serial_number
        )
    }

    /// That the matrix reports another shape than the rig file.
    fn mismatch(&self, Config { rows, cols, .. }: Config) -> Option<String> {
        let (own_rows, own_cols) = (usize::from(self.matrix.cells_y), usize::from(self.matrix.cells_x));
        ((own_rows, own_cols) != (rows, cols)).then(|| {
            format!("the matrix reports {own_rows} rows and {own_cols} columns, the rig's array has {rows} and {cols}")
        })
    }
}

impl From<SessionError> for Loss {
    fn from(error: SessionError) -> Self {
        let (cause, remedy) = match error {
            SessionError::Silent { .. } => {
                (Cause::Silent, "is it the sensor, is it switched on, and is the bit rate right?")
            }
            SessionError::Refused { .. } => (Cause::DeviceFault, "see the controller's manual"),
            SessionError::Answer(_) | SessionError::Frame(_) => {
                (Cause::Protocol, "is it the sensor that the rig file describes?")
            }
        };
        Self::new(cause, format!("{error}: {remedy}"))
    }
}

fn silent() -> Loss {
    Loss::new(Cause::Silent, format!("no fresh frame for {} s", ANSWER_TIMEOUT.as_secs()))
}

fn restarted() -> Loss {
    Loss::new(Cause::Restarted, "the controller has restarted")
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
