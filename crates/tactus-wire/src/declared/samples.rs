//! The elements' values within a frame.

use super::{Endian, SampleType};

/// Where and how a frame holds the elements' values.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    pub(super) offset: usize,
    pub(super) elements: usize,
    pub(super) kind: SampleType,
    pub(super) endian: Endian,
    /// Each element's position on the wire; `None` if they are in order.
    pub(super) places: Option<Vec<usize>>,
    pub(super) bad: Vec<f32>,
}

impl SampleType {
    /// Length of this many samples in bytes.
    pub(super) fn bytes(self, samples: usize) -> usize {
        match self {
            Self::U8 => samples,
            Self::U12 => samples / 2 * 3 + samples % 2 * 2,
            Self::U16 | Self::I16 => 2 * samples,
            Self::U32 | Self::F32 => 4 * samples,
        }
    }

    /// The least and greatest value of a sample; `None` for f32.
    pub fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::U8 => Some((0.0, 255.0)),
            Self::U12 => Some((0.0, 4095.0)),
            Self::U16 => Some((0.0, 65_535.0)),
            Self::I16 => Some((-32_768.0, 32_767.0)),
            Self::U32 => Some((0.0, 4_294_967_295.0)),
            Self::F32 => None,
        }
    }
}

impl Samples {
    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.elements
    }

    /// Type of each sample.
    pub fn kind(&self) -> SampleType {
        self.kind
    }

    pub(super) fn bytes(&self) -> usize {
        self.kind.bytes(self.elements)
    }

    /// Reads all elements of a frame into `counts`, row-major; `wire` is scratch memory.
    pub(super) fn decode(&self, frame: &[u8], wire: &mut Vec<f32>, counts: &mut Vec<f32>) {
        let bytes = frame.get(self.offset..self.offset + self.bytes()).unwrap_or_default();
        counts.clear();
        let Some(places) = &self.places else {
            return self.decode_wire(bytes, counts);
        };
        wire.clear();
        self.decode_wire(bytes, wire);
        counts.extend(places.iter().map(|place| wire.get(*place).copied().unwrap_or(f32::NAN)));
    }

    /// Lists the elements that their counts mark as bad.
    pub(super) fn find_bad(&self, counts: &[f32], bad: &mut Vec<usize>) {
        bad.clear();
        if self.bad.is_empty() && self.kind != SampleType::F32 {
            return;
        }
        let is_bad = |count: f32| !count.is_finite() || self.bad.contains(&count);
        bad.extend(
            counts.iter().enumerate().filter(|(_, count)| is_bad(**count)).map(|(element, _)| element),
        );
    }

    /// Writes all elements, row-major, into a frame; rounded, and limited to the range of a sample.
    pub(super) fn encode(&self, counts: &[f32], frame: &mut [u8]) {
        let Some(bytes) = frame.get_mut(self.offset..self.offset + self.bytes()) else { return };
        let mut wire = counts.to_vec();
        if let Some(places) = &self.places {
            for (place, count) in places.iter().zip(counts) {
                if let Some(sample) = wire.get_mut(*place) {
                    *sample = *count;
                }
            }
        }
        self.encode_wire(&wire, bytes);
    }

    #[expect(clippy::cast_precision_loss, reason = "counts have 24 significant bits")]
    fn decode_wire(&self, bytes: &[u8], to: &mut Vec<f32>) {
        let (twos, fours) = (bytes.as_chunks::<2>().0, bytes.as_chunks::<4>().0);
        match (self.kind, self.endian) {
            (SampleType::U8, _) => to.extend(bytes.iter().map(|byte| f32::from(*byte))),
            (SampleType::U12, _) => self.decode_packed(bytes, to),
            (SampleType::U16, Endian::Little) => extend(to, twos, |two| u16::from_le_bytes(two).into()),
            (SampleType::U16, Endian::Big) => extend(to, twos, |two| u16::from_be_bytes(two).into()),
            (SampleType::I16, Endian::Little) => extend(to, twos, |two| i16::from_le_bytes(two).into()),
            (SampleType::I16, Endian::Big) => extend(to, twos, |two| i16::from_be_bytes(two).into()),
            (SampleType::U32, Endian::Little) => extend(to, fours, |four| u32::from_le_bytes(four) as f32),
            (SampleType::U32, Endian::Big) => extend(to, fours, |four| u32::from_be_bytes(four) as f32),
            (SampleType::F32, Endian::Little) => extend(to, fours, f32::from_le_bytes),
            (SampleType::F32, Endian::Big) => extend(to, fours, f32::from_be_bytes),
        }
    }

    fn decode_packed(&self, bytes: &[u8], to: &mut Vec<f32>) {
        let (threes, rest) = bytes.as_chunks::<3>();
        let first = |low: u8, high: u8| match self.endian {
            Endian::Little => u16::from(low) | u16::from(high & 0x0F) << 8,
            Endian::Big => u16::from(low) << 4 | u16::from(high >> 4),
        };
        for &[a, b, c] in threes {
            let second = match self.endian {
                Endian::Little => u16::from(b >> 4) | u16::from(c) << 4,
                Endian::Big => u16::from(b & 0x0F) << 8 | u16::from(c),
            };
            to.extend([f32::from(first(a, b)), f32::from(second)]);
        }
        if let &[a, b] = rest {
            to.push(f32::from(first(a, b)));
        }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, as it should")]
    fn encode_wire(&self, wire: &[f32], bytes: &mut [u8]) {
        let put = |bytes: &mut [u8], size: usize, write: &dyn Fn(f32, &mut [u8])| {
            for (sample, bytes) in wire.iter().zip(bytes.chunks_exact_mut(size)) {
                write(*sample, bytes);
            }
        };
        let ordered = |bytes: &mut [u8], mut low_first: [u8; 4], size: usize| {
            let used = low_first.get_mut(..size).unwrap_or_default();
            if self.endian == Endian::Big {
                used.reverse();
            }
            bytes.copy_from_slice(used);
        };
        match self.kind {
            SampleType::U8 => put(bytes, 1, &|sample, bytes| bytes.fill(sample.round() as u8)),
            SampleType::U12 => self.encode_packed(wire, bytes),
            SampleType::U16 => put(bytes, 2, &|sample, bytes| {
                ordered(bytes, u32::from(sample.round() as u16).to_le_bytes(), 2);
            }),
            SampleType::I16 => put(bytes, 2, &|sample, bytes| {
                let [low, high] = (sample.round() as i16).to_le_bytes();
                ordered(bytes, [low, high, 0, 0], 2);
            }),
            SampleType::U32 => put(bytes, 4, &|sample, bytes| {
                ordered(bytes, (sample.round() as u32).to_le_bytes(), 4);
            }),
            SampleType::F32 => put(bytes, 4, &|sample, bytes| ordered(bytes, sample.to_le_bytes(), 4)),
        }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held to twelve bits")]
    fn encode_packed(&self, wire: &[f32], bytes: &mut [u8]) {
        for (pair, bytes) in wire.chunks(2).zip(bytes.chunks_mut(3)) {
            let mut samples = pair.iter().map(|sample| sample.round().clamp(0.0, 4095.0) as u16);
            let (first, second) = (samples.next().unwrap_or(0), samples.next().unwrap_or(0));
            let three = match self.endian {
                Endian::Little => [first as u8, (first >> 8 | second << 4) as u8, (second >> 4) as u8],
                Endian::Big => [(first >> 4) as u8, (first << 4 | second >> 8) as u8, second as u8],
            };
            for (to, from) in bytes.iter_mut().zip(three) {
                *to = from;
            }
        }
    }
}

fn extend<const BYTES: usize>(to: &mut Vec<f32>, samples: &[[u8; BYTES]], read: impl Fn([u8; BYTES]) -> f32) {
    to.extend(samples.iter().map(|sample| read(*sample)));
}

#[cfg(test)]
#[path = "samples_tests.rs"]
mod tests;
