//! The device side of the sensor protocols: frames, answers and clock as bytes.

use std::time::Duration;

use tactus_device::SensorCodec;
use tactus_wire::anyskin::{self, Magnetometer};
use tactus_wire::declared::Encoder;
use tactus_wire::singletact::{
    self, DEFAULT_ADDRESS, ElementReading, Operation, READING_BYTES, READING_LOCATION, Reply, Request, Via,
};
use tactus_wire::weiss::{
    self, Checksum, CommandError, ControllerInfo, ErrorCode, HostCommand, MatrixInfo, SensorInfo,
    acknowledge, encode_frame, id,
};

use crate::truth::Truth;

const SERIAL_NUMBER: u32 = u32::from_le_bytes(*b"SIM\0");

const MATRIX_UID: [u8; 6] = *b"SIMULA";

/// Content of a `SingleTact` element's register outside the reading.
const REGISTER: &[u8] = b"SIMULATED ";

/// Readings that a `SingleTact` element takes per frame of the array.
const READINGS_PER_FRAME: f64 = 4.0;

/// Temperature that the magnetometers of a board report, degrees Celsius.
const TEMPERATURE_C: f32 = 25.0;

/// The device side of a protocol.
#[derive(Debug)]
pub(super) enum DeviceCodec {
    Weiss { checksum: Checksum, decoder: weiss::Decoder },
    SingleTact { addresses: Vec<u8>, decoder: singletact::Decoder },
    AnySkin,
    Declared { encoder: Encoder, clock: Option<DeviceClock> },
}

/// A request of the host.
#[derive(Debug, Clone, Copy)]
pub(super) enum HostRequest {
    Weiss(Result<HostCommand, CommandError>),
    SingleTact { address: u8, id: u8, asked: Register },
}

/// What a request to a `SingleTact` element accesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Register {
    Reading,
    Other { location: u8, bytes: u8 },
    Written,
}

/// A device's clock, which wraps.
#[derive(Debug, Clone, Copy)]
pub(super) struct DeviceClock {
    tick_ns: f64,
    wrap: u128,
}

impl DeviceClock {
    /// Its reading; `offset_ticks` is by how much it was set.
    pub(super) fn shows(self, running: Duration, offset_ticks: i128) -> u64 {
        let ticks = self.ticks(running).saturating_add(offset_ticks);
        let wrap = i128::try_from(self.wrap).unwrap_or(i128::MAX);
        u64::try_from(ticks.rem_euclid(wrap)).unwrap_or(0)
    }

    #[expect(clippy::cast_possible_truncation, reason = "saturates, as it should")]
    pub(super) fn ticks(self, running: Duration) -> i128 {
        (running.as_nanos() as f64 / self.tick_ns).floor() as i128
    }

    /// By how many ticks it must be set so that it wraps after `to_go`.
    pub(super) fn until_wrap(self, shown: u64, to_go: Duration) -> i128 {
        let last = i128::try_from(self.wrap).unwrap_or(i128::MAX) - 1;
        last - i128::from(shown) - self.ticks(to_go)
    }
}

impl DeviceCodec {
    pub(super) fn of(codec: &SensorCodec) -> Self {
        match codec {
            SensorCodec::WeissDsa { checksum } => {
                Self::Weiss { checksum: *checksum, decoder: weiss::Decoder::new().with_checksum(*checksum) }
            }
            SensorCodec::SingleTact { addresses } => {
                Self::SingleTact { addresses: addresses.clone(), decoder: singletact::Decoder::new() }
            }
            SensorCodec::AnySkin => Self::AnySkin,
            SensorCodec::Declared { format } => Self::Declared {
                clock: format.clock().map(|(tick_ns, wrap)| DeviceClock { tick_ns, wrap }),
                encoder: Encoder::new(format.clone()),
            },
        }
    }

