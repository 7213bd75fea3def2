//! The rig of a lab's file: what the mapping says of it, completed by what its readings show.

use std::{collections::BTreeMap, fs, path::Path};

use serde_json::{Map, Value, json};
use tactus_schema::{Rig, rig::SCHEMA, table::Phase};

use crate::{
    ImportError,
    mapping::{Description, Mapping, Wrong, wrong},
    runs::Run,
};

/// Above this height nothing touches the covering; a calibration asks for the same.
const CLEAR_MM: f64 = 0.3;

/// The paper's spread (Eq. 4), in mm: where a calibration begins.
const PAPER_PSF: [f64; 2] = [2.22, 0.497];

/// The rig of a file, and what of it was not told.
#[derive(Debug)]
pub(crate) struct CompleteRig {
    pub(crate) rig: Rig,
    pub(crate) json: String,
    /// What was taken from the readings or from the paper, a sentence each.
    pub(crate) assumed: Vec<String>,
}

/// A rig as far as the mapping tells it.
pub(crate) enum Sketch {
    Whole(Box<Rig>),
    Keys(Map<String, Value>),
}

impl Sketch {
    /// Reads the rig file that the mapping names, or its own table.
    pub(crate) fn read(map: &Path, description: &Description) -> Result<Self, ImportError> {
        match description {
            Description::File(name) => {
                let path = map.parent().unwrap_or(Path::new("")).join(name);
                let text = fs::read_to_string(&path).map_err(|source| ImportError::Io {
                    action: "read",
                    path: path.clone(),
                    source,
                })?;
                let rig = Rig::from_toml(&text)
                    .map_err(|source| ImportError::Rig { path, source: Box::new(source) })?;
                Ok(Self::Whole(Box::new(rig)))
            }
            Description::Table(table) => {
                let keys = json!(table).as_object().cloned().unwrap_or_default();
                asked(&keys).map_err(|wrong| wrong.in_file(map))?;
                Ok(Self::Keys(keys))
            }
        }
    }

    /// Rows and columns of the array.
    pub(crate) fn shape(&self, map: &Path) -> Result<[usize; 2], ImportError> {
        match self {
            Self::Whole(rig) => Ok([rig.array.rows(), rig.array.cols()]),
            Self::Keys(keys) => {
                let count = |key: &str| {
                    let number = keys["array"][key].as_u64().and_then(|number| usize::try_from(number).ok());
                    number.filter(|number| (1..=1000).contains(number)).ok_or_else(|| {
                        wrong(format!("rig.array.{key}"), "a number of elements, from 1 to 1000").in_file(map)
                    })
                };
                Ok([count("rows")?, count("cols")?])
            }
        }
    }

    /// The rig, completed by the readings.
    pub(crate) fn complete(
        self,
        map: &Path,
        mapping: &Mapping,
        [rows, cols]: [usize; 2],
        runs: &[Run],
    ) -> Result<CompleteRig, ImportError> {
        let mut keys = match self {
            Self::Whole(rig) => {
                return Ok(CompleteRig { json: rig.to_json(), rig: *rig, assumed: Vec::new() });
            }
            Self::Keys(keys) => keys,
        };
        let readings = Readings { runs, elements: rows * cols };
        let assumed =
            fill(&mut keys, mapping, &readings, [rows, cols]).map_err(|wrong| wrong.in_file(map))?;
        let json = Value::Object(keys).to_string();
        let rig = Rig::from_json(&json)
            .map_err(|source| ImportError::Rig { path: map.to_owned(), source: Box::new(source) })?;
        Ok(CompleteRig { json: rig.to_json(), rig, assumed })
    }
}

