//! The controller's information about itself, its sensor and its matrices.

use super::{Packet, encode_packet, id};

/// The controller's error number; 0 is success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ErrorCode(pub u16);

/// Meanings of the error numbers, in order.
const MEANINGS: [&str; 28] = [
    "success",
    "not available",
    "no sensor connected",
    "not initialised",
    "already running",
    "feature not supported",
    "inconsistent data",
    "timeout",
    "read error",
    "write error",
    "insufficient resources",
    "checksum error",
    "not enough parameters",
    "unknown command",
    "command format error",
    "access denied",
    "already open",
    "command failed",
    "command aborted",
    "invalid handle",
    "device not found",
    "device not opened",
    "input/output error",
    "invalid parameter",
    "index out of bounds",
    "command pending",
    "overrun",
    "range error",
];

impl ErrorCode {
    /// No error.
    pub const SUCCESS: Self = Self(0);
    /// The command is unknown.
    pub const UNKNOWN_COMMAND: Self = Self(13);
    /// The command's payload has a wrong form.
    pub const FORMAT: Self = Self(14);
    /// There is no such matrix.
    pub const INDEX_OUT_OF_BOUNDS: Self = Self(24);

    /// Its meaning in words.
    pub fn meaning(self) -> &'static str {
        MEANINGS.get(usize::from(self.0)).copied().unwrap_or("unknown error")
    }
}

/// Reply to [`query_controller`](super::query_controller).
///
/// The published description has 19 bytes: after these fields, the sensor controller's type, the active interface, the CAN
/// bit rate (u32) and the CAN id (u16). The firmware sends 18, and it is unknown which byte is missing. So the bytes after
/// the flags are not decoded.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ControllerInfo {
    /// 0 if the query succeeded.
    pub error: ErrorCode,
    /// Serial number of the controller.
    pub serial_number: u32,
    /// Version of its hardware: two binary-coded decimal digits.
    pub hardware_version: u8,
    /// Version of its software.
    pub software_version: u16,
    /// Not described by the source.
    pub status_flags: u8,
    /// Not described by the source.
    pub feature_flags: u8,
    /// Sensor controller type, interface and CAN settings, not decoded.
    pub rest: [u8; 7],
}

/// Reply to [`query_sensor`](super::query_sensor).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SensorInfo {
    /// 0 if the query succeeded.
    pub error: ErrorCode,
    /// Number of matrices in a frame.
    pub matrices: u16,
    /// Author of the description, by number.
    pub generated_by: u16,
    /// Revision of the sensor's hardware.
    pub hardware_revision: u8,
    /// Serial number of the sensor.
    pub serial_number: u32,
    /// Not described by the source.
    pub feature_flags: u8,
}

/// Reply to [`query_matrix`](super::query_matrix).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MatrixInfo {
    /// 0 if the query succeeded.
    pub error: ErrorCode,
    /// Width and height of an element.
    pub element_mm: [f32; 2],
    /// Columns.
    pub cells_x: u16,
    /// Rows.
    pub cells_y: u16,
    /// Unique id.
    pub uid: [u8; 6],
    /// Revision of the matrix' hardware.
    pub hardware_revision: u8,
    /// Centre of the matrix in the sensor's frame.
    pub centre_mm: [f32; 3],
    /// Orientation of the matrix in the sensor's frame; its unit is unknown.
    pub theta: [f32; 3],
    /// Reading at full scale; its unit is unknown.
    pub full_scale: f32,
    /// Not described by the source.
    pub feature_flags: u8,
}

/// Why a packet is not the expected reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("reply {id:#04x} has {found} bytes of payload, not {expected}")]
pub struct InfoError {
    /// The packet's id.
    pub id: u8,
    /// Length of the expected reply's payload.
    pub expected: usize,
    /// Length of the packet's payload; 0 if it is another reply.
    pub found: usize,
}

impl ControllerInfo {
    const BYTES: usize = 18;

    /// Decodes the reply.
    ///
    /// # Errors
    /// If it is another packet, or has another length.
    pub fn parse(packet: &Packet<'_>) -> Result<Self, InfoError> {
        let mut fields = Fields::of::<{ Self::BYTES }>(packet, id::CONTROLLER)?;
        Ok(Self {
            error: ErrorCode(u16::from_le_bytes(fields.take())),
            serial_number: u32::from_le_bytes(fields.take()),
            hardware_version: fields.byte(),
            software_version: u16::from_le_bytes(fields.take()),
            status_flags: fields.byte(),
            feature_flags: fields.byte(),
            rest: fields.take(),
        })
    }

