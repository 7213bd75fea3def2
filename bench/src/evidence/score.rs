//! Counts outcomes.

use std::collections::BTreeMap;

use serde::Serialize;

use super::campaign::Campaign;
use super::drafts::DraftScores;
use super::outcome::Outcome;
use super::rate::{Rate, normal_share, quantile};

/// The smallest separation that counts as detectable.
pub const Z_DETECTABLE: f64 = 4.0;
/// The separation from which on effects should be named exactly.
pub const Z_SEPARATE: f64 = 16.0;
/// The separation from the nearest wrong effect from which on a name is asked for.
pub const Z_NAMEABLE: f64 = 5.0;
/// Level of the oracle's test, equal to the allowed share of false alarms.
pub const ORACLE_LEVEL: f64 = 0.028;
/// The `1 - ORACLE_LEVEL` quantile of the normal distribution.
const ORACLE_QUANTILE: f64 = 1.911;
/// Greatest standard error of a shrink that counts.
pub(super) const SHRINK_ERROR_MAX: f64 = 0.1;
/// Ranges of separation after the spread is fitted too.
const BANDS: [(&str, [f64; 2]); 5] = [
    ("all", [0.0, f64::INFINITY]),
    ("below 4", [0.0, 3.9]),
    ("4 to 16", [3.9, 15.5]),
    ("16 and more", [15.5, f64::INFINITY]),
    ("100 and more", [100.0, f64::INFINITY]),
];

/// All scores.
#[derive(Debug, Clone, Serialize)]
pub struct Scores {
    /// Number of sets of each campaign.
    pub sets: BTreeMap<Campaign, usize>,
    /// Ids of the sets without a report. They count as misses, or as false alarms where nothing is hidden.
    pub failed: Vec<String>,
    /// False alarms by noise: `all`, `white`, `coloured`, `quantised`.
    pub false_alarms: BTreeMap<String, Rate>,
    /// Sets with one effect in a form that the library does not have, by separation.
    pub bands: Vec<Band>,
    /// Those at least [`Z_NAMEABLE`] from the nearest wrong effect, where that is computed.
    pub nameable: Band,
    /// Sets with one effect that are points of the library's own parameters, by separation.
    pub library_points: Vec<Band>,
    /// Sets with one effect in a foreign form, by effect, from [`Z_SEPARATE`] on.
    pub effects: Vec<EffectScore>,
    /// Power curve of each effect.
    pub power: BTreeMap<String, Vec<PowerPoint>>,
    /// Hidden against named effects, over the sets with one effect from [`Z_SEPARATE`] on, with physics outside the library and
    /// without physics.
    pub confusion: Vec<Cell>,
    /// Sets with two effects.
    pub pairs: Several,
    /// Sets with three effects.
    pub triples: Several,
    /// The sets with two effects in which each is from [`Z_SEPARATE`] on. Some physics hardly shows in some sets at any strength.
    pub separate_pairs: Several,
    /// The same with three effects.
    pub separate_triples: Several,
    /// The sets with two effects of which each is at least [`Z_NAMEABLE`] from the nearest wrong one, where that is computed.
    pub nameable_pairs: Several,
    /// The same with three effects.
    pub nameable_triples: Several,
    /// Sets outside the library: `all` and by physics.
    pub outside: BTreeMap<String, OutsideScore>,
    /// Drafts of what no class explains.
    pub drafts: DraftScores,
    /// Seconds of a set on one thread.
    pub seconds: Option<Spread>,
    /// Greatest resident memory of a set, in MiB.
    pub peak_mib: Option<Spread>,
}

/// How a cost is spread over all sets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub most: f64,
    /// Greatest.
    pub greatest: f64,
}

/// Sizes of the reported sets: a name and its equivalents.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SetSize {
    /// Number of names.
    pub of: usize,
    /// Mean; NaN without names.
    pub mean: f64,
    /// Greatest; 0 without names.
    pub greatest: usize,
}

