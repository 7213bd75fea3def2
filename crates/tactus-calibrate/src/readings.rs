//! What was measured: frames grouped into presses, each with its dwells and the reading at rest before it.

mod segment;

use std::{collections::BTreeMap, sync::Arc};

use tactus_model::Array;
use tactus_schema::table::RowView;

use segment::{Segment, SegmentKind};

use crate::places::distinct_places;

/// Above this height nothing touches the covering, even if the declared surface is wrong.
const CLEAR_MM: f64 = 0.3;
/// A press that holds at least this many depths shows the response without frames in motion.
const STEPS_LEAST: usize = 3;

/// Frames grouped into presses and dwells: the input of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Number of elements.
    pub elements: usize,
    /// Ids of the runs.
    pub runs: Vec<String>,
    /// The presses, run by run, in order.
    pub presses: Vec<MeasuredPress>,
    /// Standard deviation of each element at rest, at least that of rounding to the converter's step; `None` for an
    /// element that was never at rest.
    pub noise_rms_counts: Vec<Option<f64>>,
    /// Mean of each element at rest, and its standard error from the scatter between rests.
    pub rest_counts: Vec<Option<[f64; 2]>>,
    /// Reading of each element that read the same in every frame.
    pub constant_counts: Vec<Option<f32>>,
    /// Frames in all.
    pub frames: u64,
    /// Frames at rest.
    pub frames_at_rest: u64,
    /// Frames left out because an element's reading is an outlier.
    pub frames_left_out: u64,
}

/// One contact at one place.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPress {
    /// Index of its run in [`Readings::runs`].
    pub run: usize,
    /// Its index in the run.
    pub index: i32,
    /// Position in the plane; robot frame.
    pub place_mm: [f64; 2],
    /// Thickness of the covering in place.
    pub covering_mm: f64,
    /// Id of the tool on the stage.
    pub indenter: Arc<str>,
    /// The reading at rest before it, if there was one.
    pub rest: Option<Rest>,
    /// Its dwells, in order of time: the mean of each held depth and, if few depths were held, every frame of the loading too.
    pub dwells: Vec<Dwell>,
}

/// The reading before a press, with nothing on the covering.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// Mean of each element.
    pub counts: Vec<f64>,
    /// Frames in the mean.
    pub frames: usize,
}

/// The readings at one depth of a press.
#[derive(Debug, Clone, PartialEq)]
pub struct Dwell {
    /// Height of the tip in the robot frame; the depth is the surface's height less this.
    pub height_mm: f64,
    /// Mean of each element, raw.
    pub counts: Vec<f64>,
    /// Frames in the mean.
    pub frames: usize,
    /// True if the tip stood still.
    pub held: bool,
}

/// Gathers rows into [`Readings`].
#[derive(Debug)]
pub struct ReadingsBuilder {
    elements: usize,
    step_counts: f64,
    readings: Readings,
    /// The frames of the stretch of time in progress.
    segment: Segment,
    rest: Option<Rest>,
    loading: Vec<Dwell>,
    noise: Vec<RestSums>,
    range_counts: Vec<Option<[f32; 2]>>,
    indenters: BTreeMap<String, Arc<str>>,
}

/// Sums of one element's readings at rest.
#[derive(Debug, Clone, Default)]
struct RestSums {
    squares: f64,
    freedom: f64,
    means: Vec<f64>,
}

impl MeasuredPress {
    /// Rise of an element at a dwell above its rest, and the variance of that in units of one frame's.
    ///
    /// `None` if there is no rest before the press, or the array has no such element.
    pub fn rise(&self, dwell: &Dwell, element: usize) -> Option<[f64; 2]> {
        let rest = self.rest.as_ref()?;
        let rise = dwell.counts.get(element)? - rest.counts.get(element)?;
        Some([rise, 1.0 / dwell.frames as f64 + 1.0 / rest.frames as f64])
    }

    /// The deepest dwell.
    pub fn deepest(&self) -> Option<&Dwell> {
        self.dwells.iter().min_by(|a, b| a.height_mm.total_cmp(&b.height_mm))
    }

    /// Number of dwells in which the tip stood still.
    fn held(&self) -> usize {
        self.dwells.iter().filter(|dwell| dwell.held).count()
    }
}

impl ReadingsBuilder {
    /// Starts without rows; every row must have one count for each element of `array`.
    pub fn new(array: &Array) -> Self {
        let elements = array.elements();
        Self {
            elements,
            step_counts: array.step_counts(),
            readings: Readings {
                elements,
                runs: Vec::new(),
                presses: Vec::new(),
                noise_rms_counts: Vec::new(),
                rest_counts: Vec::new(),
                constant_counts: Vec::new(),
                frames: 0,
                frames_at_rest: 0,
                frames_left_out: 0,
            },
            segment: Segment::default(),
            rest: None,
            loading: Vec::new(),
            noise: vec![RestSums::default(); elements],
            range_counts: vec![None; elements],
            indenters: BTreeMap::new(),
        }
    }

