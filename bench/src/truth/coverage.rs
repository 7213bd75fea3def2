//! Results over all rigs.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::{Result, ensure};

use super::Recovery;

/// 0.975 quantile of the standard normal distribution.
const Z_95: f64 = 1.96;
/// From so many rigs on, the share of intervals that hold the truth is judged.
const RIGS_LEAST: u32 = 100;

/// How often the intervals of all quantities hold the truth, and how often faults are found.
#[derive(Debug, Clone, Default)]
pub struct Coverages {
    /// By quantity.
    pub quantities: BTreeMap<String, Coverage>,
    /// Rigs.
    pub rigs: u32,
    /// Faulty elements.
    pub planted: usize,
    /// Faulty elements that were not found, or called by a wrong name.
    pub missed: usize,
    /// Sound elements that were called faulty.
    pub accused: usize,
}

/// Intervals of one quantity.
#[derive(Debug, Clone, Copy, Default)]
pub struct Coverage {
    intervals: u32,
    covering: u32,
    sum: f64,
    squares: f64,
    /// Greatest error, in units of the standard error.
    worst: f64,
}

impl Coverage {
    /// Share of the 95 % intervals that hold the truth.
    pub fn share(&self) -> f64 {
        f64::from(self.covering) / f64::from(self.intervals)
    }

    fn add(&mut self, error: f64) {
        self.intervals += 1;
        self.covering += u32::from(error.abs() <= Z_95);
        self.sum += error;
        self.squares += error * error;
        self.worst = self.worst.max(error.abs());
    }
}

impl Coverages {
    /// Counts the results of all rigs.
    pub fn of(recoveries: &[Recovery]) -> Self {
        let mut all = Self::default();
        for Recovery { errors, planted, missed, accused } in recoveries {
            for (name, error) in errors {
                all.quantities.entry(name.clone()).or_default().add(*error);
            }
            all.rigs += 1;
            all.planted += planted;
            all.missed += missed;
            all.accused += accused;
        }
        all
    }

    /// # Errors
    /// If the result is worse than chance allows.
    pub fn check(&self) -> Result<()> {
        let Self { rigs, missed, accused, .. } = self;
        ensure!(
            (*missed, *accused) == (0, 0),
            "{missed} faults missed, {accused} sound elements called faulty"
        );
        for (name, row) in &self.quantities {
            ensure!(row.worst < 5.5, "{name}: {} standard errors off", row.worst);
            ensure!(*rigs < RIGS_LEAST || (0.90..=0.98).contains(&row.share()), "{name}: {:.3}", row.share());
        }
        Ok(())
    }
}

impl fmt::Display for Coverages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<18}{:>10}{:>10}{:>10}{:>10}{:>10}",
            "quantity", "intervals", "covered", "bias", "scatter", "worst"
        )?;
        for (name, row) in &self.quantities {
            let count = f64::from(row.intervals);
            writeln!(
                f,
                "{name:<18}{:>10}{:>9.1}%{:>10.2}{:>10.2}{:>10.2}",
                row.intervals,
                100.0 * row.share(),
                row.sum / count,
                (row.squares / count).sqrt(),
                row.worst
            )?;
        }
        writeln!(f, "bias, scatter and worst are in units of the standard error")?;
        let Self { planted, missed, accused, .. } = self;
        write!(f, "{planted} faults: {missed} missed or misnamed; {accused} sound elements called faulty")
    }
}
