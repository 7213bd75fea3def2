//! The presses, and the mean reading of each dwell above its baseline.

use std::collections::{BTreeMap, BTreeSet};

use tactus_model::Array;
use tactus_record::Timeline;
use tactus_schema::{
    MonoTime,
    pb::{self, run_event::Event},
};

use super::frames::{FrameStatistics, seconds};

/// A press within this distance of an element's centre, in pitches, counts as a press on that element.
const CENTRE_PITCHES: f64 = 0.3;

/// One completed press.
#[derive(Debug, Clone, PartialEq)]
pub struct PressSummary {
    /// Index of the press in the run.
    pub index: i32,
    /// Target position in the sensor frame.
    pub at_mm: [f64; 2],
    /// The element whose centre is within 0.3 pitch.
    pub element: Option<usize>,
    /// How the script asked the tip to come.
    pub way: PressWay,
    /// The dwells in order of time.
    pub dwells: Vec<DwellSummary>,
}

/// How a script asked the tip to come.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PressWay {
    /// Loading speed; `None` for the rig's.
    pub speed_mm_per_s: Option<f64>,
    /// From where beside the place; `None` from above.
    pub from_mm: Option<[f64; 2]>,
}

/// The mean reading at one depth.
#[derive(Debug, Clone, PartialEq)]
pub struct DwellSummary {
    /// When its average began, since the start of the run.
    pub at_s: f64,
    /// Depth below the covering's nominal surface.
    pub depth_mm: f64,
    /// Thickness of the covering in place.
    pub covering_mm: f64,
    /// Number of frames averaged.
    pub frames: u32,
    /// Mean counts above the baseline, row-major.
    pub rise_counts: Vec<f32>,
}

/// Source of the baseline. If some dwells had no tare before them, their source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Baseline {
    /// The last tare before the dwell.
    Tare,
    /// The mean of this many frames before the first press.
    FirstFrames(u64),
    /// The rig file.
    RigFile,
}

impl DwellSummary {
    /// Sum of the rises of all elements.
    pub fn total_counts(&self) -> f64 {
        self.rise_counts.iter().map(|rise| f64::from(*rise)).sum()
    }
}

/// The presses of a run.
pub(super) struct Presses {
    pub(super) done: Vec<PressSummary>,
    pub(super) baseline: Baseline,
    /// Presses that were interrupted and repeated.
    pub(super) void: BTreeSet<i32>,
    /// Number of dwells whose counts are not one finite number per element.
    pub(super) malformed_dwells: u32,
    baselines: Baselines,
}

impl Presses {
    pub(super) fn of(timeline: &Timeline, frames: &FrameStatistics) -> Self {
        let array = &timeline.rig().array;
        let void: BTreeSet<i32> = timeline
            .events()
            .iter()
            .filter_map(|event| match &event.event {
                Some(Event::PressRepeated(repeated)) => Some(repeated.press),
                _ => None,
            })
            .collect();
        let baselines = Baselines::of(timeline, frames);
        let (mut baseline, mut malformed_dwells) = (Baseline::Tare, 0);
        let mut presses: BTreeMap<i32, PressSummary> = BTreeMap::new();
        let mut way = PressWay::default();
        for event in timeline.events() {
            let done = match &event.event {
                Some(Event::StepStarted(step)) => {
                    way = PressWay::of_step(&step.step_json);
                    continue;
                }
                Some(Event::DwellDone(done)) => done,
                _ => continue,
            };
            if done.press < 0 || void.contains(&done.press) {
                continue;
            }
            let at = MonoTime::from_ns(done.from_mono_ns);
            let (zero_counts, tared) = baselines.at(at);
            if !fits(done, array) {
                malformed_dwells += 1;
                continue;
            }
            if !tared {
                baseline = baselines.fallback;
            }
            let rise = |(counts, zero): (&f32, &f32)| counts - zero;
            let press = presses.entry(done.press).or_insert_with(|| PressSummary {
                index: done.press,
                at_mm: [done.x_mm, done.y_mm],
                element: element_at(array, [done.x_mm, done.y_mm]),
                way,
                dwells: Vec::new(),
            });
            press.dwells.push(DwellSummary {
                at_s: seconds(timeline, at),
                depth_mm: done.depth_mm,
                covering_mm: timeline.covering_mm(at),
                frames: done.frames,
                rise_counts: done.mean_counts.iter().zip(zero_counts).map(rise).collect(),
            });
        }
        Self { done: presses.into_values().collect(), baseline, void, malformed_dwells, baselines }
    }