/// Scores of sets with one effect.
#[derive(Debug, Clone, Serialize)]
pub struct Band {
    /// Name of the range of separations.
    pub name: String,
    /// Detected.
    pub detected: Rate,
    /// The effect is named and nothing else; of all sets, those included in which nothing was detected.
    pub exact: Rate,
    /// The effect is named or in a set of equivalents; of all sets.
    pub in_set: Rate,
    /// Sizes of the reported sets.
    pub set_size: SetSize,
    /// A named effect is neither hidden nor equivalent to a hidden one; of all sets.
    pub wrong: Rate,
    /// Shrink of the sets in which it is known within a tenth, whatever was named.
    pub shrink: Shrink,
    /// The same over the shrink of the true effect, fitted alone; without noise where that is computed.
    pub shrink_to_own_fit: Shrink,
}

/// Statistics of the shrink, the share of a gap that is closed.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Shrink {
    /// Number of sets.
    pub of: usize,
    /// Median.
    pub median: Option<f64>,
    /// Fifth percentile.
    pub fifth: Option<f64>,
}

/// Scores of the sets of one effect.
#[derive(Debug, Clone, Serialize)]
pub struct EffectScore {
    /// Its name.
    pub effect: String,
    /// Shares with their intervals.
    #[serde(flatten)]
    pub band: Band,
}

/// A point of a power curve.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct PowerPoint {
    /// Geometric mean of the separations.
    pub z: f64,
    /// Detected.
    pub detected: Rate,
    /// The effect is named and nothing else.
    pub exact: Rate,
    /// Power of a one-sided normal test at [`ORACLE_LEVEL`] that knows the effect.
    pub oracle: f64,
}

/// How often a hidden effect was given a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The hidden effect; `outside the library` or `nothing`.
    pub truth: String,
    /// The named effect; `nothing`, `unexplained` or `several`.
    pub named: String,
    /// Number of sets.
    pub count: usize,
}

/// Scores of sets with several effects.
#[derive(Debug, Clone, Serialize)]
pub struct Several {
    /// All are named, perhaps with others.
    pub named: Rate,
    /// All are named, and nothing else.
    pub exact: Rate,
    /// All are named or in sets of equivalents, each in a different one.
    pub in_set: Rate,
    /// A named effect is neither hidden nor equivalent to a hidden one.
    pub wrong: Rate,
    /// Hidden effects that are named; of all hidden effects.
    pub recall: Rate,
    /// Names that are hidden effects; of all names.
    pub precision: Rate,
    /// Shrink of the sets in which it is known within a tenth.
    pub shrink: Shrink,
}

/// Scores of sets with physics outside the library.
#[derive(Debug, Clone, Serialize)]
pub struct OutsideScore {
    /// The verdict is `unexplained`, and nothing is named.
    pub unexplained: Rate,
    /// An effect is named.
    pub wrong: Rate,
    /// The verdict is `partly-explained`.
    pub partly: Rate,
    /// Not detected.
    pub missed: Rate,
}

impl Scores {
    /// The scores of some outcomes.
    pub fn new(outcomes: &[Outcome]) -> Self {
        let of = |campaign: Campaign| -> Vec<&Outcome> {
            outcomes.iter().filter(|outcome| outcome.campaign == campaign).collect()
        };
        let [false_alarms, names, pairs, triples, outside] = Campaign::ALL.map(of);
        let mut sets = BTreeMap::new();
        for outcome in outcomes {
            *sets.entry(outcome.campaign).or_default() += 1;
        }
        let failed = outcomes.iter().filter(|outcome| outcome.has_failed()).map(|outcome| outcome.id.clone());
        let (points, names): (Vec<&Outcome>, Vec<&Outcome>) =
            names.into_iter().partition(|set| set.is_library_point());
        let bands = |sets: &[&Outcome]| {
            BANDS.iter().map(|(name, range)| Band::new(name, &within(sets, *range))).collect()
        };
        let separate = within(&names, BANDS[3].1);
        let effect = |(effect, sets): (String, Vec<&Outcome>)| {
            let band = Band::new("", &sets);
            EffectScore { effect, band }
        };
        Self {
            sets,
            failed: failed.collect(),
            false_alarms: by_noise(&false_alarms),
            bands: bands(&names),
            nameable: Band::new("", &apart(&names)),
            library_points: bands(&points),
            effects: by_effect(&separate).into_iter().map(effect).collect(),
            power: by_effect(&names).into_iter().map(|(effect, sets)| (effect, power(&sets))).collect(),
            confusion: confusion(&[&separate[..], &outside[..], &false_alarms[..]].concat()),
            pairs: Several::new(&pairs),
            triples: Several::new(&triples),
            separate_pairs: Several::new(&within(&pairs, BANDS[3].1)),
            separate_triples: Several::new(&within(&triples, BANDS[3].1)),
            nameable_pairs: Several::new(&apart(&pairs)),
            nameable_triples: Several::new(&apart(&triples)),
            outside: by_physics(&outside)
                .into_iter()
                .map(|(physics, sets)| (physics, OutsideScore::new(&sets)))
                .collect(),
            drafts: DraftScores::new(&false_alarms, &names, &outside),
            seconds: Spread::new(outcomes.iter().map(|outcome| outcome.seconds)),
            peak_mib: Spread::new(outcomes.iter().map(|outcome| outcome.peak_mib)),
        }
    }
}

