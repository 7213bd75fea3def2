//! What the results of all runs say together.

use std::collections::{BTreeMap, BTreeSet};

use jiff::civil::Date;
use tactus_report::fleet::{AtRig, FleetReport, MissingEffect, Trend};

use super::{Calibrated, Discovered, Outcome, RunResult, discovered::CANNOT_JUDGE, trend::slope};

/// Chance that any quantity at all is said to change although none does.
const LEVEL: f64 = 0.05;

/// Coverings are told apart by their thickness to a thousandth of a mm.
const THICKNESS_STEPS_PER_MM: f64 = 1000.0;

/// Nanoseconds of a day.
const DAY_NS: f64 = 86_400e9;

/// What calibrations and discoveries of a fleet say together.
pub(crate) fn findings(
    fleet: &str,
    calibrated: &[RunResult<Calibrated>],
    discovered: &[RunResult<Discovered>],
) -> FleetReport {
    let mut series = Series::default();
    for result in calibrated {
        if let Outcome::Found(found) = &result.outcome {
            series.add(result, found);
        }
    }
    let refused = refused(calibrated).chain(refused(discovered)).collect();
    let mut drifts = Series::trends(series.of_sensors);
    let mut ageing = Series::trends(series.of_coverings);
    judge(&mut drifts, &mut ageing);
    let told = calibrated.iter().map(|result| (&result.run, &result.rig, result.simulated));
    let told: Vec<_> =
        told.chain(discovered.iter().map(|result| (&result.run, &result.rig, result.simulated))).collect();
    let runs: BTreeSet<_> = told.iter().map(|(run, rig, _)| (*rig, *run)).collect();
    let rigs: BTreeSet<_> = told.iter().map(|(_, rig, _)| *rig).collect();
    FleetReport {
        fleet: fleet.to_owned(),
        simulated: told.iter().any(|(_, _, simulated)| *simulated),
        runs: runs.len() as u64,
        rigs: rigs.len() as u64,
        drifts,
        ageing,
        effects: effects(discovered),
        refused,
    }
}

/// The runs that could not be judged, and why.
fn refused<T>(results: &[RunResult<T>]) -> impl Iterator<Item = String> {
    results.iter().filter_map(|result| match &result.outcome {
        Outcome::Found(_) => None,
        Outcome::Refused(problem) | Outcome::Unread(problem) => {
            Some(format!("{} of rig {}: {problem}", result.run, result.rig))
        }
    })
}

/// What a series is of: rig, quantity, unit, thickness of the covering.
type Key = (String, &'static str, &'static str, Option<i64>);

/// Values of each quantity: `[day since 1970, value, standard error]`.
#[derive(Default)]
struct Series {
    of_sensors: BTreeMap<Key, Vec<[f64; 3]>>,
    of_coverings: BTreeMap<Key, Vec<[f64; 3]>>,
}

impl Series {
    fn add(&mut self, result: &RunResult<Calibrated>, found: &Calibrated) {
        let Some(day) = day(result) else { return };
        let rig = || result.rig.clone();
        for (quantity, unit, value) in [
            ("sensitivity", "counts/mm", found.sensitivity_counts_per_mm),
            ("baseline", "counts", found.baseline_counts),
        ] {
            if let Some([value, error]) = value {
                self.of_sensors.entry((rig(), quantity, unit, None)).or_default().push([day, value, error]);
            }
        }
        for spread in &found.spreads {
            #[expect(clippy::cast_possible_truncation, reason = "a thickness in micrometres")]
            let steps = (spread.covering_mm * THICKNESS_STEPS_PER_MM).round() as i64;
            let [value, error] = spread.sigma_mm;
            self.of_coverings
                .entry((rig(), "spread", "mm", Some(steps)))
                .or_default()
                .push([day, value, error]);
        }
    }

    fn trends(series: BTreeMap<Key, Vec<[f64; 3]>>) -> Vec<Trend> {
        let trend = |((rig, quantity, unit, steps), mut points): (Key, Vec<[f64; 3]>)| {
            points.sort_by(|one, other| one[0].total_cmp(&other[0]));
            let first = points.first().map_or(0.0, |point| point[0]);
            for point in &mut points {
                point[0] -= first;
            }
            Trend {
                rig,
                quantity: quantity.to_owned(),
                unit: unit.to_owned(),
                covering_mm: steps.map(|steps| steps as f64 / THICKNESS_STEPS_PER_MM),
                slope: slope(&points),
                points,
                changes: false,
            }
        };
        series.into_iter().map(trend).collect()
    }
}

/// Says which quantities change, with the chance of an error divided among all that could be judged; those that change come first.
fn judge(drifts: &mut [Trend], ageing: &mut [Trend]) {
    let judged = drifts.iter().chain(&*ageing).filter(|trend| trend.slope.is_some()).count();
    for trends in [drifts, ageing] {
        for trend in &mut *trends {
            trend.changes = trend.slope.is_some_and(|slope| slope.p_value * (judged as f64) < LEVEL);
        }
        let p = |trend: &Trend| trend.slope.map_or(f64::INFINITY, |slope| slope.p_value);
        trends.sort_by(|one, other| p(one).total_cmp(&p(other)));
    }
}

/// When a run was made, in days since 1970.
fn day(result: &RunResult<Calibrated>) -> Option<f64> {
    if let Some(ns) = result.started_ns {
        return Some(ns as f64 / DAY_NS);
    }
    let date: Date = result.date.parse().ok()?;
    Some(f64::from((date - Date::constant(1970, 1, 1)).get_days()))
}

fn effects(discovered: &[RunResult<Discovered>]) -> Vec<MissingEffect> {
    let mut judged: BTreeMap<&str, u64> = BTreeMap::new();
    let mut shown: BTreeMap<&str, BTreeMap<&str, u64>> = BTreeMap::new();
    for result in discovered {
        let Outcome::Found(found) = &result.outcome else { continue };
        if found.verdict == CANNOT_JUDGE {
            continue;
        }
        *judged.entry(&result.rig).or_default() += 1;
        for effect in found.effects.iter().collect::<BTreeSet<_>>() {
            *shown.entry(effect).or_default().entry(&result.rig).or_default() += 1;
        }
    }
    let missing = |(effect, rigs): (&str, BTreeMap<&str, u64>)| {
        let of = |(rig, shown): (&str, u64)| AtRig {
            rig: rig.to_owned(),
            shown,
            judged: judged.get(rig).copied().unwrap_or_default(),
        };
        let rigs: Vec<AtRig> = rigs.into_iter().map(of).collect();
        let shared = rigs.iter().filter(|at| 2 * at.shown >= at.judged).count() > 1;
        MissingEffect { effect: effect.to_owned(), rigs, shared }
    };
    let mut effects: Vec<MissingEffect> = shown.into_iter().map(missing).collect();
    effects.sort_by_key(|missing| std::cmp::Reverse(missing.rigs.len()));
    effects
}

#[cfg(test)]
#[path = "findings_tests.rs"]
mod tests;
