//! The runs of a lab's file: the mapping applied to its columns.

use tactus_schema::table::Phase;

use crate::{
    ImportError,
    columns::{Column, Columns},
    mapping::{Axis, Mapping, Phases, Time},
    phases,
};

/// The frames of one run, in order of time.
#[derive(Debug, Default)]
pub(crate) struct Run {
    pub(crate) id: String,
    pub(crate) t_ns: Vec<i64>,
    pub(crate) position_mm: Vec<[f64; 3]>,
    pub(crate) phases: Vec<(Phase, i32)>,
    /// Frame after frame, row-major.
    pub(crate) counts: Vec<f32>,
    /// Where the file says them.
    pub(crate) covering_mm: Option<Vec<f64>>,
    pub(crate) indenter: Option<Vec<String>>,
    pub(crate) temperature_c: Option<Vec<f64>>,
}

/// The runs of a file, and how many of its rows were left out.
pub(crate) struct FileRuns {
    pub(crate) runs: Vec<Run>,
    pub(crate) left_out: usize,
}

/// A number of each row by its column, or one for all.
enum Source<'a> {
    Column { name: &'a str, numbers: &'a [f64], scale: f64, origin: f64 },
    Same(f64),
}

impl Source<'_> {
    fn at(&self, row: usize) -> f64 {
        match self {
            Self::Column { numbers, scale, origin, .. } => (numbers[row] - origin) * scale,
            Self::Same(value) => *value,
        }
    }
}

/// When a row was sampled.
enum When<'a> {
    Column(Source<'a>),
    /// In even steps.
    Rate {
        hz: f64,
    },
}

/// What the mapping finds in a file.
struct Mapped<'a> {
    columns: &'a Columns,
    mapping: &'a Mapping,
    axes: Vec<Source<'a>>,
    time: When<'a>,
    elements: Vec<&'a [f64]>,
    covering: Option<Source<'a>>,
    temperature: Option<Source<'a>>,
}

/// Divides a file into its runs; `elements` are the names of the columns with the counts, row-major.
pub(crate) fn of_file(
    columns: &Columns,
    mapping: &Mapping,
    elements: &[String],
) -> Result<FileRuns, ImportError> {
    let mapped = Mapped::new(columns, mapping, elements)?;
    let kept: Vec<usize> = (0..columns.rows()).filter(|row| mapped.is_complete(*row)).collect();
    let stem = columns.path().file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let ids = mapping.run.as_ref().map(|name| columns.get("run.column", name)).transpose()?;
    let mut runs: Vec<Run> = Vec::new();
    let mut start = 0;
    while start < kept.len() {
        let id_of = |row: usize| ids.map_or_else(|| stem.clone(), |ids| ids.text(row));
        let id = id_of(kept[start]);
        let end = kept[start..]
            .iter()
            .position(|row| id_of(*row) != id)
            .map_or(kept.len(), |length| start + length);
        if runs.iter().any(|run| run.id == id) {
            let name = mapping.run.as_deref().unwrap_or_default();
            let problem = format!("run {id:?} goes on after another: rows of one run stand together");
            return Err(columns.fault(kept[start], name, problem));
        }
        runs.push(mapped.run(id, &kept[start..end])?);
        start = end;
    }
    if runs.is_empty() {
        let problem = "no row has every number that the mapping asks for".to_owned();
        return Err(ImportError::File { path: columns.path().to_owned(), problem });
    }
    Ok(FileRuns { runs, left_out: columns.rows() - kept.len() })
}