impl Band {
    fn new(name: &str, sets: &[&Outcome]) -> Self {
        Self {
            name: name.into(),
            detected: Rate::of(sets, |set| set.is_detected()),
            exact: Rate::of(sets, |set| set.is_exact()),
            in_set: Rate::of(sets, |set| set.holds_all()),
            set_size: SetSize::new(sets),
            wrong: Rate::of(sets, |set| !set.wrong_names().is_empty()),
            shrink: Shrink::new(sets.iter().filter_map(|set| set.known_shrink())),
            shrink_to_own_fit: Shrink::new(sets.iter().filter_map(|set| set.shrink_to_own_fit())),
        }
    }
}

impl Spread {
    pub(super) fn new(costs: impl Iterator<Item = f64>) -> Option<Self> {
        let costs: Vec<f64> = costs.collect();
        let [median, most, greatest] = [0.5, 0.95, 1.0].map(|share| quantile(costs.clone(), share));
        Some(Self { median: median?, most: most?, greatest: greatest? })
    }
}

impl SetSize {
    pub(super) fn new(sets: &[&Outcome]) -> Self {
        let sizes: Vec<usize> =
            sets.iter().flat_map(|set| &set.named).map(|named| 1 + named.equivalent.len()).collect();
        let of = sizes.len();
        Self {
            of,
            mean: sizes.iter().sum::<usize>() as f64 / of as f64,
            greatest: sizes.into_iter().max().unwrap_or(0),
        }
    }
}

impl Shrink {
    pub(super) fn new(shrinks: impl Iterator<Item = f64>) -> Self {
        let shrinks: Vec<f64> = shrinks.collect();
        let of = shrinks.len();
        Self { of, median: quantile(shrinks.clone(), 0.5), fifth: quantile(shrinks, 0.05) }
    }
}

impl Several {
    fn new(sets: &[&Outcome]) -> Self {
        let hidden = sets.iter().flat_map(|set| set.truths.iter().map(move |truth| (set, truth)));
        let names = sets.iter().flat_map(|set| set.named.iter().map(move |named| (set, named)));
        Self {
            recall: Rate::of(hidden, |(set, truth)| {
                set.named.iter().any(|named| truth.effect.as_ref() == Some(&named.effect))
            }),
            precision: Rate::of(names, |(set, named)| {
                set.truths.iter().any(|truth| truth.effect.as_ref() == Some(&named.effect))
            }),
            named: Rate::of(sets, |set| set.names_all()),
            exact: Rate::of(sets, |set| set.is_exact()),
            in_set: Rate::of(sets, |set| set.holds_all()),
            wrong: Rate::of(sets, |set| !set.wrong_names().is_empty()),
            shrink: Shrink::new(sets.iter().filter_map(|set| set.known_shrink())),
        }
    }
}

impl OutsideScore {
    fn new(sets: &[&Outcome]) -> Self {
        Self {
            unexplained: Rate::of(sets, |set| set.is_unexplained()),
            wrong: Rate::of(sets, |set| !set.named.is_empty()),
            partly: Rate::of(sets, |set| set.verdict == "partly-explained"),
            missed: Rate::of(sets, |set| !set.is_detected()),
        }
    }
}

