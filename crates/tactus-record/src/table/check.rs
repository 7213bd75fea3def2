//! Checks values against the contract.

use std::{collections::BTreeSet, path::Path};

use tactus_schema::{Rig, table::RowView};

use super::TableError;

/// Checks rows in the table's order.
pub(crate) struct Checker {
    elements: usize,
    indenters: BTreeSet<String>,
    run: Option<String>,
    finished_runs: BTreeSet<String>,
    last_t_ns: i64,
}

/// What is wrong with a row.
#[derive(Debug, PartialEq)]
pub(crate) struct RowFault {
    column: &'static str,
    problem: String,
}

impl Checker {
    pub(crate) fn new(rig: &Rig) -> Self {
        Self {
            elements: rig.array.elements(),
            indenters: rig.indenters.keys().cloned().collect(),
            run: None,
            finished_runs: BTreeSet::new(),
            last_t_ns: i64::MIN,
        }
    }

    pub(crate) fn check(&mut self, row: &RowView<'_>) -> Result<(), RowFault> {
        self.order(row)?;
        if row.press < -1 {
            return Err(fault(
                "press",
                format!("{}; a press index from 0, or -1 outside a press", row.press),
            ));
        }
        for (column, value) in ["x_mm", "y_mm", "z_mm"].into_iter().zip(row.position_mm) {
            finite(column, value)?;
        }
        if finite("covering_mm", row.covering_mm)? <= 0.0 {
            return Err(fault("covering_mm", format!("{}; a thickness above 0", row.covering_mm)));
        }
        if !self.indenters.contains(row.indenter) {
            let known: Vec<&str> = self.indenters.iter().map(String::as_str).collect();
            let problem = format!("{:?}; the rig has {}", row.indenter, known.join(", "));
            return Err(fault("indenter", problem));
        }
        if let Some(temperature_c) = row.temperature_c {
            finite("temperature_c", temperature_c)?;
        }
        if row.counts.len() != self.elements {
            let problem =
                format!("{} values; the rig's array has {} elements", row.counts.len(), self.elements);
            return Err(fault("counts", problem));
        }
        match row.counts.iter().position(|count| !count.is_finite()) {
            Some(element) => Err(fault("counts", format!("element {element} is {}", row.counts[element]))),
            None => Ok(()),
        }
    }

    fn order(&mut self, row: &RowView<'_>) -> Result<(), RowFault> {
        if self.run.as_deref() != Some(row.run) {
            if self.finished_runs.contains(row.run) {
                let problem =
                    format!("{:?} again after another run; rows of one run are contiguous", row.run);
                return Err(fault("run", problem));
            }
            self.finished_runs.extend(self.run.replace(row.run.to_owned()));
        } else if row.t_ns < self.last_t_ns {
            let problem = format!("{} after {}; time rises within a run", row.t_ns, self.last_t_ns);
            return Err(fault("t_ns", problem));
        }
        self.last_t_ns = row.t_ns;
        Ok(())
    }
}

impl RowFault {
    /// The fault of a row of a file.
    pub(crate) fn at(self, path: &Path, row: u64) -> TableError {
        TableError::Value { path: path.to_owned(), row, column: self.column, problem: self.problem }
    }
}

fn finite(column: &'static str, value: f64) -> Result<f64, RowFault> {
    if value.is_finite() { Ok(value) } else { Err(fault(column, format!("{value}; a finite number"))) }
}

fn fault(column: &'static str, problem: String) -> RowFault {
    RowFault { column, problem }
}