impl<'a> Mapped<'a> {
    fn new(columns: &'a Columns, mapping: &'a Mapping, elements: &[String]) -> Result<Self, ImportError> {
        let numbers = |key: &str, name: &str| {
            if mapping.form.skip_incomplete {
                columns.get(key, name).map(Column::numbers)
            } else {
                columns.numbers(key, name)
            }
        };
        let column = |key: &str, name: &'a String, scale, origin| {
            Ok::<_, ImportError>(Source::Column { name, numbers: numbers(key, name)?, scale, origin })
        };
        let axis = |(axis, key): (&'a Axis, &str)| match axis {
            Axis::At { mm } => Ok(Source::Same(*mm)),
            Axis::Column { column: name, mm_per_unit, origin } => {
                column(&format!("{key}.column"), name, *mm_per_unit, *origin)
            }
        };
        Ok(Self {
            columns,
            mapping,
            axes: mapping.axes.iter().zip(["x", "y", "z"]).map(axis).collect::<Result<_, _>>()?,
            time: match &mapping.time {
                Time::Rate { hz } => When::Rate { hz: *hz },
                Time::Column { column: name, ns_per_unit } => {
                    // Relative to the first row: nanoseconds since 1970 have more digits than a number keeps.
                    let origin = numbers("time.column", name)?.iter().copied().find(|time| time.is_finite());
                    When::Column(column("time.column", name, *ns_per_unit, origin.unwrap_or(0.0))?)
                }
            },
            elements: elements
                .iter()
                .map(|name| numbers("counts.columns", name))
                .collect::<Result<_, _>>()?,
            covering: match &mapping.covering {
                None => None,
                Some((name, mm)) => Some(column("covering.column", name, *mm, 0.0)?),
            },
            temperature: match &mapping.temperature {
                None => None,
                Some(name) => Some(column("temperature_c.column", name, 1.0, 0.0)?),
            },
        })
    }

    /// True if every number is there.
    fn is_complete(&self, row: usize) -> bool {
        let time = match &self.time {
            When::Column(time) => Some(time),
            When::Rate { .. } => None,
        };
        let others = [time, self.covering.as_ref(), self.temperature.as_ref()].into_iter().flatten();
        self.axes.iter().chain(others).all(|source| source.at(row).is_finite())
            && self.elements.iter().all(|numbers| numbers[row].is_finite())
    }

    fn run(&self, id: String, rows: &[usize]) -> Result<Run, ImportError> {
        let Self { columns, mapping, .. } = self;
        let mut run = Run { id, ..Run::default() };
        for row in rows {
            let time = match &self.time {
                When::Column(time) => nanoseconds(time.at(*row)),
                // Rows that were left out took their time, too.
                When::Rate { hz } => nanoseconds((row - rows[0]) as f64 * 1e9 / hz),
            };
            if let (Some(last), When::Column(Source::Column { name, .. })) = (run.t_ns.last(), &self.time)
                && time <= *last
            {
                let problem =
                    "the time does not rise: sort the rows, or name the column of the runs under [run]";
                return Err(columns.fault(*row, name, problem));
            }
            run.t_ns.push(time);
            run.position_mm.push([self.axes[0].at(*row), self.axes[1].at(*row), self.axes[2].at(*row)]);
            #[expect(clippy::cast_possible_truncation, reason = "the table's counts have 32 bits")]
            run.counts.extend(self.elements.iter().map(|numbers| numbers[*row] as f32));
        }
        let all = |source: &Option<Source<'_>>| {
            source.as_ref().map(|source| rows.iter().map(|row| source.at(*row)).collect::<Vec<_>>())
        };
        run.covering_mm = all(&self.covering);
        run.temperature_c = all(&self.temperature);
        if let Some(name) = &mapping.indenter {
            let column = columns.get("indenter.column", name)?;
            run.indenter = Some(rows.iter().map(|row| column.text(*row)).collect());
        }
        run.phases = self.phases(&run, rows)?;
        Ok(run)
    }

    fn phases(&self, run: &Run, rows: &[usize]) -> Result<Vec<(Phase, i32)>, ImportError> {
        let (phase, press) = match &self.mapping.phases {
            Phases::Path { still_mm, touch_mm } => {
                return Ok(phases::of_path(&run.t_ns, &run.position_mm, *still_mm, *touch_mm));
            }
            Phases::Column { phase, press } => (phase, press),
        };
        let words = self.columns.get("phases.column", phase)?;
        let found = rows.iter().map(|row| {
            let word = words.text(*row);
            Phase::from_name(&word).ok_or_else(|| {
                let known = Phase::ALL.map(Phase::name).join(", ");
                let problem =
                    format!("{word:?} is no phase ({known}); without [phases] they are found from the path");
                self.columns.fault(*row, phase, problem)
            })
        });
        let found: Vec<Phase> = found.collect::<Result<_, _>>()?;
        let indices = match press {
            None => phases::presses(&found),
            Some(press) => {
                let numbers = self.columns.numbers("phases.press", press)?;
                let index = |row: &usize| {
                    let number = numbers[*row];
                    #[expect(clippy::cast_possible_truncation, reason = "checked")]
                    let index = number as i32;
                    let is_index = f64::from(index).to_bits() == (number + 0.0).to_bits() && index >= -1;
                    is_index.then_some(index).ok_or_else(|| {
                        self.columns.fault(
                            *row,
                            press,
                            format!("{number}: a press counts from 0; -1 is none"),
                        )
                    })
                };
                rows.iter().map(index).collect::<Result<_, _>>()?
            }
        };
        Ok(found.into_iter().zip(indices).collect())
    }
}

fn nanoseconds(ns: f64) -> i64 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a time that does not fit is at the end of the range, and refused"
    )]
    let whole = ns.round() as i64;
    whole
}