/// Power of a one-sided normal test at [`ORACLE_LEVEL`] that knows the effect.
pub(super) fn oracle(z: f64) -> f64 {
    normal_share(z - ORACLE_QUANTILE)
}

fn within<'a>(sets: &[&'a Outcome], [least, most]: [f64; 2]) -> Vec<&'a Outcome> {
    sets.iter().copied().filter(|set| (least..most).contains(&set.z())).collect()
}

/// Those that somebody could name: of which each effect is far enough from the nearest wrong one.
fn apart<'a>(sets: &[&'a Outcome]) -> Vec<&'a Outcome> {
    sets.iter().copied().filter(|set| set.is_apart()).collect()
}

/// The hidden effect, as [`Cell::truth`].
fn truth(set: &Outcome) -> String {
    match set.truths.first() {
        None => "nothing".into(),
        Some(truth) => truth.effect.clone().unwrap_or_else(|| "outside the library".into()),
    }
}

/// The named effect, as [`Cell::named`].
fn said(set: &Outcome) -> String {
    match &set.named[..] {
        [] if set.is_detected() => "unexplained".into(),
        [] => "nothing".into(),
        [only] => only.effect.clone(),
        [_, _, ..] => "several".into(),
    }
}

fn by_effect<'a>(sets: &[&'a Outcome]) -> BTreeMap<String, Vec<&'a Outcome>> {
    let mut groups: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
    for set in sets {
        groups.entry(truth(set)).or_default().push(set);
    }
    groups
}

fn by_noise(sets: &[&Outcome]) -> BTreeMap<String, Rate> {
    let mut groups: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
    for set in sets {
        let kind = set.id.split(['/', '-']).find(|part| ["white", "coloured", "quantised"].contains(part));
        for group in ["all", kind.unwrap_or("other")] {
            groups.entry(group.into()).or_default().push(set);
        }
    }
    // A set without a report does not show that nothing was detected.
    let is_alarm = |set: &&Outcome| set.is_detected() || set.has_failed();
    groups.into_iter().map(|(kind, sets)| (kind, Rate::of(&sets, is_alarm))).collect()
}

/// Some sets as `all` and by physics.
pub(super) fn by_physics<'a>(sets: &[&'a Outcome]) -> BTreeMap<String, Vec<&'a Outcome>> {
    let mut groups: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
    for set in sets {
        let physics = set.truths.iter().map(|truth| truth.physics.as_str());
        for group in ["all"].into_iter().chain(physics) {
            groups.entry(group.into()).or_default().push(set);
        }
    }
    groups
}

/// One point for each power of two of the separation.
#[expect(clippy::cast_possible_truncation, reason = "a small power")]
fn power(sets: &[&Outcome]) -> Vec<PowerPoint> {
    let mut groups: BTreeMap<i32, Vec<&Outcome>> = BTreeMap::new();
    for set in sets.iter().filter(|set| set.z() > 0.0) {
        groups.entry(set.z().log2().round() as i32).or_default().push(set);
    }
    let point = |sets: Vec<&Outcome>| {
        let count = sets.len() as f64;
        let z = (sets.iter().map(|set| set.z().ln()).sum::<f64>() / count).exp();
        PowerPoint {
            z,
            detected: Rate::of(&sets, |set| set.is_detected()),
            exact: Rate::of(&sets, |set| set.is_exact()),
            oracle: sets.iter().map(|set| oracle(set.z())).sum::<f64>() / count,
        }
    };
    groups.into_values().map(point).collect()
}

fn confusion(sets: &[&Outcome]) -> Vec<Cell> {
    let mut counts: BTreeMap<(String, String), usize> = BTreeMap::new();
    for set in sets {
        *counts.entry((truth(set), said(set))).or_default() += 1;
    }
    counts.into_iter().map(|((truth, named), count)| Cell { truth, named, count }).collect()
}

#[cfg(test)]
#[path = "score_tests.rs"]
mod tests;