    /// Sum over all elements of the baseline at a time.
    pub(super) fn zero_total_counts(&self, at: MonoTime) -> f64 {
        self.baselines.at(at).0.iter().map(|counts| f64::from(*counts)).sum()
    }
}

impl PressWay {
    /// As a step's JSON says, [`pb::StepStarted::step_json`]; the default for other steps.
    fn of_step(step_json: &str) -> Self {
        let step: serde_json::Value = serde_json::from_str(step_json).unwrap_or_default();
        let press = &step["Press"];
        let from = &press["approach_from_mm"];
        Self {
            speed_mm_per_s: press["speed_mm_per_s"].as_f64(),
            from_mm: from[0].as_f64().zip(from[1].as_f64()).map(<[f64; 2]>::from),
        }
    }
}

/// The baselines of a run.
struct Baselines {
    tares: Vec<(MonoTime, Vec<f32>)>,
    before: Vec<f32>,
    fallback: Baseline,
}

impl Baselines {
    fn of(timeline: &Timeline, frames: &FrameStatistics) -> Self {
        let elements = timeline.rig().array.elements();
        let mut tares: Vec<(MonoTime, Vec<f32>)> = timeline
            .events()
            .iter()
            .filter_map(|event| match &event.event {
                Some(Event::TareDone(tare)) if tare.baseline_counts.len() == elements => {
                    Some((MonoTime::from_ns(event.t_mono_ns), tare.baseline_counts.clone()))
                }
                _ => None,
            })
            .collect();
        tares.sort_by_key(|(at, _)| *at);
        let (before, fallback) = match frames.first_mean_counts() {
            Some((mean_counts, frames)) => (mean_counts, Baseline::FirstFrames(frames)),
            None => (as_f32(&timeline.rig().baseline_counts), Baseline::RigFile),
        };
        Self { tares, before, fallback }
    }

    /// The baseline at a time, and whether it is a tare.
    fn at(&self, at: MonoTime) -> (&[f32], bool) {
        let next = self.tares.partition_point(|(from, _)| *from <= at);
        match next.checked_sub(1).and_then(|index| self.tares.get(index)) {
            Some((_, baseline)) => (baseline, true),
            None => (&self.before, false),
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "counts are far within f32")]
fn as_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}

fn fits(done: &pb::DwellDone, array: &Array) -> bool {
    done.mean_counts.len() == array.elements()
        && done.mean_counts.iter().all(|counts| counts.is_finite())
        && [done.x_mm, done.y_mm, done.depth_mm].iter().all(|mm| mm.is_finite())
}

/// The element whose centre is within [`CENTRE_PITCHES`] of a position.
pub(super) fn element_at(array: &Array, [x_mm, y_mm]: [f64; 2]) -> Option<usize> {
    let nearest = |centres: &[f64], at: f64| {
        let distance =
            |(_, a): &(usize, &f64), (_, b): &(usize, &f64)| (*a - at).abs().total_cmp(&(*b - at).abs());
        centres.iter().enumerate().min_by(distance).map(|(index, centre)| (index, centre - at))
    };
    let (col, dx_mm) = nearest(array.col_centres_mm(), x_mm)?;
    let (row, dy_mm) = nearest(array.row_centres_mm(), y_mm)?;
    (dx_mm.hypot(dy_mm) <= CENTRE_PITCHES * pitch_mm(array)).then_some(row * array.cols() + col)
}

/// The least distance between two centres along an axis; for a single element, its size.
fn pitch_mm(array: &Array) -> f64 {
    let apart = |centres: &[f64]| {
        centres.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?)).fold(f64::INFINITY, f64::min)
    };
    let least = apart(array.col_centres_mm()).min(apart(array.row_centres_mm()));
    if least.is_finite() { least } else { array.element_mm()[0] }
}

/// A length in micrometres: lengths that are equal to a reader have the same.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
pub(super) fn key_of_mm(mm: f64) -> i64 {
    (mm * 1e3).round() as i64
}
