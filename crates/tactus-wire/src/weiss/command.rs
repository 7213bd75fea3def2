//! Commands of the host, and the device's acknowledgement.

use super::{ErrorCode, Packet, encode_packet, id};

/// Flag of the acquire command: send frames continuously.
const RUN: u8 = 0x80;
/// Flag of the acquire command: run-length encode frames.
const RUN_LENGTH: u8 = 0x01;

/// Command that configures the acquisition: whether to send frames, their encoding, and their rate in Hz. Answered by [`acknowledge`] with [`id::ACQUIRE`].
pub fn acquire(run: bool, run_length: bool, fps: u16) -> Vec<u8> {
    let flags = if run { RUN } else { 0 } | if run_length { RUN_LENGTH } else { 0 };
    let [fps_low, fps_high] = fps.to_le_bytes();
    encode_packet(id::ACQUIRE, &[flags, fps_low, fps_high])
}

/// Query for [`ControllerInfo`](super::ControllerInfo).
pub fn query_controller() -> Vec<u8> {
    encode_packet(id::CONTROLLER, &[])
}

/// Query for [`SensorInfo`](super::SensorInfo).
pub fn query_sensor() -> Vec<u8> {
    encode_packet(id::SENSOR, &[])
}

/// Query for the [`MatrixInfo`](super::MatrixInfo) of one matrix, counted from 0.
pub fn query_matrix(matrix: u8) -> Vec<u8> {
    encode_packet(id::MATRIX, &[matrix])
}

/// The device's acknowledgement of a command: an error code.
pub fn acknowledge(id: u8, code: ErrorCode) -> Vec<u8> {
    encode_packet(id, &code.0.to_le_bytes())
}

/// A command of the host, as the device decodes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HostCommand {
    /// [`query_controller`].
    QueryController,
    /// [`query_sensor`].
    QuerySensor,
    /// [`query_matrix`].
    QueryMatrix {
        /// Number of the matrix, counted from 0.
        matrix: u8,
    },
    /// [`acquire`].
    Acquire {
        /// Send frames continuously.
        run: bool,
        /// Run-length encode the frames.
        run_length: bool,
        /// Frames per second.
        fps: u16,
    },
}

/// Why a packet is not a known command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum CommandError {
    /// No command has this id.
    #[error("there is no command {id:#04x}")]
    Unknown { id: u8 },
    /// Its payload has another length.
    #[error("command {id:#04x} with {bytes} bytes of payload")]
    Length { id: u8, bytes: usize },
}

impl HostCommand {
    /// Parses a command.
    ///
    /// # Errors
    /// If the command is unknown, or its payload has a wrong length.
    pub fn parse(packet: &Packet<'_>) -> Result<Self, CommandError> {
        match (packet.id, packet.payload) {
            (id::CONTROLLER, []) => Ok(Self::QueryController),
            (id::SENSOR, []) => Ok(Self::QuerySensor),
            (id::MATRIX, [matrix]) => Ok(Self::QueryMatrix { matrix: *matrix }),
            (id::ACQUIRE, [flags, fps_low, fps_high]) => Ok(Self::Acquire {
                run: flags & RUN != 0,
                run_length: flags & RUN_LENGTH != 0,
                fps: u16::from_le_bytes([*fps_low, *fps_high]),
            }),
            (id::CONTROLLER | id::SENSOR | id::MATRIX | id::ACQUIRE, payload) => {
                Err(CommandError::Length { id: packet.id, bytes: payload.len() })
            }
            (id, _) => Err(CommandError::Unknown { id }),
        }
    }
}

#[cfg(test)]
#[path = "command_tests.rs"]
mod tests;
