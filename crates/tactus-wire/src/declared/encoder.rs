//! Frames as a virtual device sends them.

use std::sync::Arc;

use super::Format;

/// Writes frames of a format, counted from 0.
///
/// Bytes that the description says nothing of are zero.
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
    /// As the description says.
    pub expected: usize,
    /// As given.
    pub found: usize,
}

impl Encoder {
    /// An encoder whose first frame has the number 0.
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

    /// The next frame: the device's clock in its ticks, and the counts of all elements, row-major. Counts are
    /// rounded and held to what a sample can be.
    ///
    /// # Errors
    /// Another number of elements than the description says.
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

    /// Begins at the number 0 again, as a device that is switched on.
    pub fn restart(&mut self) {
        self.sequence = 0;
    }

    /// Passes over a number, as if its frame had been lost.
    pub fn lose_frame(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
    }
}

fn remainder(number: u64, wrap: u128) -> u64 {
    u64::try_from(u128::from(number) % wrap).unwrap_or(u64::MAX)
}
