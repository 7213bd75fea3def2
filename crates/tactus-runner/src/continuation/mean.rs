//! The mean over the frames of a time interval, made again from the recorded frames.

use tactus_schema::{Frame, MonoTime};

/// A mean as the engine made it (Welford 1962): from equal frames in equal order, it is equal to the last bit.
#[derive(Debug, Clone)]
pub(super) struct Mean {
    from: MonoTime,
    until: MonoTime,
    /// Number of frames that it was made of.
    frames: u32,
    /// Frames taken so far.
    taken: u32,
    /// Mean per element.
    counts: Vec<f64>,
    squares: Vec<f64>,
}

impl Mean {
    /// Over the `frames` that arrived from the first time to the last.
    pub(super) fn over(frames: u32, from_mono_ns: i64, to_mono_ns: i64) -> Self {
        Self {
            from: MonoTime::from_ns(from_mono_ns),
            until: MonoTime::from_ns(to_mono_ns),
            frames,
            taken: 0,
            counts: Vec::new(),
            squares: Vec::new(),
        }
    }

    /// True if frames that arrive now come too late for it.
    pub(super) fn is_before(&self, at: MonoTime) -> bool {
        self.until < at
    }

    /// Adds a frame, if it is of the interval.
    pub(super) fn take(&mut self, frame: &Frame) {
        if !(self.from..=self.until).contains(&frame.received.mono) {
            return;
        }
        if self.taken == 0 {
            self.counts = vec![0.0; frame.counts.len()];
            self.squares = vec![0.0; frame.counts.len()];
        }
        self.taken += 1;
        for ((mean, squares), count) in self.counts.iter_mut().zip(&mut self.squares).zip(frame.counts.iter())
        {
            let deviation = f64::from(*count) - *mean;
            *mean += deviation / f64::from(self.taken);
            *squares += deviation * (f64::from(*count) - *mean);
        }
    }

    /// Per element, counts; `None` if frames are missing.
    pub(super) fn mean_counts(&self) -> Option<&[f64]> {
        (self.taken == self.frames && self.taken > 0).then_some(&self.counts)
    }

    /// Standard deviation of each element over the frames, counts.
    pub(super) fn rms_counts(&self) -> Vec<f64> {
        let freedom = f64::from((self.taken.max(1) - 1).max(1));
        self.squares.iter().map(|squares| (squares / freedom).sqrt()).collect()
    }

    /// Number of frames that it was made of.
    pub(super) fn frames(&self) -> u32 {
        self.frames
    }
}
