//! A stretch of consecutive frames of one kind, and its mean without outlying frames.

use tactus_schema::table::{Phase, RowView};

use super::{CLEAR_MM, Dwell};
use crate::order::median;

/// A frame is left out if an element is more than this many robust standard deviations away from its median.
const OUTLYING: f64 = 10.0;
/// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
const MAD_TO_SD: f64 = 1.4826;
/// A tip stands still within this distance of its median height.
const STILL_MM: f64 = 0.002;

/// What a stretch of frames is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum SegmentKind {
    /// Nothing: the tip moves in the air, or goes up.
    #[default]
    Between,
    /// Nothing touches.
    Rest,
    /// Going deeper in the press of that index.
    Load(i32),
    /// Holding a depth in the press of that index.
    Hold(i32),
}

impl SegmentKind {
    pub(super) fn of(row: &RowView<'_>) -> Self {
        match row.phase {
            Phase::Idle => Self::Rest,
            Phase::Approach | Phase::Retract if row.position_mm[2] >= CLEAR_MM => Self::Rest,
            Phase::Load if row.press >= 0 => Self::Load(row.press),
            Phase::Hold if row.press >= 0 => Self::Hold(row.press),
            Phase::Approach | Phase::Retract | Phase::Load | Phase::Hold | Phase::Unload => Self::Between,
        }
    }
}

/// Frames of one kind.
#[derive(Debug, Default)]
pub(super) struct Segment {
    pub(super) kind: SegmentKind,
    heights_mm: Vec<f64>,
    /// Frame after frame.
    counts: Vec<f32>,
}

/// Mean over the frames of a segment.
pub(super) struct SegmentMean {
    pub(super) counts: Vec<f64>,
    /// Sum of the squared deviations of each element.
    pub(super) squares: Vec<f64>,
    pub(super) frames: usize,
    pub(super) left_out: usize,
}

impl Segment {
    pub(super) fn push(&mut self, [_, _, z_mm]: [f64; 3], counts: &[f32]) {
        self.heights_mm.push(z_mm);
        self.counts.extend_from_slice(counts);
    }

    /// Keeps the frames in which the tip stood still and gives its height; `None` without frames.
    ///
    /// The first and the last of them are dropped too: positions between two reports are not exact, so the tip may have
    /// moved during these frames.
    pub(super) fn settle(&mut self) -> Option<f64> {
        let elements = self.elements()?;
        let height_mm = median(self.heights_mm.iter().copied())?;
        let mut still: Vec<usize> = (0..self.heights_mm.len())
            .filter(|frame| (self.heights_mm[*frame] - height_mm).abs() <= STILL_MM)
            .collect();
        if still.len() > 3 {
            still = still[1..still.len() - 1].to_vec();
        }
        self.counts = still
            .iter()
            .flat_map(|frame| &self.counts[frame * elements..(frame + 1) * elements])
            .copied()
            .collect();
        self.heights_mm = still.iter().map(|frame| self.heights_mm[*frame]).collect();
        Some(height_mm)
    }

    /// The mean of each element over the frames without outliers; `None` if there are none.
    pub(super) fn mean(&self, step_counts: f64) -> Option<SegmentMean> {
        let elements = self.elements()?;
        let frames = self.heights_mm.len();
        let column =
            |element: usize| (0..frames).map(move |frame| f64::from(self.counts[frame * elements + element]));
        let mut sound = vec![true; frames];
        // With fewer frames an outlier cannot be distinguished from noise.
        if frames >= 5 {
            for element in 0..elements {
                let centre = median(column(element))?;
                let spread = median(column(element).map(|count| (count - centre).abs()))?;
                let reach = OUTLYING * (MAD_TO_SD * spread).max(step_counts);
                for (sound, count) in sound.iter_mut().zip(column(element)) {
                    *sound &= (count - centre).abs() <= reach;
                }
            }
        }
        let kept = sound.iter().filter(|sound| **sound).count();
        // Without frames there is no mean.
        if kept == 0 {
            return None;
        }
        let (mut counts, mut squares) = (Vec::with_capacity(elements), Vec::with_capacity(elements));
        for element in 0..elements {
            let kept_counts =
                || column(element).zip(&sound).filter(|(_, sound)| **sound).map(|(count, _)| count);
            let mean = kept_counts().sum::<f64>() / kept as f64;
            squares.push(kept_counts().map(|count| (count - mean).powi(2)).sum());
            counts.push(mean);
        }
        Some(SegmentMean { counts, squares, frames: kept, left_out: frames - kept })
    }

    /// Every frame as a dwell of its own that was not held.
    pub(super) fn frames(&self) -> impl Iterator<Item = Dwell> {
        let elements = self.elements().unwrap_or(1);
        self.heights_mm.iter().zip(self.counts.chunks_exact(elements)).map(|(height_mm, counts)| Dwell {
            height_mm: *height_mm,
            counts: counts.iter().map(|count| f64::from(*count)).collect(),
            frames: 1,
            held: false,
        })
    }

    fn elements(&self) -> Option<usize> {
        self.counts.len().checked_div(self.heights_mm.len()).filter(|elements| *elements > 0)
    }
}
