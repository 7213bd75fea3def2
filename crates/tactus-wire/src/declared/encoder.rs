//! Encodes frames, for virtual devices.

use std::sync::Arc;

use super::Format;

/// Encodes frames of a format, with a count from 0. Bytes that are not described are zero.
#[derive(Debug, Clone)]
pub struct Encoder {
    format: Arc<Format>,
    frame: Vec<u8>,
    sequence: u64,
}

/// A reading has another number of elements than the description.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the reading has {found} elements, the description says {expected} (samples.elements)")]
pub struct ElementsError {
    /// Number in the description.
    pub expected: usize,
    /// Number in the reading.
    pub found: usize,
}

impl Encoder {
    /// An encoder whose first frame has count 0.
    pub fn new(format: Arc<Format>) -> Self {
        let mut frame = vec![0; format.bytes];
        for (to, from) in frame.iter_mut().zip(&format.head) {
            *to = *from;
        }
        for (to, from) in frame.iter_mut().rev().zip(format.trailer.iter().rev()) {
            *to = *from;
        }
        if let Some(length) = format.length {
            length.field.write(&mut frame, length.value);
        }
        Self { format, frame, sequence: 0 }
    }

    /// Encodes the next frame, from the device's clock in ticks and the counts of all elements, row-major. Counts are
    /// rounded and limited to the range of a sample.
    ///
    /// # Errors
    /// If the number of elements differs from the description.
    pub fn encode(&mut self, tick: u64, counts: &[f32]) -> Result<&[u8], ElementsError> {
        let format = &*self.format;
        if counts.len() != format.samples.elements {
            return Err(ElementsError { expected: format.samples.elements, found: counts.len() });
        }
        if let Some(sequence) = format.sequence {
            sequence.field.write(&mut self.frame, remainder(self.sequence, sequence.wrap));
        }
        if let Some(timestamp) = format.timestamp {
            timestamp.field.write(&mut self.frame, remainder(tick, timestamp.wrap));
        }
        format.samples.encode(counts, &mut self.frame);
        if let Some(checksum) = &format.checksum {
            let covered = self.frame.get(checksum.from..checksum.to).unwrap_or_default();
            let value = checksum.algorithm.of(covered);
            checksum.field.write(&mut self.frame, value.into());
        }
        self.sequence = self.sequence.wrapping_add(1);
        Ok(&self.frame)
    }

    /// Starts again at count 0, like a device that is switched on.
    pub fn restart(&mut self) {
        self.sequence = 0;
    }

    /// Skips a count, as if its frame had been lost.
    pub fn lose_frame(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
    }
}

fn remainder(number: u64, wrap: u128) -> u64 {
    u64::try_from(u128::from(number) % wrap).unwrap_or(u64::MAX)
}