/// Asks for what no reading shows.
fn asked(keys: &Map<String, Value>) -> Result<(), Wrong> {
    let missing = |path: &str, what: &str| wrong(format!("rig.{path}"), format!("missing: {what}"));
    let has = |path: &str| {
        let mut keys_in = path.split('.');
        let first = keys_in.next().and_then(|key| keys.get(key));
        keys_in.try_fold(first?, |value, key| value.get(key))
    };
    for (path, what) in [
        ("name", "write the name of your rig"),
        ("array.rows", "write the number of rows of the array"),
        ("array.cols", "write the number of elements in a row"),
        ("array.element_mm", "write the sides of one element along x and y, such as [1.8, 1.8]"),
        ("array.full_scale_counts", "write the greatest reading of the converter, such as 4095 for 12 bits"),
        (
            "registration.origin_mm",
            "write where the array's first corner lies in the stage's coordinates, about: [x, y]; a calibration finds it better",
        ),
        ("covering.thickness_mm", "write the thickness of the covering"),
        ("indenter", "write the name of the tool on the stage"),
        (
            "indenters",
            "describe the tool: [rig.indenters.NAME] with shape = \"cylinder\" and diameter_mm = 1.0, say",
        ),
    ] {
        if has(path).is_none() {
            return Err(missing(path, what));
        }
    }
    if has("array.pitch_mm").is_none()
        && (has("array.col_centres_mm").is_none() || has("array.row_centres_mm").is_none())
    {
        let what = "write the distance of element centres along x and y, such as [2.0, 2.0], or col_centres_mm and row_centres_mm";
        return Err(missing("array.pitch_mm", what));
    }
    Ok(())
}

/// Fills in what readings show; returns what was assumed.
fn fill(
    keys: &mut Map<String, Value>,
    mapping: &Mapping,
    readings: &Readings<'_>,
    [rows, cols]: [usize; 2],
) -> Result<Vec<String>, Wrong> {
    let mut assumed = Vec::new();
    keys.entry("schema").or_insert_with(|| SCHEMA.into());
    keys.entry("simulated").or_insert(false.into());
    let array = keys.get_mut("array").and_then(Value::as_object_mut);
    let array = array.ok_or_else(|| wrong("rig.array", "a table"))?;
    array.entry("name").or_insert_with(|| "imported".into());
    if let Some(pitch) = array.remove("pitch_mm") {
        let [x, y] = pair(&pitch).ok_or_else(|| wrong("rig.array.pitch_mm", "[x, y] in mm"))?;
        let centres = |count: usize, pitch_mm: f64| {
            (0..count).map(|at| (at as f64 + 0.5) * pitch_mm).collect::<Vec<_>>()
        };
        array.entry("col_centres_mm").or_insert_with(|| json!(centres(cols, x)));
        array.entry("row_centres_mm").or_insert_with(|| json!(centres(rows, y)));
    }
    if !array.contains_key("rate_hz") {
        let rate_hz = readings
            .rate_hz()
            .ok_or_else(|| wrong("rig.array.rate_hz", "missing: write how many frames a second has"))?;
        assumed.push(format!("rate_hz = {rate_hz:.3}, from the times"));
        array.insert("rate_hz".to_owned(), rate_hz.into());
    }
    if !array.contains_key("step_counts") {
        if !readings.are_whole() {
            return Err(wrong(
                "rig.array.step_counts",
                "missing: readings are no whole numbers; write the step of the converter",
            ));
        }
        assumed.push("step_counts = 1, because every reading is a whole number".to_owned());
        array.insert("step_counts".to_owned(), 1.0.into());
    }
    if !array.contains_key("least_counts") && (mapping.counts.is_subtracted || readings.are_signed()) {
        let full_scale_counts = array["full_scale_counts"].as_f64().unwrap_or(0.0);
        assumed.push("least_counts = -full_scale_counts, because readings may be below 0".to_owned());
        array.insert("least_counts".to_owned(), (-full_scale_counts).into());
    }
    let registration = keys.get_mut("registration").and_then(Value::as_object_mut);
    registration
        .ok_or_else(|| wrong("rig.registration", "a table"))?
        .entry("rotation_deg")
        .or_insert(0.0.into());
    if !keys.contains_key("sensitivity_reference") {
        let reference =
            json!({ "indenter": keys["indenter"], "covering_mm": keys["covering"]["thickness_mm"] });
        keys.insert("sensitivity_reference".to_owned(), reference);
    }
    if !keys.contains_key("psf") {
        let [sigma_intercept_mm, sigma_per_mm] = PAPER_PSF;
        assumed.push("psf, from the paper's Eq. 4: a calibration finds your own".to_owned());
        keys.insert(
            "psf".to_owned(),
            json!({ "sigma_intercept_mm": sigma_intercept_mm, "sigma_per_mm": sigma_per_mm }),
        );
    }
    if mapping.counts.is_subtracted {
        keys.insert("baseline_counts".to_owned(), 0.0.into());
    } else if !keys.contains_key("baseline_counts") {
        let rest = readings.rest_counts().ok_or_else(|| {
            wrong(
                "rig.baseline_counts",
                "missing: the tip never stands above the covering; write what an untouched array reads",
            )
        })?;
        assumed.push("baseline_counts, the median of each element at rest".to_owned());
        keys.insert("baseline_counts".to_owned(), json!(rest));
    }
    if !keys.contains_key("sensitivity_counts_per_mm") {
        let baseline = numbers(&keys["baseline_counts"], readings.elements);
        let sensitivity = readings.counts_per_mm(&baseline).ok_or_else(|| {
            wrong(
                "rig.sensitivity_counts_per_mm",
                "missing: no press is seen; write about how many counts 1 mm gives",
            )
        })?;
        assumed.push(format!("sensitivity_counts_per_mm = {sensitivity:.1}, from the deepest frames: a calibration finds each element's"));
        keys.insert("sensitivity_counts_per_mm".to_owned(), sensitivity.into());
    }
    Ok(assumed)
}