    /// Forgets received bytes, and restarts the frame counter.
    pub(super) fn power_up(&mut self) {
        match self {
            Self::Weiss { checksum, decoder } => *decoder = weiss::Decoder::new().with_checksum(*checksum),
            Self::SingleTact { decoder, .. } => *decoder = singletact::Decoder::new(),
            Self::AnySkin => {}
            Self::Declared { encoder, .. } => encoder.restart(),
        }
    }

    /// True if the device sends boot messages before it listens.
    pub(super) fn boots(&self) -> bool {
        matches!(self, Self::Weiss { .. })
    }

    /// True if the device sends frames without a request.
    pub(super) fn streams(&self) -> bool {
        matches!(self, Self::AnySkin | Self::Declared { .. })
    }

    /// The device's clock, if it has one.
    pub(super) fn clock(&self) -> Option<DeviceClock> {
        let wide = |tick: Duration| DeviceClock { tick_ns: tick.as_nanos() as f64, wrap: 1 << 32 };
        match self {
            Self::Weiss { .. } => Some(wide(Duration::from_millis(1))),
            Self::SingleTact { .. } => Some(wide(singletact::TICK)),
            Self::AnySkin => None,
            Self::Declared { clock, .. } => *clock,
        }
    }

    /// Decodes bytes from the host. Like real firmware, it ignores what it cannot read.
    pub(super) fn decode(&mut self, bytes: &[u8]) -> Vec<HostRequest> {
        let mut asked = Vec::new();
        match self {
            Self::Weiss { decoder, .. } => {
                decoder.push(bytes);
                while let Some(packet) = decoder.next_packet() {
                    asked.extend(packet.ok().map(|packet| HostRequest::Weiss(HostCommand::parse(&packet))));
                }
            }
            Self::SingleTact { decoder, .. } => {
                decoder.push(bytes);
                while let Some(Request { address, id, operation }) = decoder.next_request() {
                    let register = match operation {
                        Operation::Read { location: READING_LOCATION, bytes: READING_BYTES } => {
                            Register::Reading
                        }
                        Operation::Read { location, bytes } => Register::Other { location, bytes },
                        Operation::Write { .. } | Operation::Calibrate { .. } => Register::Written,
                    };
                    asked.push(HostRequest::SingleTact { address, id, asked: register });
                }
            }
            Self::AnySkin | Self::Declared { .. } => {}
        }
        asked
    }

    /// Skips a frame. A device that counts its frames counts it.
    pub(super) fn skip_frame(&mut self) {
        match self {
            Self::Declared { encoder, .. } => encoder.lose_frame(),
            Self::Weiss { .. } | Self::SingleTact { .. } | Self::AnySkin => {}
        }
    }

    /// Encodes a frame; `elements` is a wrong number of elements, for the fault `wrong-count`.
    pub(super) fn frame(
        &mut self,
        tick: u64,
        counts: &[u16],
        run_length: bool,
        elements: Option<usize>,
    ) -> Vec<u8> {
        match self {
            Self::Weiss { checksum, .. } => {
                #[expect(clippy::cast_possible_truncation, reason = "its clock wraps at 32 bits")]
                let timestamp_ms = tick as u32;
                let packet = match elements {
                    Some(elements) => encode_frame(timestamp_ms, &with_length(counts, elements), run_length),
                    None => encode_frame(timestamp_ms, counts, run_length),
                };
                checksum.close(packet)
            }
            Self::SingleTact { .. } => Vec::new(),
            Self::AnySkin => resized(&board(counts).encode(), counts.len(), elements),
            Self::Declared { encoder, .. } => {
                let counts: Vec<f32> = counts.iter().map(|count| f32::from(*count)).collect();
                // The rig was checked against the description when both were read.
                encoder.encode(tick, &counts).map_or_else(
                    |error| {
                        tracing::error!(%error, "the virtual sensor is silent");
                        Vec::new()
                    },
                    |bytes| resized(bytes, counts.len(), elements),
                )
            }
        }
    }

