//! The description as written in a file.

use serde::{Deserialize, Serialize};

/// Name of the schema, as written in the file.
pub const SCHEMA: &str = "tactus.link/1";

/// A description as written. [`check`](RawFormat::check) makes a [`Format`](super::Format) of it.
///
/// Offsets are in bytes from the beginning of the frame, which is its first sync byte. Negative offsets are from its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFormat {
    /// Must be [`SCHEMA`].
    pub schema: String,
    /// Name of the device.
    pub name: String,
    /// Whether bytes arrive as a stream or in packets.
    #[serde(default)]
    pub framing: Framing,
    /// Length and marks of a frame.
    pub frame: RawFrame,
    /// The elements' values.
    pub samples: RawSamples,
    /// The device's count of frames.
    pub sequence: Option<RawSequence>,
    /// The device's clock.
    pub timestamp: Option<RawTimestamp>,
    /// The checksum; `None` if frames have none.
    pub checksum: Option<RawChecksum>,
    /// For human interface devices.
    pub hid: Option<RawHid>,
    /// For devices on a USB endpoint.
    pub usb: Option<RawUsb>,
}

/// Whether bytes arrive as a stream or in packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Framing {
    /// In pieces of any length, as from a serial port. Sync bytes mark the beginning of a frame.
    #[default]
    Stream,
    /// Each read is one frame: a HID report, a transfer or a datagram.
    Packet,
}

/// Length and marks of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFrame {
    /// Length of the whole frame, from the first sync byte to the last byte of checksum and trailer.
    pub bytes: usize,
    /// The bytes at the beginning of every frame; behind the report id, if there is one.
    #[serde(default)]
    pub sync: Vec<u8>,
    /// The bytes at the end of every frame.
    #[serde(default)]
    pub trailer: Vec<u8>,
    /// A field with the frame's length.
    pub length: Option<RawLength>,
}

/// A field with the frame's length.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawLength {
    /// Offset of its first byte.
    pub offset: i64,
    /// Its length in bytes, 1 to 8.
    pub width: usize,
    /// Its byte order.
    #[serde(default)]
    pub endian: Endian,
    /// Bytes of the frame that the field does not count. The frame's length is the field's value plus this.
    #[serde(default)]
    pub adds: i64,
}

/// Byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Endian {
    /// Low byte first.
    #[default]
    Little,
    /// High byte first.
    Big,
}

/// The elements' values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawSamples {
    /// Offset of the first sample.
    pub offset: i64,
    /// Number of elements.
    pub elements: usize,
    /// Rows of the array.
    pub rows: Option<usize>,
    /// Columns of the array.
    pub cols: Option<usize>,
    /// Type of each sample.
    #[serde(rename = "type")]
    pub kind: SampleType,
    /// Byte order of each sample.
    #[serde(default)]
    pub endian: Endian,
    /// Order of the elements on the wire.
    #[serde(default)]
    pub order: RawOrder,
    /// Values that mark an element as bad.
    #[serde(default)]
    pub bad: Vec<f64>,
}

/// Type of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SampleType {
    /// One byte.
    U8,
    /// Twelve bits: two samples in three bytes; a last odd sample in two. With `little`, the first sample is the first byte
    /// and, above it, the low half of the second. With `big`, it is the first byte and, below it, the high half of the
    /// second.
    U12,
    /// Two bytes.
    U16,
    /// Two bytes, signed.
    I16,
    /// Four bytes; decoded with 24 significant bits.
    U32,
    /// Four bytes, floating-point. A value that is not finite marks a bad element.
    F32,
}

/// Order of the elements on the wire.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "order is \"row-major\", \"column-major\" or a list with an element for each sample"
)]
pub enum RawOrder {
    /// A named order.
    Named(OrderName),
    /// The element of each sample, in the order on the wire. Elements are counted from 0, row-major.
    Elements(Vec<usize>),
}

/// A named order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderName {
    /// Row by row.
    RowMajor,
    /// Column by column.
    ColumnMajor,
}

impl Default for RawOrder {
    fn default() -> Self {
        Self::Named(OrderName::RowMajor)
    }
}

/// The device's count of frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawSequence {
    /// Offset of its first byte.
    pub offset: i64,
    /// Its length in bytes, 1 to 8.
    pub width: usize,
    /// Its byte order.
    #[serde(default)]
    pub endian: Endian,
    /// Number of frames after which it starts again at 0; by default the range of its width.
    pub wrap: Option<u64>,
}

/// The device's clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawTimestamp {
    /// Offset of its first byte.
    pub offset: i64,
    /// Its length in bytes, 1 to 8.
    pub width: usize,
    /// Its byte order.
    #[serde(default)]
    pub endian: Endian,
    /// Length of a tick in ns; need not be whole.
    pub tick_ns: f64,
    /// Number of ticks after which it starts again at 0; by default the range of its width.
    pub wrap: Option<u64>,
    /// True if a frame with the timestamp of the previous one holds nothing new.
    #[serde(default)]
    pub unchanged_is_stale: bool,
}

/// The checksum of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawChecksum {
    /// Its algorithm.
    pub kind: ChecksumKind,
    /// Offset of the first byte that it covers; default 0.
    #[serde(default)]
    pub from: i64,
    /// Offset behind the last byte that it covers; default its own offset.
    pub to: Option<i64>,
    /// Its own offset; default at the end, in front of the trailer.
    pub offset: Option<i64>,
    /// Its byte order.
    #[serde(default)]
    pub endian: Endian,
    /// Polynomial of a CRC without its highest bit, not reflected; default 0x04C11DB7 for crc32, required for crc16.
    pub polynomial: Option<u32>,
    /// Initial value of a CRC, not reflected; default 0xFFFFFFFF for crc32, required for crc16.
    pub init: Option<u32>,
    /// Process input and output of a CRC with the lowest bit first; default true for crc32, required for crc16.
    pub reflect: Option<bool>,
    /// The result of a CRC is combined with this by exclusive or; default 0xFFFFFFFF for crc32, required for crc16.
    pub xorout: Option<u32>,
    /// The checksum of the nine characters `123456789`, as in catalogues: a guard against wrong parameters.
    pub check: Option<u32>,
}

/// Algorithm of a checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChecksumKind {
    /// Frames have no checksum.
    None,
    /// The low byte of the sum of all bytes.
    Sum8,
    /// All bytes combined by exclusive or.
    Xor8,
    /// A CRC of 16 bits, with the given parameters.
    Crc16,
    /// A CRC of 32 bits; that of Ethernet and zip unless parameters are given.
    Crc32,
}

/// For human interface devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawHid {
    /// First byte of each report, which is the frame's byte 0; 0 for a device whose reports have none.
    pub report_id: u8,
}

/// For devices on a USB endpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawUsb {
    /// Number of the USB interface.
    pub interface: u8,
    /// Address of the endpoint that sends frames; 0x80 or more.
    pub endpoint: u8,
}

#[cfg(test)]
#[path = "raw_tests.rs"]
mod tests;