fn pair(value: &Value) -> Option<[f64; 2]> {
    match value.as_array().map(Vec::as_slice) {
        Some([x, y]) => Some([x.as_f64()?, y.as_f64()?]),
        _ => value.as_f64().map(|both| [both; 2]),
    }
}

/// One number for all elements, or one each.
fn numbers(value: &Value, elements: usize) -> Vec<f64> {
    match value.as_array() {
        Some(values) => values.iter().map(|value| value.as_f64().unwrap_or(0.0)).collect(),
        None => vec![value.as_f64().unwrap_or(0.0); elements],
    }
}

/// What the readings show of the rig.
struct Readings<'a> {
    runs: &'a [Run],
    elements: usize,
}

impl Readings<'_> {
    /// Frames per second, from the median interval.
    fn rate_hz(&self) -> Option<f64> {
        let intervals =
            self.runs.iter().flat_map(|run| run.t_ns.windows(2).map(|pair| (pair[1] - pair[0]) as f64));
        median(intervals.collect()).map(|ns| 1e9 / ns)
    }

    fn are_whole(&self) -> bool {
        self.runs.iter().flat_map(|run| &run.counts).all(|count| count.fract() == 0.0)
    }

    fn are_signed(&self) -> bool {
        self.runs.iter().flat_map(|run| &run.counts).any(|count| *count < 0.0)
    }

    /// The median of each element while nothing touches.
    fn rest_counts(&self) -> Option<Vec<f64>> {
        let at_rest = |run: &Run, frame: usize| match run.phases[frame].0 {
            Phase::Idle => true,
            Phase::Approach | Phase::Retract => run.position_mm[frame][2] >= CLEAR_MM,
            Phase::Load | Phase::Hold | Phase::Unload => false,
        };
        let element = |element: usize| {
            let of_run = |run: &Run| {
                let rests = (0..run.t_ns.len()).filter(|frame| at_rest(run, *frame));
                rests.map(|frame| f64::from(run.counts[frame * self.elements + element])).collect::<Vec<_>>()
            };
            median(self.runs.iter().flat_map(of_run).collect())
        };
        (0..self.elements).map(element).collect()
    }

    /// The greatest change of an element over the depth at the deepest frame of each press; the median of the presses.
    fn counts_per_mm(&self, baseline: &[f64]) -> Option<f64> {
        let mut slopes = Vec::new();
        for run in self.runs {
            let mut deepest: BTreeMap<i32, usize> = BTreeMap::new();
            let pressed = |frame: &usize| run.phases[*frame].1 >= 0 && run.position_mm[*frame][2] < 0.0;
            for frame in (0..run.t_ns.len()).filter(pressed) {
                let known = deepest.entry(run.phases[frame].1).or_insert(frame);
                if run.position_mm[frame][2] < run.position_mm[*known][2] {
                    *known = frame;
                }
            }
            for frame in deepest.into_values() {
                let counts = &run.counts[frame * self.elements..(frame + 1) * self.elements];
                let changes = counts.iter().zip(baseline).map(|(count, rest)| f64::from(*count) - rest);
                let greatest = changes.max_by(|a, b| a.abs().total_cmp(&b.abs()));
                slopes.extend(greatest.map(|change| -change / run.position_mm[frame][2]));
            }
        }
        median(slopes).filter(|slope| *slope != 0.0)
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
