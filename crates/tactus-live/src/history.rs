//! The frames of the last minutes, for pages that open later.

use std::collections::VecDeque;

use tactus_schema::pb;

/// Frames that are kept at most: five minutes at 30 Hz. The oldest are dropped.
const FRAMES_MAX: usize = 9_000;
/// Bytes that they take at most, for larger arrays.
const BYTES_MAX: usize = 16 << 20;
/// Bytes of a frame without its counts.
const HEAD_BYTES: usize = 32;

/// The last frames of one array, in order, each with where the tip was.
#[derive(Debug, Clone, Default)]
pub struct History {
    elements: usize,
    moments: VecDeque<Moment>,
}

/// A frame with where the tip was.
#[derive(Debug, Clone)]
pub struct Moment {
    seq: u64,
    /// When it reached the service: its monotonic clock.
    pub t_s: f64,
    t_wall_ns: i64,
    /// x, y, z; NaN if they are not known.
    pub tip_mm: [f32; 3],
    /// Frames known to be lost just before it.
    pub lost_before: u32,
    /// One per element, row-major.
    pub counts: Vec<f32>,
}

/// What a frame is to those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// It comes after them.
    Next,
    /// It is one of them: after a new connection the service tells its last frames again.
    Again,
    /// It is of a service that has started anew.
    Restarted,
}

impl History {
    /// Keeps a frame, unless it was told before. Older ones go if it is of another array, or of a service that has started anew.
    pub fn push(&mut self, frame: &pb::Frame, stage: Option<&pb::StageState>) -> Order {
        let order = match self.moments.back() {
            Some(last) if frame.seq <= last.seq && frame.t_wall_ns <= last.t_wall_ns => return Order::Again,
            Some(last) if frame.seq <= last.seq => Order::Restarted,
            Some(_) | None => Order::Next,
        };
        if frame.counts.len() != self.elements || order == Order::Restarted {
            self.moments.clear();
            self.elements = frame.counts.len();
        }
        let bytes = HEAD_BYTES + 4 * self.elements;
        while self.moments.len() >= FRAMES_MAX || (self.moments.len() + 1) * bytes > BYTES_MAX {
            if self.moments.pop_front().is_none() {
                break;
            }
        }
        self.moments.push_back(Moment {
            seq: frame.seq,
            t_s: frame.t_mono_ns as f64 * 1e-9,
            t_wall_ns: frame.t_wall_ns,
            tip_mm: stage.map_or([f32::NAN; 3], tip_mm),
            lost_before: frame.lost_before,
            counts: frame.counts.clone(),
        });
        order
    }

    /// The frames, the oldest first.
    pub fn moments(&self) -> impl DoubleEndedIterator<Item = &Moment> + ExactSizeIterator {
        self.moments.iter()
    }

    /// Mean counts of the last `frames` frames; `None` if there are fewer, or some were lost between them.
    pub fn mean(&self, frames: usize) -> Option<Vec<f32>> {
        let from = self.moments.len().checked_sub(frames).filter(|_| frames > 0)?;
        let mut sums = vec![0.0_f64; self.elements];
        let mut before: Option<u64> = None;
        for moment in self.moments.range(from..) {
            if before.is_some_and(|before| moment.seq != before + 1) {
                return None;
            }
            before = Some(moment.seq);
            for (sum, &counts) in sums.iter_mut().zip(&moment.counts) {
                *sum += f64::from(counts);
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "counts need no more than a float's digits")]
        let mean = |sum: f64| (sum / frames as f64) as f32;
        Some(sums.into_iter().map(mean).collect())
    }

    /// Where the tip was lowest in the last `frames` frames, z in mm; `None` if that is not known of each.
    pub fn lowest_z_mm(&self, frames: usize) -> Option<f32> {
        let from = self.moments.len().checked_sub(frames)?;
        let heights = self.moments.range(from..).map(|moment| moment.tip_mm[2]);
        heights.map(|z_mm| Some(z_mm).filter(|z_mm| z_mm.is_finite())).reduce(|a, b| Some(a?.min(b?)))?
    }

    /// All frames for the page, least significant byte first: the number of elements and of frames as `u32`; then for each frame its
    /// number and its time in s as `f64`, x, y and z of the tip in mm and the frames lost before it as `f32`, and its counts as `f32`.
    /// A place of the tip that is not known is NaN.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(8 + self.moments.len() * (HEAD_BYTES + 4 * self.elements));
        for number in [self.elements, self.moments.len()] {
            bytes.extend(u32::try_from(number).unwrap_or(u32::MAX).to_le_bytes());
        }
        for moment in &self.moments {
            bytes.extend((moment.seq as f64).to_le_bytes());
            bytes.extend(moment.t_s.to_le_bytes());
            for place in moment.tip_mm {
                bytes.extend(place.to_le_bytes());
            }
            bytes.extend((moment.lost_before as f32).to_le_bytes());
            for counts in &moment.counts {
                bytes.extend(counts.to_le_bytes());
            }
        }
        bytes
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a place in mm needs no more than a float's digits")]
fn tip_mm(stage: &pb::StageState) -> [f32; 3] {
    [stage.x_mm as f32, stage.y_mm as f32, stage.z_mm as f32]
}

#[cfg(test)]
#[path = "history_tests.rs"]
mod tests;
