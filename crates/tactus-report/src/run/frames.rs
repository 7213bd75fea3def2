//! Signal, losses and timing, from each frame of the recording.

use std::path::Path;

use tactus_record::{Entry, Message, Tally, Timeline, read};
use tactus_schema::{DeviceTick, Frame, MonoTime, pb, table::Phase};

use super::{ReportError, presses::Presses};

/// At most this many frames before the first press make a baseline: two seconds of the paper's sensor.
const FIRST_FRAMES_MAX: u64 = 60;

/// Above this height nothing touches the covering, even if the declared surface is wrong; a calibration asks for the same.
const CLEAR_MM: f64 = 0.3;

/// Depth and signal over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Depth of the tip below the nominal surface, 0 above it: `[s, mm]`.
    pub depth: Vec<[f64; 2]>,
    /// Sum over all elements of the counts above the baseline: `[s, counts]`.
    pub signal: Vec<[f64; 2]>,
}

/// A gap in the sequence of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameLoss {
    /// Time of the next frame since the start of the run.
    pub at_s: f64,
    /// Frames that never arrived.
    pub frames: u64,
    /// Sequence number of the last frame before.
    pub after_seq: u64,
    /// Sequence number of the next frame.
    pub next_seq: u64,
    /// Index of the press in which it happened; -1 outside any press.
    pub press: i32,
}

/// The time between consecutive frames without a loss between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// The nominal interval: one over the array's rate.
    pub expected_ms: f64,
    /// By the device's clock; `None` without a clock that can be related to the host's.
    pub device: Option<Intervals>,
    /// By the host's clock at arrival.
    pub host: Option<Intervals>,
    /// A sentence about the device's clock for each connection.
    pub clocks: Vec<String>,
}

/// Intervals between frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Intervals {
    /// All intervals, ascending.
    pub sorted_ms: Vec<f64>,
    /// Their standard deviation.
    pub jitter_ms: f64,
}

/// Statistics of one pass over the frames.
#[derive(Default)]
pub(super) struct FrameStatistics {
    pub(super) losses: Vec<FrameLoss>,
    pub(super) safety: Vec<pb::SafetyEvent>,
    /// Time of sampling and sum of the raw counts.
    totals: Vec<(MonoTime, f64)>,
    /// Time since the start and mean of the raw counts of frames at which nothing touched.
    pub(super) rest: Vec<[f64; 2]>,
    first_sum: Vec<f64>,
    first_count: u64,
    /// True from the first frame of the first press on.
    pressed: bool,
    device_ms: Vec<f64>,
    host_ms: Vec<f64>,
}

struct Previous {
    seq: u64,
    epoch: u32,
    tick: Option<DeviceTick>,
    received: MonoTime,
}

impl FrameStatistics {
    pub(super) fn read(recording: &Path, timeline: &Timeline) -> Result<Self, ReportError> {
        let mut frames = Self::default();
        let (mut tally, mut previous) = (Tally::default(), None);
        for entry in read(recording)? {
            let entry = entry.map_err(|source| ReportError::Io { path: recording.to_owned(), source })?;
            match entry {
                Entry::Message { message: Message::Frame(frame), .. } => {
                    let lost = tally.frame(&frame);
                    frames.take(timeline, &frame, lost, previous.as_ref());
                    previous = Some(Previous {
                        seq: frame.seq,
                        epoch: frame.epoch,
                        tick: frame.device_tick,
                        received: frame.received.mono,
                    });
                }
                Entry::Message { message: Message::Safety(event), .. } => frames.safety.push(event),
                Entry::Run(_) | Entry::Attachment(_) | Entry::Message { .. } => {}
            }
        }
        Ok(frames)
    }

    fn take(&mut self, timeline: &Timeline, frame: &Frame, lost: u64, previous: Option<&Previous>) {
        let at = timeline.sampling(frame).time();
        let total: f64 = frame.counts.iter().map(|counts| f64::from(*counts)).sum();
        self.totals.push((at, total));
        let is_clear = timeline.position_mm(at).is_some_and(|[_, _, z_mm]| z_mm >= CLEAR_MM);
        if is_clear && timeline.phase(at).0 == Phase::Idle && total.is_finite() && !frame.counts.is_empty() {
            self.rest.push([seconds(timeline, at), total / frame.counts.len() as f64]);
        }
        self.baseline(timeline, frame, at);
        let Some(previous) = previous else { return };
        if lost > 0 {
            self.losses.push(FrameLoss {
                at_s: seconds(timeline, at),
                frames: lost,
                after_seq: previous.seq,
                next_seq: frame.seq,
                press: timeline.phase(at).1,
            });
        } else if previous.epoch == frame.epoch {
            self.host_ms.push((frame.received.mono.ns() - previous.received.ns()) as f64 * 1e-6);
            if let (Some(Ok(clock)), Some(from), Some(to)) =
                (timeline.clocks().get(&frame.epoch), previous.tick, frame.device_tick)
            {
                self.device_ms.push(to.0.saturating_sub(from.0) as f64 * clock.tick_ns as f64 * 1e-6);
            }
        }
    }

