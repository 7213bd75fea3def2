//! The mapping file, `tactus.mapping/1`: which column of a lab's file is what.

use std::{fmt, fs, path::Path};

use serde::Deserialize;

use crate::ImportError;

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.mapping/1";

/// Where the number of an element stands in the pattern of its column's name.
pub(crate) const NUMBER: &str = "{n}";

/// A checked mapping.
#[derive(Debug, Clone)]
pub(crate) struct Mapping {
    pub(crate) form: FileForm,
    pub(crate) time: Time,
    /// x, y, z in the robot frame; z = 0 at the covering's surface.
    pub(crate) axes: [Axis; 3],
    pub(crate) counts: Counts,
    pub(crate) run: Option<String>,
    pub(crate) phases: Phases,
    /// Columns of the covering's thickness and its mm per unit, of the tool, and of the temperature.
    pub(crate) covering: Option<(String, f64)>,
    pub(crate) indenter: Option<String>,
    pub(crate) temperature: Option<String>,
    pub(crate) rig: Description,
}

/// How the file is written.
#[derive(Debug, Clone)]
pub(crate) struct FileForm {
    pub(crate) delimiter: u8,
    pub(crate) decimal: char,
    pub(crate) comment: Option<u8>,
    pub(crate) topic: Option<String>,
    pub(crate) skip_incomplete: bool,
}

/// When a row was sampled.
#[derive(Debug, Clone)]
pub(crate) enum Time {
    Column { column: String, ns_per_unit: f64 },
    Rate { hz: f64 },
}

/// Where the tip is along an axis.
#[derive(Debug, Clone)]
pub(crate) enum Axis {
    Column { column: String, mm_per_unit: f64, origin: f64 },
    At { mm: f64 },
}

/// The readings.
#[derive(Debug, Clone)]
pub(crate) struct Counts {
    pub(crate) columns: ElementColumns,
    /// True if the reading at rest was subtracted.
    pub(crate) is_subtracted: bool,
}

/// The columns of the elements.
#[derive(Debug, Clone)]
pub(crate) enum ElementColumns {
    /// Row-major.
    Listed(Vec<String>),
    /// By a number from `first` on, in an order.
    Numbered { pattern: String, first: usize, order: Order },
}

/// In which order the elements are numbered.
#[derive(Debug, Clone)]
pub(crate) enum Order {
    RowMajor,
    ColumnMajor,
    /// The number of each element, row-major.
    Listed(Vec<usize>),
}

/// What the stage was doing.
#[derive(Debug, Clone)]
pub(crate) enum Phases {
    /// Found from its path.
    Path { still_mm: f64, touch_mm: Option<f64> },
    /// As the file says.
    Column { phase: String, press: Option<String> },
}

/// The rig: from a rig file, or the table of the mapping.
#[derive(Debug, Clone)]
pub(crate) enum Description {
    File(String),
    Table(toml::Table),
}

