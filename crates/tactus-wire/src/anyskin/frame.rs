//! A frame: one reading of all magnetometers.

/// Number of magnetometers on a board.
pub const MAGNETOMETERS: usize = 5;

/// Length of a frame.
pub const FRAME_BYTES: usize = MAGNETOMETERS * MAGNETOMETER_BYTES + END.len();

const MAGNETOMETER_BYTES: usize = 16;

/// Ends every frame.
const END: [u8; 2] = *b"\r\n";

/// Plausible magnitudes of a nonzero number, in any unit. Bytes read at a wrong offset usually give others.
const PLAUSIBLE: core::ops::Range<f32> = 1e-9..1e9;

/// One reading of all magnetometers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DecodedFrame {
    /// In the order on the wire.
    pub magnetometers: [Magnetometer; MAGNETOMETERS],
}

/// One reading of one magnetometer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Magnetometer {
    /// In degrees Celsius, as converted by the firmware.
    pub temperature_c: f32,
    /// Field along the chip's x, y and z in microtesla, as converted by the firmware. May be NaN or infinite.
    pub field_ut: [f32; 3],
}

impl DecodedFrame {
    /// Decodes a frame; `None` if its end is wrong.
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

    /// Mean of the temperatures that are numbers.
    pub fn temperature_c(&self) -> Option<f32> {
        let (mut sum_c, mut told) = (0.0, 0.0);
        for temperature_c in
            self.magnetometers.iter().map(|one| one.temperature_c).filter(|one| one.is_finite())
        {
            sum_c += temperature_c;
            told += 1.0;
        }
        (told > 0.0).then(|| sum_c / told)
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

    /// True if every number is zero, NaN or of a plausible magnitude.
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