    /// Takes the next row.
    ///
    /// # Panics
    /// If it has not one count per element.
    pub fn take(&mut self, row: RowView<'_>) {
        assert_eq!(row.counts.len(), self.elements, "one count per element");
        self.readings.frames += 1;
        for (range, count) in self.range_counts.iter_mut().zip(row.counts) {
            let [least, most] = range.unwrap_or([*count; 2]);
            *range = Some([least.min(*count), most.max(*count)]);
        }
        if self.readings.runs.last().is_none_or(|run| run != row.run) {
            self.close();
            self.end_press();
            self.rest = None;
            self.readings.runs.push(row.run.to_owned());
        }
        let kind = SegmentKind::of(&row);
        if kind != self.segment.kind {
            self.close();
            self.segment.kind = kind;
        }
        if let SegmentKind::Load(press) | SegmentKind::Hold(press) = kind
            && self
                .readings
                .presses
                .last()
                .is_none_or(|last| last.index != press || last.run + 1 != self.readings.runs.len())
        {
            self.end_press();
            self.begin_press(&row);
        }
        if kind != SegmentKind::Between {
            self.segment.push(row.position_mm, row.counts);
        }
    }

    /// Ends the last press and computes noise, rests and constant readings.
    pub fn finish(mut self) -> Readings {
        self.close();
        self.end_press();
        let Self { mut readings, noise, range_counts, step_counts, .. } = self;
        readings.presses.retain(|press| !press.dwells.is_empty());
        // Frames in motion count only if all presses are at one place and hold hardly any depth.
        let stepped = readings.presses.iter().any(|press| press.held() >= STEPS_LEAST);
        if stepped || distinct_places(readings.presses.iter().map(|press| press.place_mm)).len() > 1 {
            for press in &mut readings.presses {
                press.dwells.retain(|dwell| dwell.held);
            }
            readings.presses.retain(|press| !press.dwells.is_empty());
        }
        // The standard deviation of an even distribution over one step.
        let rounding_counts = step_counts / 12.0_f64.sqrt();
        for noise in noise {
            readings.noise_rms_counts.push(noise.rms().map(|rms| rms.max(rounding_counts)));
            readings.rest_counts.push(noise.mean());
        }
        readings.constant_counts = range_counts
            .into_iter()
            .map(|range| range.and_then(|[least, most]| (least >= most).then_some(least)))
            .collect();
        readings
    }

    /// Ends the stretch of time in progress and stores it as a rest, a dwell or frames of loading.
    fn close(&mut self) {
        let segment = std::mem::take(&mut self.segment);
        match segment.kind {
            SegmentKind::Between => {}
            SegmentKind::Rest => self.end_rest(&segment),
            SegmentKind::Load(_) => self.loading.extend(segment.frames()),
            SegmentKind::Hold(_) => self.end_hold(segment),
        }
    }

    fn end_rest(&mut self, segment: &Segment) {
        let Some(mean) = segment.mean(self.step_counts) else { return };
        self.readings.frames_left_out += mean.left_out as u64;
        self.readings.frames_at_rest += mean.frames as u64;
        for ((noise, counts), squares) in self.noise.iter_mut().zip(&mean.counts).zip(&mean.squares) {
            noise.squares += squares;
            noise.freedom += mean.frames as f64 - 1.0;
            noise.means.push(*counts);
        }
        self.rest = Some(Rest { counts: mean.counts, frames: mean.frames });
    }

    fn end_hold(&mut self, mut segment: Segment) {
        let Some(height_mm) = segment.settle() else { return };
        let Some(mean) = segment.mean(self.step_counts) else { return };
        self.readings.frames_left_out += mean.left_out as u64;
        if let Some(press) = self.readings.presses.last_mut() {
            press.dwells.push(Dwell { height_mm, counts: mean.counts, frames: mean.frames, held: true });
        }
    }

    fn begin_press(&mut self, row: &RowView<'_>) {
        let [x_mm, y_mm, _] = row.position_mm;
        let name = row.indenter;
        let indenter = self.indenters.entry(name.to_owned()).or_insert_with(|| name.into());
        let indenter = Arc::clone(indenter);
        self.readings.presses.push(MeasuredPress {
            run: self.readings.runs.len() - 1,
            index: row.press,
            place_mm: [x_mm, y_mm],
            covering_mm: row.covering_mm,
            indenter,
            rest: self.rest.clone(),
            dwells: Vec::new(),
        });
    }

    /// Gives the press in progress its frames in motion; [`ReadingsBuilder::finish`] decides whether they stay.
    fn end_press(&mut self) {
        let loading = std::mem::take(&mut self.loading);
        if let Some(press) = self.readings.presses.last_mut() {
            press.dwells.splice(0..0, loading);
        }
    }
}

impl RestSums {
    fn rms(&self) -> Option<f64> {
        (self.freedom > 0.0).then(|| (self.squares / self.freedom).sqrt())
    }

    /// Mean over the rests, and its standard error.
    fn mean(&self) -> Option<[f64; 2]> {
        let rests = self.means.len() as f64;
        let mean = (rests > 0.0).then(|| self.means.iter().sum::<f64>() / rests)?;
        let squares: f64 = self.means.iter().map(|rest| (rest - mean).powi(2)).sum();
        let variance =
            if rests > 1.0 { squares / (rests - 1.0) / rests } else { self.squares / self.freedom.powi(2) };
        Some([mean, variance.sqrt()])
    }
}

/// `1 place was`, `2 places were`.
pub(crate) fn number_of(places: usize) -> String {
    if places == 1 { "1 place was".into() } else { format!("{places} places were") }
}

#[cfg(test)]
#[path = "readings_tests.rs"]
mod tests;
