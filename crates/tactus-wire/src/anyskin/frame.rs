//! The frame: one reading of all magnetometers.

/// Magnetometers of a board.
pub const MAGNETOMETERS: usize = 5;

/// Bytes of a frame.
pub const FRAME_BYTES: usize = MAGNETOMETERS * MAGNETOMETER_BYTES + END.len();

const MAGNETOMETER_BYTES: usize = 16;

/// What every frame ends with.
const END: [u8; 2] = *b"\r\n";

/// Numbers between these magnitudes, and zero, are what a magnetometer may say in whatever unit. Bytes read
/// at a wrong place mostly give others.
const PLAUSIBLE: core::ops::Range<f32> = 1e-9..1e9;

/// One reading of all magnetometers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DecodedFrame {
    /// In the order of the wire.
    pub magnetometers: [Magnetometer; MAGNETOMETERS],
}

/// One reading of one magnetometer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Magnetometer {
    /// In degrees Celsius, as the firmware converts it.
    pub temperature_c: f32,
    /// The field along the chip's x, y and z, in microtesla as the firmware converts it. May be any number,
    /// NaN too.
    pub field_ut: [f32; 3],
}

impl DecodedFrame {
    /// Reads a frame, if that is its end.
    pub fn parse(bytes: &[u8; FRAME_BYTES]) -> Option<Self> {
        let (magnetometers, end) = bytes.as_chunks::<MAGNETOMETER_BYTES>();
        if end != END {
            return None;
        }
        let mut frame = Self::default();
        for (magnetometer, bytes) in frame.magnetometers.iter_mut().zip(magnetometers) {
            *magnetometer = Magnetometer::parse(bytes);
        }
        Some(frame)
    }

    /// The frame as bytes.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(FRAME_BYTES);
        for number in self.magnetometers.iter().flat_map(Magnetometer::numbers) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(END);
        bytes
    }

    /// True if no number is of a magnitude that no magnetometer would say.
    pub(super) fn is_plausible(&self) -> bool {
        let mut numbers = self.magnetometers.iter().flat_map(Magnetometer::numbers);
        numbers.all(|number| number == 0.0 || number.is_nan() || PLAUSIBLE.contains(&number.abs()))
    }
}

impl Magnetometer {
    fn parse(bytes: &[u8; MAGNETOMETER_BYTES]) -> Self {
        let (numbers, _) = bytes.as_chunks::<4>();
        let mut numbers = numbers.iter().map(|number| f32::from_le_bytes(*number));
        let mut next = || numbers.next().unwrap_or_default();
        Self { temperature_c: next(), field_ut: [next(), next(), next()] }
    }

    fn numbers(&self) -> [f32; 4] {
        let [x, y, z] = self.field_ut;
        [self.temperature_c, x, y, z]
    }
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
