//! The description as it is written.

use serde::{Deserialize, Serialize};

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.link/1";

/// A description as it is written; [`check`](RawFormat::check) makes a [`Format`](super::Format) of it.
///
/// Offsets are in bytes from the beginning of the frame, that is from the first sync byte; negative ones are
/// from its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFormat {
    /// [`SCHEMA`].
    pub schema: String,
    /// What is described.
    pub name: String,
    /// How the bytes arrive.
    #[serde(default)]
    pub framing: Framing,
    /// How a frame is told from what is around it.
    pub frame: RawFrame,
    /// The elements' values.
    pub samples: RawSamples,
    /// A count of frames.
    pub sequence: Option<RawSequence>,
    /// The device's clock.
    pub timestamp: Option<RawTimestamp>,
    /// What closes a frame; nothing if absent.
    pub checksum: Option<RawChecksum>,
    /// For devices that are a HID.
    pub hid: Option<RawHid>,
    /// For devices that are read from a USB endpoint.
    pub usb: Option<RawUsb>,
}

/// How the bytes arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Framing {
    /// In pieces of any length, as from a serial port; sync bytes tell where a frame begins.
    #[default]
    Stream,
    /// Each piece is one frame: a HID report, a transfer, a datagram.
    Packet,
}

/// How a frame is told from what is around it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFrame {
    /// Length of the whole frame, from the first sync byte to the last byte of checksum and trailer.
    pub bytes: usize,
    /// What every frame begins with; behind the report id, if there is one.
    #[serde(default)]
    pub sync: Vec<u8>,
    /// What every frame ends with.
    #[serde(default)]
    pub trailer: Vec<u8>,
    /// A field that tells the length.
    pub length: Option<RawLength>,
}

/// A field that tells the length.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawLength {
    /// Where.
    pub offset: i64,
    /// Bytes of it, 1 to 8.
    pub width: usize,
    /// Which byte is first.
    #[serde(default)]
    pub endian: Endian,
    /// Bytes of the frame that the field does not count: the frame has its value and these.
    #[serde(default)]
    pub adds: i64,
}

/// Which byte is first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Endian {
    /// The lowest.
    #[default]
    Little,
    /// The highest.
    Big,
}

/// The elements' values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawSamples {
    /// Where the first begins.
    pub offset: i64,
    /// How many.
    pub elements: usize,
    /// Rows of the array.
    pub rows: Option<usize>,
    /// Columns of the array.
    pub cols: Option<usize>,
    /// What each is.
    #[serde(rename = "type")]
    pub kind: SampleType,
    /// Which byte of each is first.
    #[serde(default)]
    pub endian: Endian,
    /// In which order they come.
    #[serde(default)]
    pub order: RawOrder,
    /// Values that mark an element as bad.
    #[serde(default)]
    pub bad: Vec<f64>,
}

/// What one sample is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SampleType {
    /// One byte.
    U8,
    /// Twelve bits; two samples in three bytes, a last odd one in two. `little`: the first sample is the
    /// first byte and the low half of the second. `big`: it is the first byte and the high half of the
    /// second, the byte above the half.
    U12,
    /// Two bytes.
    U16,
    /// Two bytes, signed.
    I16,
    /// Four bytes; kept to 24 significant bits.
    U32,
    /// Four bytes, floating-point; a number that is not finite marks a bad element.
    F32,
}

/// In which order samples come.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "order is \"row-major\", \"column-major\" or a list with an element for each sample"
)]
pub enum RawOrder {
    /// One of the usual ones.
    Named(OrderName),
    /// The element that each sample belongs to, in the order of the wire; elements are counted from 0,
    /// row-major.
    Elements(Vec<usize>),
}

/// The usual orders.
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

/// A count of frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawSequence {
    /// Where.
    pub offset: i64,
    /// Bytes of it, 1 to 8.
    pub width: usize,
    /// Which byte is first.
    #[serde(default)]
    pub endian: Endian,
    /// After how many frames it is 0 again; as its width has it, if absent.
    pub wrap: Option<u64>,
}

/// The device's clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawTimestamp {
    /// Where.
    pub offset: i64,
    /// Bytes of it, 1 to 8.
    pub width: usize,
    /// Which byte is first.
    #[serde(default)]
    pub endian: Endian,
    /// Length of a tick.
    pub tick_ns: f64,
    /// After how many ticks it is 0 again; as its width has it, if absent.
    pub wrap: Option<u64>,
    /// A frame with the timestamp of the one before holds nothing new.
    #[serde(default)]
    pub unchanged_is_stale: bool,
}

/// What closes a frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawChecksum {
    /// Which.
    pub kind: ChecksumKind,
    /// The first byte that it covers; 0 if absent.
    #[serde(default)]
    pub from: i64,
    /// The first byte behind those that it covers; where it stands itself, if absent.
    pub to: Option<i64>,
    /// Where it stands; at the end, in front of the trailer, if absent.
    pub offset: Option<i64>,
    /// Which byte of it is first.
    #[serde(default)]
    pub endian: Endian,
    /// Of a CRC, without its highest bit, not reflected; for crc32 0x04C11DB7 if absent.
    pub polynomial: Option<u32>,
    /// What a CRC begins with, not reflected; for crc32 0xFFFFFFFF if absent.
    pub init: Option<u32>,
    /// A CRC takes and gives the lowest bit first; for crc32 true if absent.
    pub reflect: Option<bool>,
    /// What the result of a CRC is combined with; for crc32 0xFFFFFFFF if absent.
    pub xorout: Option<u32>,
    /// Of the nine characters `123456789`, as catalogues of checksums list it: a guard against a wrong
    /// parameter.
    pub check: Option<u32>,
}

/// Which checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChecksumKind {
    /// None.
    None,
    /// The low byte of the sum.
    Sum8,
    /// All bytes combined by exclusive or.
    Xor8,
    /// A CRC of 16 bits, by its parameters.
    Crc16,
    /// A CRC of 32 bits, the usual one unless parameters are given.
    Crc32,
}

/// For devices that are a HID.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawHid {
    /// First byte of each report, which counts as the frame's byte 0; 0 for a device whose reports have none.
    pub report_id: u8,
}

/// For devices that are read from a USB endpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawUsb {
    /// Number of the interface.
    pub interface: u8,
    /// Address of the endpoint that frames come from; 0x80 or more.
    pub endpoint: u8,
}

#[cfg(test)]
#[path = "raw_tests.rs"]
mod tests;