/// A stage's positions are told within this distance.
const STILL_MM: f64 = 0.005;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMapping {
    schema: Option<String>,
    #[serde(default)]
    file: RawFile,
    time: Option<RawTime>,
    x: Option<RawAxis>,
    y: Option<RawAxis>,
    z: Option<RawAxis>,
    counts: Option<RawCounts>,
    run: Option<RawColumn>,
    #[serde(default)]
    phases: RawPhases,
    covering: Option<RawLength>,
    indenter: Option<RawColumn>,
    temperature_c: Option<RawColumn>,
    rig: Option<toml::Value>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    delimiter: Option<char>,
    decimal: Option<char>,
    comment: Option<char>,
    topic: Option<String>,
    #[serde(default)]
    skip_incomplete: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTime {
    column: Option<String>,
    unit: Option<TimeUnit>,
    rate_hz: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAxis {
    column: Option<String>,
    unit: Option<LengthUnit>,
    direction: Option<f64>,
    origin: Option<f64>,
    at_mm: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCounts {
    columns: toml::Value,
    first: Option<usize>,
    order: Option<toml::Value>,
    zero: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawColumn {
    column: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLength {
    column: String,
    unit: LengthUnit,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPhases {
    column: Option<String>,
    press: Option<String>,
    still_mm: Option<f64>,
    touch_mm: Option<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TimeUnit {
    S,
    Ms,
    Us,
    Ns,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum LengthUnit {
    M,
    Mm,
    Um,
    Inch,
}

impl TimeUnit {
    const fn ns(self) -> f64 {
        match self {
            Self::S => 1e9,
            Self::Ms => 1e6,
            Self::Us => 1e3,
            Self::Ns => 1.0,
        }
    }
}

impl LengthUnit {
    const fn mm(self) -> f64 {
        match self {
            Self::M => 1e3,
            Self::Mm => 1.0,
            Self::Um => 1e-3,
            Self::Inch => 25.4,
        }
    }
}

/// A key of the mapping that is missing or wrong, and what to write.
pub(crate) struct Wrong {
    key: String,
    problem: String,
}

pub(crate) fn wrong(key: impl Into<String>, problem: impl fmt::Display) -> Wrong {
    Wrong { key: key.into(), problem: problem.to_string() }
}

impl Wrong {
    pub(crate) fn in_file(self, path: &Path) -> ImportError {
        ImportError::Key { path: path.to_owned(), key: self.key, problem: self.problem }
    }
}

impl Default for FileForm {
    fn default() -> Self {
        Self { delimiter: b',', decimal: '.', comment: Some(b'#'), topic: None, skip_incomplete: false }
    }
}

impl Mapping {
    pub(crate) fn read(path: &Path) -> Result<Self, ImportError> {
        let text = fs::read_to_string(path).map_err(|source| ImportError::Io {
            action: "read",
            path: path.to_owned(),
            source,
        })?;
        let raw: RawMapping = toml::from_str(&text)
            .map_err(|source| ImportError::Toml { path: path.to_owned(), source: Box::new(source) })?;
        raw.check().map_err(|wrong| wrong.in_file(path))
    }
}

impl RawMapping {
    fn check(self) -> Result<Mapping, Wrong> {
        if self.schema.as_deref() != Some(SCHEMA) {
            return Err(wrong("schema", format!("write schema = {SCHEMA:?}")));
        }
        let counts = self.counts.ok_or_else(|| {
            wrong("counts", "missing: write [counts] with columns = \"ch{n}\", first = 0, order = \"row-major\", zero = \"raw\"")
        })?;
        let time = self.time.ok_or_else(|| {
            wrong("time", "missing: write [time] with column = \"...\" and unit = \"s\", or with rate_hz = 30.0 if no column says when")
        })?;
        let axis = |key: &str, axis: Option<RawAxis>| {
            let ask = format!(
                "missing: write [{key}] with column = \"...\" and unit = \"mm\", or with at_mm = 0.0 if it never changed"
            );
            axis.ok_or_else(|| wrong(key, ask))?.check(key)
        };
        Ok(Mapping {
            form: self.file.check()?,
            time: time.check()?,
            axes: [axis("x", self.x)?, axis("y", self.y)?, axis("z", self.z)?],
            counts: counts.check()?,
            run: self.run.map(|run| run.column),
            phases: self.phases.check()?,
            covering: self.covering.map(|covering| (covering.column, covering.unit.mm())),
            indenter: self.indenter.map(|indenter| indenter.column),
            temperature: self.temperature_c.map(|temperature| temperature.column),
            rig: match self.rig {
                Some(toml::Value::String(path)) => Description::File(path),
                Some(toml::Value::Table(table)) => Description::Table(table),
                _ => {
                    return Err(wrong(
                        "rig",
                        "missing: write rig = \"my-rig.toml\", or a table [rig] with the keys of a rig file",
                    ));
                }
            },
        })
    }
}

impl RawFile {
    fn check(self) -> Result<FileForm, Wrong> {
        let byte = |key: &str, letter: Option<char>, default| match letter {
            None => Ok(default),
            Some(letter) => {
                u8::try_from(letter).map_err(|_| wrong(key, format!("{letter:?}: one ASCII letter")))
            }
        };
        let (delimiter, decimal) =
            (byte("file.delimiter", self.delimiter, b',')?, self.decimal.unwrap_or('.'));
        if char::from(delimiter) == decimal {
            return Err(wrong("file.decimal", format!("{decimal:?} also divides the columns")));
        }
        let comment = byte("file.comment", self.comment, b'#')?;
        let Self { topic, skip_incomplete, .. } = self;
        Ok(FileForm { delimiter, decimal, comment: Some(comment), topic, skip_incomplete })
    }
}

impl RawTime {
    fn check(self) -> Result<Time, Wrong> {
        match self {
            Self { column: Some(column), unit: Some(unit), rate_hz: None } => {
                Ok(Time::Column { column, ns_per_unit: unit.ns() })
            }
            Self { column: None, unit: None, rate_hz: Some(hz) } if hz > 0.0 && hz.is_finite() => {
                Ok(Time::Rate { hz })
            }
            _ => Err(wrong(
                "time",
                "either column = \"...\" and unit = \"s\", \"ms\", \"us\" or \"ns\", or rate_hz = 30.0",
            )),
        }
    }
}

impl RawAxis {
    fn check(self, key: &str) -> Result<Axis, Wrong> {
        let Self { column, unit, direction, origin, at_mm } = self;
        let column = match (column, at_mm) {
            (None, Some(mm)) if key != "z" && unit.is_none() && direction.is_none() && origin.is_none() => {
                return Ok(Axis::At { mm });
            }
            (Some(column), None) => column,
            _ if key == "z" => return Err(wrong("z", "column = \"...\": a press has depths")),
            _ => return Err(wrong(key, "either column = \"...\" with its unit, or at_mm = 0.0 alone")),
        };
        let ask = |name: &str, what: &str| wrong(format!("{key}.{name}"), format!("missing: {what}"));
        let unit = unit.ok_or_else(|| ask("unit", "write \"mm\", \"um\", \"m\" or \"inch\""))?;
        let is_z = key == "z";
        let direction = match direction {
            Some(direction) if direction.abs().to_bits() == 1.0_f64.to_bits() => direction,
            Some(other) => return Err(wrong(format!("{key}.direction"), format!("{other}: 1 or -1"))),
            None if is_z => {
                return Err(ask(
                    "direction",
                    "write 1 if the column grows upwards, -1 if it grows with the depth",
                ));
            }
            None => 1.0,
        };
        let origin = match origin {
            Some(origin) => origin,
            None if is_z => {
                return Err(ask(
                    "origin",
                    "write what the column says where the tip just touches the covering, in its unit",
                ));
            }
            None => 0.0,
        };
        Ok(Axis::Column { column, mm_per_unit: direction * unit.mm(), origin })
    }
}

impl RawCounts {
    fn check(self) -> Result<Counts, Wrong> {
        let columns = match (self.columns, self.first, self.order) {
            (toml::Value::String(pattern), Some(first), Some(order)) if pattern.contains(NUMBER) => {
                ElementColumns::Numbered { pattern, first, order: Order::of(&order)? }
            }
            (toml::Value::String(pattern), first, _) if pattern.contains(NUMBER) => {
                let key = if first.is_none() { "counts.first" } else { "counts.order" };
                let ask = if first.is_none() {
                    "missing: write the number of the first element, such as 0 or 1"
                } else {
                    "missing: write \"row-major\" (along a row first), \"column-major\", or the list of numbers, row by row"
                };
                return Err(wrong(key, ask));
            }
            (toml::Value::Array(names), None, None) => {
                let name = |name: toml::Value| name.as_str().map(str::to_owned);
                let names: Option<Vec<_>> = names.into_iter().map(name).collect();
                ElementColumns::Listed(
                    names.ok_or_else(|| wrong("counts.columns", "a list of names, row by row"))?,
                )
            }
            _ => {
                let ask = "either a name with {n} for the element's number, with first and order, or a list of names alone";
                return Err(wrong("counts.columns", ask));
            }
        };
        let is_subtracted = match self.zero.as_deref() {
            Some("raw") => false,
            Some("subtracted") => true,
            _ => {
                let ask = "write \"raw\" if the counts are as the sensor gave them, \"subtracted\" if the reading at rest was taken off";
                return Err(wrong("counts.zero", ask));
            }
        };
        Ok(Counts { columns, is_subtracted })
    }
}

impl Order {
    fn of(value: &toml::Value) -> Result<Self, Wrong> {
        let number = |one: &toml::Value| one.as_integer().and_then(|one| usize::try_from(one).ok());
        match (value.as_str(), value.as_array()) {
            (Some("row-major"), _) => Ok(Self::RowMajor),
            (Some("column-major"), _) => Ok(Self::ColumnMajor),
            (_, Some(numbers)) if numbers.iter().all(|one| number(one).is_some()) => {
                Ok(Self::Listed(numbers.iter().filter_map(number).collect()))
            }
            _ => Err(wrong("counts.order", "\"row-major\", \"column-major\", or a list of numbers")),
        }
    }
}

impl RawPhases {
    fn check(self) -> Result<Phases, Wrong> {
        match self {
            Self { column: Some(phase), press, still_mm: None, touch_mm: None } => {
                Ok(Phases::Column { phase, press })
            }
            Self { column: None, press: None, still_mm, touch_mm } => {
                let still_mm = still_mm.unwrap_or(STILL_MM);
                for (key, mm) in [("still_mm", Some(still_mm)), ("touch_mm", touch_mm)] {
                    if mm.is_some_and(|mm| !(mm > 0.0 && mm.is_finite())) {
                        return Err(wrong(format!("phases.{key}"), "a length above 0"));
                    }
                }
                Ok(Phases::Path { still_mm, touch_mm })
            }
            _ => Err(wrong(
                "phases",
                "either column = \"...\" (and press = \"...\"), or still_mm and touch_mm",
            )),
        }
    }
}

impl ElementColumns {
    /// The columns of an array's elements, row-major.
    pub(crate) fn of_array(&self, rows: usize, cols: usize) -> Result<Vec<String>, Wrong> {
        let elements = rows * cols;
        let (pattern, first, order) = match self {
            Self::Listed(names) if names.len() == elements => return Ok(names.clone()),
            Self::Listed(names) => {
                return Err(wrong(
                    "counts.columns",
                    format!("{} names for {elements} elements", names.len()),
                ));
            }
            Self::Numbered { pattern, first, order } => (pattern, first, order),
        };
        let numbers: Vec<usize> = match order {
            Order::RowMajor => (0..elements).map(|element| first + element).collect(),
            Order::ColumnMajor => {
                (0..elements).map(|element| first + (element % cols) * rows + element / cols).collect()
            }
            Order::Listed(numbers) if numbers.len() == elements => numbers.clone(),
            Order::Listed(numbers) => {
                return Err(wrong(
                    "counts.order",
                    format!("{} numbers for {elements} elements", numbers.len()),
                ));
            }
        };
        Ok(numbers.into_iter().map(|number| pattern.replace(NUMBER, &number.to_string())).collect())
    }
}
