//! The mean over the frames of a time interval.

use tactus_schema::{Frame, MonoTime};
use tokio::sync::oneshot;

/// The frames received within `[from, until)`, averaged.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Average {
    /// Per element, counts.
    pub(crate) mean_counts: Vec<f64>,
    /// Per element, standard deviation over the frames, counts; 0 for a single frame.
    pub(crate) rms_counts: Vec<f64>,
    /// Number of frames averaged.
    pub(crate) frames: u32,
    /// Frames of the interval that were lost, or that arrived too late to be of it.
    pub(crate) lost: u64,
    /// True if the sensor connected anew meanwhile.
    pub(crate) is_disturbed: bool,
    /// Arrival of the first and the last of them.
    pub(crate) span: [MonoTime; 2],
}

/// Running mean and sum of squared deviations of one element (Welford 1962).
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    mean: f64,
    squares: f64,
}

/// An average in progress. The acquisition task adds the frames.
#[derive(Debug)]
pub(crate) struct Window {
    from: MonoTime,
    until: MonoTime,
    moments: Vec<Moments>,
    frames: u32,
    lost: u64,
    is_disturbed: bool,
    span: [MonoTime; 2],
    done: oneshot::Sender<Average>,
}

impl Window {
    /// A window that averages at least one frame, and every frame that arrives before `until`.
    pub(crate) fn open(from: MonoTime, until: MonoTime) -> (Self, oneshot::Receiver<Average>) {
        let (done, average) = oneshot::channel();
        (
            Self {
                from,
                until,
                moments: Vec::new(),
                frames: 0,
                lost: 0,
                is_disturbed: false,
                span: [from; 2],
                done,
            },
            average,
        )
    }

    /// The sensor connected anew.
    pub(crate) fn disturb(&mut self) {
        self.is_disturbed = true;
    }

    /// Adds a frame. Returns itself while it needs more frames. A late frame was sampled at another time than it seems: it counts as
    /// lost.
    pub(crate) fn take(mut self, frame: &Frame, is_late: bool) -> Option<Self> {
        let at = frame.received.mono;
        if at < self.from {
            return Some(self);
        }
        self.lost += u64::from(frame.lost_before) + u64::from(is_late);
        if at < self.until || self.frames == 0 {
            if !is_late {
                self.add(frame);
            }
            return Some(self);
        }
        let freedom = f64::from((self.frames - 1).max(1));
        let average = Average {
            mean_counts: self.moments.iter().map(|moments| moments.mean).collect(),
            rms_counts: self.moments.iter().map(|moments| (moments.squares / freedom).sqrt()).collect(),
            frames: self.frames,
            lost: self.lost,
            is_disturbed: self.is_disturbed,
            span: self.span,
        };
        // The receiver is gone if the waiting run was interrupted; the average is then not needed.
        drop(self.done.send(average));
        None
    }

    fn add(&mut self, frame: &Frame) {
        if self.frames == 0 {
            self.moments = vec![Moments::default(); frame.counts.len()];
            self.span[0] = frame.received.mono;
        }
        self.frames += 1;
        for (moments, count) in self.moments.iter_mut().zip(frame.counts.iter()) {
            let deviation = f64::from(*count) - moments.mean;
            moments.mean += deviation / f64::from(self.frames);
            moments.squares += deviation * (f64::from(*count) - moments.mean);
        }
        self.span[1] = frame.received.mono;
    }
}

#[cfg(test)]
#[path = "average_tests.rs"]
mod tests;
