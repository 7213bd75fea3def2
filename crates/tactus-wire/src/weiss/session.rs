//! The host's side of a connection to a controller.

use core::time::Duration;

use super::ticks::{TickOrder, TickUnwrapper};
use super::{
    Checksum, ControllerInfo, Decoder, ErrorCode, FrameError, InfoError, MatrixInfo, PackedFrame, Packet,
    SensorInfo, acquire, id, query_controller, query_matrix, query_sensor,
};
use crate::sensor::{self, Action, Cause, Loss, LossEvidence, Memory, Reading};

/// Length of a tick of the controller's clock.
pub const TICK: Duration = Duration::from_millis(1);

/// An unanswered query is sent again after this. An acquisition without fresh frames is switched on again.
pub const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Attempts at a query before the link is given up. At 1 s each, that is well over the 8 s in which the controller boots.
const ASKED_MAX: u32 = 15;

/// Reads one connection to a controller: switches the acquisition off, queries the controller, its sensor and matrix,
/// switches the acquisition on, and reads frames.
#[derive(Debug)]
pub struct Session {
    config: Config,
    decoder: Decoder,
    ticks: TickUnwrapper,
    memory: Memory,
    state: State,
    device: Device,
    /// Frames that were dropped because they came twice or late.
    stale_frames: u64,
}

/// Requirements on the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// Rows of the array. A frame with another number of elements than rows times columns ends the session.
    pub rows: usize,
    /// Columns of the array.
    pub cols: usize,
    /// Frame rate in Hz.
    pub fps: u16,
    /// Request run-length encoded frames.
    pub run_length: bool,
    /// Form of the checksum that the controller's firmware uses, in both directions.
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

/// Why a session has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum SessionError {
    /// A query was repeated without an answer.
    #[error("the controller did not answer {asked} times to {query}")]
    Silent { query: &'static str, asked: u32 },
    /// The controller refused a command.
    #[error("the controller refused {query}: error {}, {}", code.0, code.meaning())]
    Refused { query: &'static str, code: ErrorCode },
    /// An answer has a wrong form.
    #[error("{0}")]
    Answer(#[from] InfoError),
    /// A frame has a wrong form or number of elements.
    #[error("{0}")]
    DecodedFrame(#[from] FrameError),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Asking { query: Query, asked: u32, deadline: Duration },
    Running { deadline: Duration },
    Over,
}

/// The queries and commands, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Query {
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
        // Room for the longest reply, and for frames of other arrays, so that the error can name their size.
        let max_payload_bytes = (5 + 4 * config.elements()).max(1024);
        Self {
            config,
            decoder: Decoder::with_max_payload(max_payload_bytes).with_checksum(config.checksum),
            ticks: TickUnwrapper::default(),
            memory: Memory::default(),
            state: State::Over,
            device: Device::default(),
            stale_frames: 0,
        }
    }

    fn ask(&mut self, now: Duration, query: Query, asked: u32) -> Action {
        self.state = State::Asking { query, asked, deadline: now + ANSWER_TIMEOUT };
        let packet = match query {
            Query::SwitchOff => acquire(false, false, 0),
            Query::Controller => query_controller(),
            Query::Sensor => query_sensor(),
            Query::Matrix => query_matrix(0),
            Query::SwitchOn => acquire(true, self.config.run_length, self.config.fps),
        };
        Action::Send(self.config.checksum.close(packet))
    }

    fn handle(
        &mut self,
        now: Duration,
        packet: &Packet<'_>,
        actions: &mut Vec<Action>,
    ) -> Result<(), SessionError> {
        let State::Asking { query, .. } = self.state else {
            if matches!(self.state, State::Running { .. }) && packet.id == id::FRAME {
                self.handle_frame(now, packet, actions)?;
            }
            return Ok(());
        };
        let next = match (query, packet.id) {
            (Query::SwitchOff, id::ACQUIRE) => Query::Controller,
            (Query::Controller, id::CONTROLLER) => {
                self.device.controller = ControllerInfo::parse(packet)?;
                query.check(self.device.controller.error)?;
                Query::Sensor
            }
            (Query::Sensor, id::SENSOR) => {
                self.device.sensor = SensorInfo::parse(packet)?;
                query.check(self.device.sensor.error)?;
                Query::Matrix
            }
            (Query::Matrix, id::MATRIX) => {
                self.device.matrix = MatrixInfo::parse(packet)?;
                query.check(self.device.matrix.error)?;
                Query::SwitchOn
            }
            (Query::SwitchOn, id::ACQUIRE) => {
                let code = packet.payload.first_chunk().map(|code| ErrorCode(u16::from_le_bytes(*code)));
                return query.check(code.unwrap_or_default());
            }
            (Query::SwitchOn, id::FRAME) => return self.handle_frame(now, packet, actions),
            // Frames of an earlier acquisition, and late answers to repeated queries.
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
        let elements = self.config.elements();
        let frame = PackedFrame::parse(packet, elements)?;
        let (tick_ms, new_clock) = match self.ticks.place(now, frame.timestamp_ms) {
            TickOrder::Next { tick_ms } => (tick_ms, false),
            TickOrder::NewClock { tick_ms } => (tick_ms, true),
            TickOrder::Stale => {
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
            counts: self.memory.counts(elements, |counts| frame.write_to(counts)),
            bad: Vec::new(),
            temperature_c: None,
        }));
        Ok(())
    }

    /// Starts again after a restart: the controller has lost its configuration.
    fn restart(&mut self, now: Duration, actions: &mut Vec<Action>) {
        match self.state {
            State::Over => return,
            State::Running { .. } => actions.push(Action::Lost(restarted())),
            State::Asking { .. } => {}
        }
        self.ticks = TickUnwrapper::default();
        actions.push(self.ask(now, Query::SwitchOff, 1));
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
        vec![self.ask(now, Query::SwitchOff, 1)]
    }

    fn receive_into(&mut self, now: Duration, bytes: &[u8], actions: &mut Vec<Action>) {
        let boots_before = self.decoder.stats().boot_messages;
        self.decoder.push(bytes);
        // The decoder is moved out of `self`, because its packets borrow from it.
        let mut decoder = core::mem::take(&mut self.decoder);
        while let Some(packet) = decoder.next_packet() {
            // The decoder counts wrong checksums. A lost reply is requested again.
            let Ok(packet) = packet else { continue };
            if let Err(error) = self.handle(now, &packet, actions) {
                self.state = State::Over;
                actions.push(Action::Failed(error.into()));
            }
        }
        self.decoder = decoder;
        if self.decoder.stats().boot_messages > boots_before {
            self.restart(now, actions);
        }
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        match self.state {
            State::Asking { query, asked, deadline } if now >= deadline => {
                if asked < ASKED_MAX {
                    return vec![self.ask(now, query, asked + 1)];
                }
                self.state = State::Over;
                let error = SessionError::Silent { query: query.name(), asked };
                vec![Action::Failed(error.into())]
            }
            State::Running { deadline } if now >= deadline => {
                vec![Action::Lost(silent()), self.ask(now, Query::SwitchOn, 1)]
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

    /// A warning if the matrix reports another shape than the rig file.
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
            SessionError::Answer(_) | SessionError::DecodedFrame(_) => {
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

impl Query {
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
            Err(SessionError::Refused { query: self.name(), code })
        }
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