    /// Appends the device's checksum to an answer.
    pub(super) fn close(&self, packet: Vec<u8>) -> Vec<u8> {
        match self {
            Self::Weiss { checksum, .. } => checksum.close(packet),
            Self::SingleTact { .. } | Self::AnySkin | Self::Declared { .. } => packet,
        }
    }

    /// The element at an address. A single element answers at the default address too.
    pub(super) fn element_at(&self, address: u8) -> Option<usize> {
        let Self::SingleTact { addresses, .. } = self else { return None };
        let is_alone = addresses.len() == 1 && address == DEFAULT_ADDRESS;
        addresses.iter().position(|own| *own == address).or(is_alone.then_some(0))
    }
}

/// A `weiss-dsa` controller's answer about itself.
pub(super) fn controller() -> Vec<u8> {
    ControllerInfo { serial_number: SERIAL_NUMBER, ..ControllerInfo::default() }.encode()
}

/// Its answer about its sensor.
pub(super) fn sensor() -> Vec<u8> {
    SensorInfo { matrices: 1, serial_number: SERIAL_NUMBER, ..SensorInfo::default() }.encode()
}

/// Its answer about one of the sensor's matrices.
#[expect(clippy::cast_possible_truncation, reason = "the protocol has single precision and 16 bits")]
pub(super) fn matrix(matrix: u8, truth: &Truth) -> Vec<u8> {
    if matrix > 0 {
        return acknowledge(id::MATRIX, ErrorCode::INDEX_OUT_OF_BOUNDS);
    }
    let array = truth.model.array();
    MatrixInfo {
        element_mm: array.element_mm().map(|side| side as f32),
        cells_x: array.cols() as u16,
        cells_y: array.rows() as u16,
        uid: MATRIX_UID,
        full_scale: array.full_scale_counts() as f32,
        ..MatrixInfo::default()
    }
    .encode()
}

/// The answer of a `SingleTact` board for an element with this reading, or for an absent element (`None`).
pub(super) fn reply(
    (address, id, asked): (u8, u8, Register),
    tick: u64,
    running: Duration,
    rate_hz: f64,
    counts: Option<u16>,
) -> Vec<u8> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "counters and clocks of the protocol wrap"
    )]
    let (timestamp_ticks, counter) =
        (tick as u32, (running.as_secs_f64() * rate_hz * READINGS_PER_FRAME) as u64 as u16);
    let data = match (asked, counts) {
        (Register::Written, _) => Vec::new(),
        (Register::Reading, Some(counts)) => ElementReading { counter, counts }.encode().to_vec(),
        (Register::Reading, None) => vec![0; READING_BYTES.into()],
        (Register::Other { location, bytes }, _) => {
            // No read can ask for more than this.
            let bytes = usize::from(bytes).min(32);
            REGISTER.iter().cycle().skip(location.into()).take(bytes).copied().collect()
        }
    };
    let via = Via::Usb;
    Reply { via, address, timed_out: counts.is_none(), id, timestamp_ticks, data: &data }.encode()
}

/// Counts as the fields of a board's magnetometers.
fn board(counts: &[u16]) -> anyskin::DecodedFrame {
    let mut frame = anyskin::DecodedFrame::default();
    let (axes, _) = counts.as_chunks::<3>();
    for (magnetometer, axes) in frame.magnetometers.iter_mut().zip(axes) {
        *magnetometer = Magnetometer { temperature_c: TEMPERATURE_C, field_ut: axes.map(f32::from) };
    }
    frame
}

/// The counts at another length: cut off, or with the last one repeated.
fn with_length(counts: &[u16], elements: usize) -> Vec<u16> {
    let last = counts.last().copied().unwrap_or(0);
    counts.iter().copied().chain(std::iter::repeat(last)).take(elements).collect()
}

/// A frame of another length, as if it had other elements.
fn resized(bytes: &[u8], own: usize, elements: Option<usize>) -> Vec<u8> {
    let Some(elements) = elements else { return bytes.to_vec() };
    let length = bytes.len() * elements / own.max(1);
    bytes.iter().copied().chain(std::iter::repeat(0)).take(length).collect()
}
