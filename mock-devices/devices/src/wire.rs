//! One way of a device's link: bytes, and what happens to them.

use std::time::Duration;

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use tokio::time::Instant;

use crate::faults::WireFault;
use crate::outbox::Outbox;

/// Bytes under way in one direction. Each fault hits the next bytes, or those of a time, and is then over.
#[derive(Debug)]
pub(crate) struct Wire {
    rng: ChaCha8Rng,
    outbox: Outbox,
    armed: Armed,
}

#[derive(Debug, Default)]
struct Armed {
    lost_until: Option<Instant>,
    held_until: Option<Instant>,
    dripping_until: Option<Instant>,
    drop_bytes: usize,
    flip_bits: usize,
    double_bytes: usize,
    garbage_bytes: usize,
    repeat_chunks: usize,
    truncate_chunks: usize,
    reorder_chunks: usize,
    /// A chunk that waits for the one after it.
    overtaken: Vec<u8>,
}

/// Time between two bytes of a slow link.
const DRIP: Duration = Duration::from_millis(1);

impl Wire {
    pub(crate) fn new(rng: ChaCha8Rng) -> Self {
        Self { rng, outbox: Outbox::default(), armed: Armed::default() }
    }

    /// Arms a fault from now on.
    pub(crate) fn arm(&mut self, fault: WireFault, now: Instant) {
        let armed = &mut self.armed;
        match fault {
            WireFault::Lose(duration) => armed.lost_until = Some(now + duration),
            WireFault::Hold(duration) => armed.held_until = Some(now + duration),
            WireFault::Drip(duration) => armed.dripping_until = Some(now + duration),
            WireFault::Drop(bytes) => armed.drop_bytes += bytes,
            WireFault::FlipBits(bits) => armed.flip_bits += bits,
            WireFault::Double(bytes) => armed.double_bytes += bytes,
            WireFault::Garbage(bytes) => armed.garbage_bytes += bytes,
            WireFault::Repeat => armed.repeat_chunks += 1,
            WireFault::Truncate => armed.truncate_chunks += 1,
            WireFault::Reorder => armed.reorder_chunks += 1,
        }
    }

    /// Disarms everything.
    pub(crate) fn clear(&mut self) {
        let overtaken = std::mem::take(&mut self.armed.overtaken);
        self.armed = Armed { overtaken, ..Armed::default() };
    }

    /// Takes bytes that enter.
    pub(crate) fn push(&mut self, bytes: &[u8], now: Instant) {
        if bytes.is_empty() {
            return;
        }
        let bytes = self.damage(bytes.to_vec());
        let is_during = |until: Option<Instant>| until.filter(|until| now < *until);
        if is_during(self.armed.lost_until).is_some() {
            return;
        }
        let due = is_during(self.armed.held_until).unwrap_or(now);
        if is_during(self.armed.dripping_until).is_some() {
            let duration = DRIP * u32::try_from(bytes.len()).unwrap_or(u32::MAX);
            self.outbox.drip(due, duration, &bytes);
        } else {
            self.outbox.push(due, bytes);
        }
    }

    /// When the next bytes arrive.
    pub(crate) fn next_due(&self) -> Option<Instant> {
        self.outbox.next_due()
    }

    /// Takes the bytes that have arrived by `now`.
    pub(crate) fn take_due(&mut self, now: Instant) -> Vec<u8> {
        self.outbox.take_due(now)
    }

    fn damage(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        let Self { rng, armed, .. } = self;
        let dropped = std::mem::take(&mut armed.drop_bytes);
        armed.drop_bytes = dropped.saturating_sub(bytes.len());
        bytes.drain(..dropped.min(bytes.len()));
        if !bytes.is_empty() {
            for _ in 0..std::mem::take(&mut armed.flip_bits) {
                let bit = rng.random_range(0..8 * bytes.len());
                if let Some(byte) = bytes.get_mut(bit / 8) {
                    *byte ^= 1 << (bit % 8);
                }
            }
            for _ in 0..std::mem::take(&mut armed.double_bytes) {
                let at = rng.random_range(0..bytes.len());
                bytes.insert(at, bytes[at]);
            }
        }
        if hits(&mut armed.truncate_chunks) {
            bytes.truncate(bytes.len() / 2);
        }
        if hits(&mut armed.repeat_chunks) {
            bytes.extend_from_within(..);
        }
        if armed.garbage_bytes > 0 {
            let mut garbage = vec![0; std::mem::take(&mut armed.garbage_bytes)];
            rng.fill_bytes(&mut garbage);
            bytes.splice(..0, garbage);
        }
        if hits(&mut armed.reorder_chunks) {
            armed.overtaken.extend(bytes);
            return Vec::new();
        }
        bytes.append(&mut armed.overtaken);
        bytes
    }
}

/// True if the fault hits this chunk; counts it.
fn hits(chunks: &mut usize) -> bool {
    let is_armed = *chunks > 0;
    *chunks = chunks.saturating_sub(1);
    is_armed
}

#[cfg(test)]
#[path = "wire_tests.rs"]
mod tests;
