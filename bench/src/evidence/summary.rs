//! The evidence as one table of text, for work on the method.

use std::fmt;

use super::campaign::Campaign;
use super::outcome::Outcome;
use super::score::{SetSize, Shrink, Spread};

/// Counts of each campaign, one row each, and the cost of a set.
///
/// *Seen* is a detection, in sets without physics a false alarm. *Size* is the mean size of the reported sets of equivalents. *Wrong* are
/// sets with a wrong name. *Shrink* is that over the effect's own fit, median and fifth percentile.
pub fn summary(outcomes: &[Outcome]) -> String {
    fmt::from_fn(|f| {
        writeln!(
            f,
            "{:<13}{:>6}{:>6}{:>7}{:>8}{:>6}{:>7}{:>8}  shrink",
            "", "sets", "seen", "exact", "in set", "size", "wrong", "failed"
        )?;
        for campaign in Campaign::ALL {
            let sets: Vec<&Outcome> = outcomes.iter().filter(|set| set.campaign == campaign).collect();
            if !sets.is_empty() {
                row(f, campaign, &sets)?;
            }
        }
        for (unit, costs) in [
            ("s", outcomes.iter().map(|set| set.seconds).collect::<Vec<f64>>()),
            ("MiB", outcomes.iter().map(|set| set.peak_mib).collect()),
        ] {
            if let Some(Spread { median, most, greatest }) = Spread::new(costs.into_iter()) {
                writeln!(f, "{unit:<4} median {median:.1}, 95 % within {most:.1}, greatest {greatest:.1}")?;
            }
        }
        Ok(())
    })
    .to_string()
}

fn row(f: &mut fmt::Formatter<'_>, campaign: Campaign, sets: &[&Outcome]) -> fmt::Result {
    let count = |is_so: fn(&Outcome) -> bool| sets.iter().filter(|set| is_so(set)).count();
    let (seen, failed) = (count(Outcome::is_detected), count(Outcome::has_failed));
    write!(f, "{:<13}{:>6}{seen:>6}", campaign.name(), sets.len())?;
    match campaign {
        Campaign::Names | Campaign::Pairs | Campaign::Triples => {
            write!(f, "{:>7}{:>8}", count(Outcome::is_exact), count(Outcome::holds_all))?;
        }
        Campaign::FalseAlarms | Campaign::Outside => write!(f, "{:>7}{:>8}", "-", "-")?,
    }
    match SetSize::new(sets) {
        SetSize { of: 0, .. } => write!(f, "{:>6}", "-")?,
        SetSize { mean, .. } => write!(f, "{mean:>6.2}")?,
    }
    write!(f, "{:>7}{failed:>8}", count(|set| !set.wrong_names().is_empty()))?;
    let own = sets.iter().filter_map(|set| set.shrink_to_fit_in_report());
    match Shrink::new(own) {
        Shrink { of, median: Some(median), fifth: Some(fifth) } => {
            writeln!(f, "  {median:.3}, {fifth:.3} ({of})")
        }
        Shrink { .. } => writeln!(f, "  -"),
    }
}

#[cfg(test)]
#[path = "summary_tests.rs"]
mod tests;
