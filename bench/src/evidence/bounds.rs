//! Below what the slice, and the sample that CI runs, must not fall.

use std::fmt;

use anyhow::{Result, ensure};

use super::campaign::Campaign;
use super::outcome::Outcome;
use super::rate::quantile;

/// What is counted in a run of the slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counts {
    /// Sets without physics in which something is seen, and those that fail.
    pub false_alarms: usize,
    /// Sets of one effect that is named, and nothing else.
    pub exact: usize,
    /// Sets of two effects that are both named.
    pub pairs: usize,
    /// Sets with a wrong name.
    pub wrong: usize,
    /// Sets outside the library that are unexplained and have no name.
    pub unexplained: usize,
    /// Shrink over that of the effect's own fit in sets of one effect, median and fifth percentile. The sample may have no set whose gap is
    /// known well enough.
    pub shrink: Option<[f64; 2]>,
}

/// Bounds of these counts.
///
/// The sets are always the same, so the bounds are what the program does with these, not what it would with a random slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    most_false_alarms: usize,
    least_exact: usize,
    least_pairs: usize,
    most_wrong: usize,
    least_unexplained: usize,
    least_shrink: [f64; 2],
}

impl Counts {
    /// Counts outcomes.
    pub fn of(outcomes: &[Outcome]) -> Self {
        let count = |campaign, is_so: fn(&Outcome) -> bool| {
            outcomes.iter().filter(|set| set.campaign == campaign && is_so(set)).count()
        };
        let named = outcomes.iter().filter(|set| set.campaign == Campaign::Names);
        let shrinks: Vec<f64> = named.filter_map(Outcome::shrink_to_fit_in_report).collect();
        Self {
            false_alarms: count(Campaign::FalseAlarms, |set| set.is_detected() || set.has_failed()),
            exact: count(Campaign::Names, Outcome::is_exact),
            pairs: count(Campaign::Pairs, Outcome::names_all),
            wrong: outcomes
                .iter()
                .filter(|set| set.campaign != Campaign::FalseAlarms && !set.wrong_names().is_empty())
                .count(),
            unexplained: count(Campaign::Outside, Outcome::is_unexplained),
            shrink: quantile(shrinks.clone(), 0.5).zip(quantile(shrinks, 0.05)).map(<[f64; 2]>::from),
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { false_alarms, exact, pairs, wrong, unexplained, shrink } = self;
        write!(
            f,
            "false alarms {false_alarms}, exact {exact}, pairs {pairs}, sets with a wrong name {wrong}, \
             outside unexplained {unexplained}"
        )?;
        match shrink {
            Some([median, fifth]) => write!(f, ", shrink {median:.3}, {fifth:.3}"),
            None => Ok(()),
        }
    }
}

impl Bounds {
    /// Of the slice: 12 sets without physics, 24 with one effect, 4 with two and 6 outside the library. They are what the build of
    /// 2026-11-29 does, so that any set that is lost breaks one.
    pub const SLICE: Self = Self {
        most_false_alarms: 0,
        least_exact: 21,
        least_pairs: 4,
        most_wrong: 2,
        least_unexplained: 4,
        least_shrink: [0.97, 0.95],
    };
    /// Of the sample: 3, 6, 1 and 1 of those. They are what the build of 2026-11-29 does, so that any set that is lost breaks one. In the pair a
    /// third effect is named beside the two; that is the one wrong name.
    pub const SAMPLE: Self = Self {
        most_false_alarms: 0,
        least_exact: 6,
        least_pairs: 1,
        most_wrong: 1,
        least_unexplained: 1,
        least_shrink: [0.97, 0.9],
    };

    /// Compares counts with the bounds.
    ///
    /// # Errors
    /// If one is broken.
    pub fn check(&self, counts: &Counts) -> Result<()> {
        let Self { most_false_alarms, least_exact, least_pairs, most_wrong, least_unexplained, .. } = self;
        ensure!(counts.false_alarms <= *most_false_alarms, "more than {most_false_alarms} false alarms");
        ensure!(counts.exact >= *least_exact, "fewer than {least_exact} sets named exactly");
        ensure!(counts.pairs >= *least_pairs, "fewer than {least_pairs} pairs with both named");
        ensure!(counts.wrong <= *most_wrong, "more than {most_wrong} sets with a wrong name");
        ensure!(
            counts.unexplained >= *least_unexplained,
            "fewer than {least_unexplained} sets outside the library are unexplained, without a name"
        );
        let shrinks = counts.shrink.into_iter().flatten().zip(self.least_shrink);
        for (which, (shrink, least)) in ["median", "fifth percentile"].into_iter().zip(shrinks) {
            ensure!(shrink >= least, "the shrink's {which} is {shrink:.3}, below {least}");
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "bounds_tests.rs"]
mod tests;
