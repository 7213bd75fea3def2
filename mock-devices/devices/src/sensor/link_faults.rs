//! Faults of the sensor's link: what happens to frames between the controller and the host.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use tokio::time::Instant;

use crate::faults::LinkFault;
use crate::truth::RandomStream;

/// Armed faults. Each hits the next frame or frames and is then over.
#[derive(Debug)]
pub(super) struct LinkFaults {
    rng: ChaCha8Rng,
    armed: Armed,
}

#[derive(Debug, Default)]
struct Armed {
    stalled_until: Option<Instant>,
    dripping_until: Option<Instant>,
    drop_bytes: usize,
    garbage_bytes: usize,
    flip_bits: usize,
    wrong_count: Option<usize>,
    // How many frames each fault will still hit.
    drop_frames: usize,
    duplicate_frames: usize,
    reorder_frames: usize,
    wrong_checksum_frames: usize,
    truncate_frames: usize,
    burst_frames: usize,
    /// A frame that waits for the one after it.
    overtaken: Vec<u8>,
    /// Frames that wait for the last of a burst.
    burst: Vec<u8>,
}

impl LinkFaults {
    pub(super) fn new(seed: u64) -> Self {
        Self { rng: RandomStream::SensorLink.rng(seed), armed: Armed::default() }
    }

    /// Arms a fault from now on.
    pub(super) fn arm(&mut self, fault: LinkFault, now: Instant) {
        let armed = &mut self.armed;
        match fault {
            LinkFault::Stall(duration) => armed.stalled_until = Some(now + duration),
            LinkFault::Drip(duration) => armed.dripping_until = Some(now + duration),
            LinkFault::Drop(bytes) => armed.drop_bytes += bytes,
            LinkFault::DropFrames(frames) => armed.drop_frames += frames,
            LinkFault::FlipBits(bits) => armed.flip_bits += bits,
            LinkFault::Garbage(bytes) => armed.garbage_bytes += bytes,
            LinkFault::Duplicate => armed.duplicate_frames += 1,
            LinkFault::Reorder => armed.reorder_frames += 1,
            LinkFault::WrongChecksum => armed.wrong_checksum_frames += 1,
            LinkFault::Truncate => armed.truncate_frames += 1,
            LinkFault::Burst(frames) => armed.burst_frames += frames,
            LinkFault::WrongCount(elements) => armed.wrong_count = Some(elements),
        }
    }

    /// Disarms everything.
    pub(super) fn clear(&mut self) {
        self.armed = Armed::default();
    }

    /// True while nothing leaves the controller.
    pub(super) fn is_stalled(&self, at: Instant) -> bool {
        self.armed.stalled_until.is_some_and(|until| at < until)
    }

    /// True while bytes come one at a time.
    pub(super) fn is_dripping(&self, at: Instant) -> bool {
        self.armed.dripping_until.is_some_and(|until| at < until)
    }

    /// The bytes that leave the device for a frame sampled at `at`: none, one packet, or several.
    ///
    /// Every frame is encoded, because the device counts lost ones too. `encode` gets the wrong number of elements, if any.
    pub(super) fn frame(&mut self, at: Instant, encode: impl FnOnce(Option<usize>) -> Vec<u8>) -> Vec<u8> {
        let is_stalled = self.is_stalled(at);
        let Self { rng, armed } = self;
        let is_lost = is_stalled || hits(&mut armed.drop_frames);
        let mut bytes = encode(if is_lost { None } else { armed.wrong_count.take() });
        if is_lost || bytes.is_empty() {
            return Vec::new();
        }
        if hits(&mut armed.wrong_checksum_frames)
            && let Some(last) = bytes.last_mut()
        {
            *last ^= 0xFF;
        }
        for _ in 0..std::mem::take(&mut armed.flip_bits) {
            let bit = rng.random_range(0..8 * bytes.len());
            if let Some(byte) = bytes.get_mut(bit / 8) {
                *byte ^= 1 << (bit % 8);
            }
        }
        if hits(&mut armed.truncate_frames) {
            bytes.truncate(bytes.len() / 2);
        }
        if hits(&mut armed.duplicate_frames) {
            bytes.extend_from_within(..);
        }
        if armed.garbage_bytes > 0 {
            let mut garbage = vec![0; std::mem::take(&mut armed.garbage_bytes)];
            rng.fill_bytes(&mut garbage);
            bytes.splice(..0, garbage);
        }
        if hits(&mut armed.reorder_frames) {
            armed.overtaken.extend(bytes);
            return Vec::new();
        }
        bytes.append(&mut armed.overtaken);
        if hits(&mut armed.burst_frames) {
            armed.burst.extend(bytes);
            return if armed.burst_frames == 0 { std::mem::take(&mut armed.burst) } else { Vec::new() };
        }
        bytes
    }

    /// Removes the bytes that are lost on the way.
    pub(super) fn pass(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        let dropped = self.armed.drop_bytes.min(bytes.len());
        self.armed.drop_bytes -= dropped;
        bytes.drain(..dropped);
        bytes
    }
}

/// True if the fault hits this frame; counts it.
fn hits(frames: &mut usize) -> bool {
    let is_armed = *frames > 0;
    *frames = frames.saturating_sub(1);
    is_armed
}