    /// Adds a frame before the first press to the baseline.
    fn baseline(&mut self, timeline: &Timeline, frame: &Frame, at: MonoTime) {
        let elements = timeline.rig().array.elements();
        // Frames at rest after the first press do not count.
        self.pressed |= timeline.phase(at).1 >= 0;
        let sound = frame.counts.len() == elements && frame.counts.iter().all(|counts| counts.is_finite());
        if self.pressed || !sound || self.first_count == FIRST_FRAMES_MAX {
            return;
        }
        self.first_sum.resize(elements, 0.0);
        for (sum, counts) in self.first_sum.iter_mut().zip(frame.counts.iter()) {
            *sum += f64::from(*counts);
        }
        self.first_count += 1;
    }

    /// Mean of the frames before the first press and their number; `None` without any.
    #[expect(clippy::cast_possible_truncation, reason = "counts are far within f32")]
    pub(super) fn first_mean_counts(&self) -> Option<(Vec<f32>, u64)> {
        let mean = |sum: &f64| (sum / self.first_count as f64) as f32;
        (self.first_count > 0).then(|| (self.first_sum.iter().map(mean).collect(), self.first_count))
    }

    pub(super) fn trace(&self, timeline: &Timeline, presses: &Presses) -> Trace {
        let depth = |report: &tactus_record::StageReport| {
            [seconds(timeline, report.at), (-report.position_mm[2]).max(0.0)]
        };
        let signal =
            |&(at, total): &(MonoTime, f64)| [seconds(timeline, at), total - presses.zero_total_counts(at)];
        let mut signal: Vec<[f64; 2]> = self.totals.iter().map(signal).collect();
        signal.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Trace { depth: timeline.stage().iter().map(depth).collect(), signal }
    }

    pub(super) fn timing(&self, timeline: &Timeline) -> Timing {
        let clocks = timeline.clocks().iter().map(|(epoch, clock)| match clock {
            Ok(clock) => format!(
                "Connection {epoch}: frames arrive {:.2} ms (median) and {:.2} ms (99th percentile) later than the \
                 fastest one; drift of the device's clock {:.1} ppm; tick {} ms.",
                clock.delay_p50_ns as f64 * 1e-6,
                clock.delay_p99_ns as f64 * 1e-6,
                clock.drift_ppm,
                clock.tick_ns as f64 * 1e-6,
            ),
            Err(reason) => format!("Connection {epoch}: frames have their arrival times, because {reason}."),
        });
        Timing {
            expected_ms: 1e3 / timeline.rig().array.rate_hz(),
            device: Intervals::of(&self.device_ms),
            host: Intervals::of(&self.host_ms),
            clocks: clocks.collect(),
        }
    }
}

impl Intervals {
    /// `None` for an empty list.
    fn of(intervals_ms: &[f64]) -> Option<Self> {
        if intervals_ms.is_empty() {
            return None;
        }
        let mut sorted_ms = intervals_ms.to_vec();
        sorted_ms.sort_by(f64::total_cmp);
        let mean = sorted_ms.iter().sum::<f64>() / sorted_ms.len() as f64;
        let squares: f64 = sorted_ms.iter().map(|ms| (ms - mean).powi(2)).sum();
        let jitter_ms = (squares / sorted_ms.len() as f64).sqrt();
        Some(Self { sorted_ms, jitter_ms })
    }

    /// The quantile for a share from 0 to 1, by nearest rank.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a rank in the list")]
    pub fn quantile_ms(&self, share: f64) -> f64 {
        let rank = (share * self.sorted_ms.len() as f64).ceil() as usize;
        let index = rank.clamp(1, self.sorted_ms.len().max(1)) - 1;
        self.sorted_ms.get(index).copied().unwrap_or(f64::NAN)
    }
}

/// Time since the run's first event (or, without one, since the service started).
pub(super) fn seconds(timeline: &Timeline, at: MonoTime) -> f64 {
    let start_ns = timeline.events().first().map_or(0, |event| event.t_mono_ns);
    (at.ns() - start_ns) as f64 * 1e-9
}

#[cfg(test)]
#[path = "frames_tests.rs"]
mod tests;