    /// Encodes the reply as a packet.
    pub fn encode(&self) -> Vec<u8> {
        let mut payload = Vec::with_capacity(Self::BYTES);
        payload.extend(self.error.0.to_le_bytes());
        payload.extend(self.serial_number.to_le_bytes());
        payload.push(self.hardware_version);
        payload.extend(self.software_version.to_le_bytes());
        payload.push(self.status_flags);
        payload.push(self.feature_flags);
        payload.extend(self.rest);
        encode_packet(id::CONTROLLER, &payload)
    }
}

impl SensorInfo {
    const BYTES: usize = 12;

    /// Decodes the reply.
    ///
    /// # Errors
    /// If it is another packet, or has another length.
    pub fn parse(packet: &Packet<'_>) -> Result<Self, InfoError> {
        let mut fields = Fields::of::<{ Self::BYTES }>(packet, id::SENSOR)?;
        Ok(Self {
            error: ErrorCode(u16::from_le_bytes(fields.take())),
            matrices: u16::from_le_bytes(fields.take()),
            generated_by: u16::from_le_bytes(fields.take()),
            hardware_revision: fields.byte(),
            serial_number: u32::from_le_bytes(fields.take()),
            feature_flags: fields.byte(),
        })
    }

    /// Encodes the reply as a packet.
    pub fn encode(&self) -> Vec<u8> {
        let mut payload = Vec::with_capacity(Self::BYTES);
        payload.extend(self.error.0.to_le_bytes());
        payload.extend(self.matrices.to_le_bytes());
        payload.extend(self.generated_by.to_le_bytes());
        payload.push(self.hardware_revision);
        payload.extend(self.serial_number.to_le_bytes());
        payload.push(self.feature_flags);
        encode_packet(id::SENSOR, &payload)
    }
}

impl MatrixInfo {
    const BYTES: usize = 52;

    /// Decodes the reply.
    ///
    /// # Errors
    /// If it is another packet, or has another length.
    pub fn parse(packet: &Packet<'_>) -> Result<Self, InfoError> {
        let mut fields = Fields::of::<{ Self::BYTES }>(packet, id::MATRIX)?;
        Ok(Self {
            error: ErrorCode(u16::from_le_bytes(fields.take())),
            element_mm: [fields.f32(), fields.f32()],
            cells_x: u16::from_le_bytes(fields.take()),
            cells_y: u16::from_le_bytes(fields.take()),
            uid: fields.take(),
            hardware_revision: {
                let [_reserved_0, _reserved_1, revision] = fields.take();
                revision
            },
            centre_mm: [fields.f32(), fields.f32(), fields.f32()],
            theta: [fields.f32(), fields.f32(), fields.f32()],
            full_scale: fields.f32(),
            feature_flags: fields.byte(),
        })
    }

    /// Encodes the reply as a packet.
    pub fn encode(&self) -> Vec<u8> {
        let mut payload = Vec::with_capacity(Self::BYTES);
        payload.extend(self.error.0.to_le_bytes());
        payload.extend(self.element_mm.iter().flat_map(|value| value.to_le_bytes()));
        payload.extend(self.cells_x.to_le_bytes());
        payload.extend(self.cells_y.to_le_bytes());
        payload.extend(self.uid);
        payload.extend([0, 0]);
        payload.push(self.hardware_revision);
        payload.extend(self.centre_mm.iter().flat_map(|value| value.to_le_bytes()));
        payload.extend(self.theta.iter().flat_map(|value| value.to_le_bytes()));
        payload.extend(self.full_scale.to_le_bytes());
        payload.push(self.feature_flags);
        encode_packet(id::MATRIX, &payload)
    }
}

/// Takes fields from the front of a payload whose length has been checked.
struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    fn of<const BYTES: usize>(packet: &Packet<'a>, id: u8) -> Result<Self, InfoError> {
        if packet.id != id || packet.payload.len() != BYTES {
            let found = if packet.id == id { packet.payload.len() } else { 0 };
            return Err(InfoError { id, expected: BYTES, found });
        }
        Ok(Self { rest: packet.payload })
    }

    /// The next `N` bytes. Zeros past the end, which the check of the length excludes.
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let Some((field, rest)) = self.rest.split_first_chunk::<N>() else { return [0; N] };
        self.rest = rest;
        *field
    }

    fn byte(&mut self) -> u8 {
        let [byte] = self.take();
        byte
    }

    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }
}

#[cfg(test)]
#[path = "info_tests.rs"]
mod tests;
