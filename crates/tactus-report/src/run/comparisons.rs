//! What the presses of a run show when they are compared: held depths, depths up and down, speeds, repeats, directions, places; and the
//! signal while nothing touched.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    PressSummary,
    presses::{PressWay, key_of_mm},
};

/// Dwells at one depth that show how the signal changes under it.
const HELD_DWELLS: usize = 5;
/// Equal presses that show how well they repeat.
const REPEATS: usize = 5;
/// Places on each side of a grid that make a map.
const MAP_SIDE: usize = 3;
/// Seconds at rest that show a drift.
const REST_SECONDS: usize = 20;

/// The comparisons that a run's presses allow; each list is empty where none does.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparisons {
    /// One depth held for many dwells: creep.
    pub holds: Vec<PressCurve>,
    /// Depths up and down in one press: hysteresis.
    pub ladders: Vec<Ladder>,
    /// One place and depth at several loading speeds.
    pub speeds: Vec<PressCurve>,
    /// The same press many times: wear, settling, noise.
    pub repeats: Vec<PressCurve>,
    /// The same press from several directions: backlash and friction.
    pub directions: Vec<Directions>,
    /// A grid of places at one depth under one covering.
    pub maps: Vec<PlaceMap>,
    /// Mean of all elements while nothing touches, above its first value: `[s, counts]`; each point is the mean of a second.
    pub rest: Vec<[f64; 2]>,
}

/// Readings of the element under a press, or of the one that reads most.
#[derive(Debug, Clone, PartialEq)]
pub struct PressCurve {
    /// Index of the element.
    pub element: usize,
    /// The depth.
    pub depth_mm: f64,
    /// Counts above the baseline, against time (s), or against speed (mm/s).
    pub points: Vec<[f64; 2]>,
}

/// Depths of one press that went up and down.
#[derive(Debug, Clone, PartialEq)]
pub struct Ladder {
    /// Index of the element.
    pub element: usize,
    /// Depth in mm and counts on the way down, up to the deepest.
    pub loading: Vec<[f64; 2]>,
    /// From the deepest on.
    pub unloading: Vec<[f64; 2]>,
    /// Loading minus unloading at each depth that was held on both ways: depth in mm and counts.
    pub widths: Vec<[f64; 2]>,
}

/// Equal presses from several sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    /// Index of the element.
    pub element: usize,
    /// The depth.
    pub depth_mm: f64,
    /// From where the tip came, relative to the place, in mm; mean counts; number of presses.
    pub ways: Vec<([f64; 2], f64, usize)>,
}

/// What one element read at each place of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaceMap {
    /// Index of the element.
    pub element: usize,
    /// Covering in place.
    pub covering_mm: f64,
    /// The depth.
    pub depth_mm: f64,
    /// Places along x and y, sensor frame, ascending.
    pub x_mm: Vec<f64>,
    /// As `x_mm`.
    pub y_mm: Vec<f64>,
    /// Counts above the baseline, by place, x first; NaN where no press was.
    pub rise_counts: Vec<f32>,
}

/// Place and depths of a press, in steps of a micrometre.
type Kind = ([i64; 2], Vec<i64>);

impl Comparisons {
    pub(super) fn of(presses: &[PressSummary], rest: &[[f64; 2]]) -> Self {
        let mut equal: BTreeMap<Kind, Vec<&PressSummary>> = BTreeMap::new();
        for press in presses {
            equal.entry(kind(press)).or_default().push(press);
        }
        let equal: Vec<Vec<&PressSummary>> = equal.into_values().collect();
        Self {
            holds: presses.iter().filter_map(hold).collect(),
            ladders: presses.iter().filter_map(ladder).collect(),
            speeds: equal.iter().filter_map(|presses| speeds(presses)).collect(),
            repeats: equal.iter().filter_map(|presses| repeats(presses)).collect(),
            directions: equal.iter().filter_map(|presses| directions(presses)).collect(),
            maps: maps(presses),
            rest: drift(rest),
        }
    }
}

fn kind(press: &PressSummary) -> Kind {
    let depths = press.dwells.iter().map(|dwell| key_of_mm(dwell.depth_mm)).collect();
    (press.at_mm.map(key_of_mm), depths)
}

impl PressSummary {
    /// The element under the press, or the one that reads most at its deepest dwell.
    fn followed(&self) -> Option<usize> {
        let deepest = self.dwells.iter().max_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm))?;
        let rises = deepest.rise_counts.iter().enumerate();
        self.element
            .or_else(|| rises.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map(|(element, _)| element))
    }

    fn rise(&self, dwell: usize, element: usize) -> f64 {
        let rise = self.dwells.get(dwell).and_then(|dwell| dwell.rise_counts.get(element));
        rise.map_or(f64::NAN, |rise| f64::from(*rise))
    }
}

fn hold(press: &PressSummary) -> Option<PressCurve> {
    let first = press.dwells.first()?;
    let same = |depth_mm: f64| key_of_mm(depth_mm) == key_of_mm(first.depth_mm);
    if press.dwells.len() < HELD_DWELLS || !press.dwells.iter().all(|dwell| same(dwell.depth_mm)) {
        return None;
    }
    let element = press.followed()?;
    let point =
        |(nth, dwell): (usize, &super::DwellSummary)| [dwell.at_s - first.at_s, press.rise(nth, element)];
    let points = press.dwells.iter().enumerate().map(point).collect();
    Some(PressCurve { element, depth_mm: first.depth_mm, points })
}

fn ladder(press: &PressSummary) -> Option<Ladder> {
    let element = press.followed()?;
    let point = |(nth, dwell): (usize, &super::DwellSummary)| [dwell.depth_mm, press.rise(nth, element)];
    let points: Vec<[f64; 2]> = press.dwells.iter().enumerate().map(point).collect();
    let deepest = (0..points.len()).max_by(|a, b| points[*a][0].total_cmp(&points[*b][0]))?;
    let (loading, unloading) = (points[..=deepest].to_vec(), points[deepest..].to_vec());
    let is_monotone = loading.is_sorted_by(|a, b| a[0] < b[0]) && unloading.is_sorted_by(|a, b| a[0] > b[0]);
    if !is_monotone || unloading.len() < 2 {
        return None;
    }
    let back = |down: &[f64; 2]| {
        let up = unloading[1..].iter().find(|up| key_of_mm(up[0]) == key_of_mm(down[0]))?;
        Some([down[0], down[1] - up[1]])
    };
    let widths: Vec<[f64; 2]> = loading.iter().filter_map(back).collect();
    (!widths.is_empty()).then_some(Ladder { element, loading, unloading, widths })
}

fn speeds(presses: &[&PressSummary]) -> Option<PressCurve> {
    let element = presses.first()?.followed()?;
    let speed = |press: &&PressSummary| match press.way {
        PressWay { speed_mm_per_s: Some(speed), from_mm: None } => Some([speed, press.rise(0, element)]),
        PressWay { .. } => None,
    };
    let points: Vec<[f64; 2]> = presses.iter().filter_map(speed).collect();
    let distinct: BTreeSet<u64> = points.iter().map(|[speed, _]| speed.to_bits()).collect();
    let depth_mm = presses.first()?.dwells.first()?.depth_mm;
    (distinct.len() > 1).then_some(PressCurve { element, depth_mm, points })
}

fn repeats(presses: &[&PressSummary]) -> Option<PressCurve> {
    let element = presses.first()?.followed()?;
    let plain = |press: &&&PressSummary| press.way == PressWay::default() && press.dwells.len() == 1;
    let point = |press: &&PressSummary| Some([press.dwells.first()?.at_s, press.rise(0, element)]);
    let points: Vec<[f64; 2]> = presses.iter().filter(plain).filter_map(point).collect();
    let depth_mm = presses.first()?.dwells.first()?.depth_mm;
    (points.len() >= REPEATS).then_some(PressCurve { element, depth_mm, points })
}

fn directions(presses: &[&PressSummary]) -> Option<Directions> {
    let element = presses.first()?.followed()?;
    let mut ways: BTreeMap<[i64; 2], ([f64; 2], Vec<f64>)> = BTreeMap::new();
    for press in presses {
        let Some(from_mm) = press.way.from_mm else { continue };
        let of_way = ways.entry(from_mm.map(key_of_mm)).or_insert((from_mm, Vec::new()));
        of_way.1.push(press.rise(press.dwells.len().saturating_sub(1), element));
    }
    let depth_mm = presses.first()?.dwells.last()?.depth_mm;
    let mean = |rises: &[f64]| rises.iter().sum::<f64>() / rises.len() as f64;
    let ways: Vec<_> =
        ways.into_values().map(|(from_mm, rises)| (from_mm, mean(&rises), rises.len())).collect();
    (ways.len() > 1).then_some(Directions { element, depth_mm, ways })
}

/// Maps of places that lie on a grid and are not the elements' centres.
fn maps(presses: &[PressSummary]) -> Vec<PlaceMap> {
    let centres: BTreeSet<usize> = presses.iter().filter_map(|press| press.element).collect();
    let places: BTreeSet<[i64; 2]> = presses.iter().map(|press| press.at_mm.map(key_of_mm)).collect();
    if 2 * centres.len() > places.len() {
        return Vec::new();
    }
    let mut layers: BTreeMap<[i64; 2], Vec<(&PressSummary, usize)>> = BTreeMap::new();
    for press in presses {
        for (nth, dwell) in press.dwells.iter().enumerate() {
            let layer = [dwell.covering_mm, dwell.depth_mm].map(key_of_mm);
            layers.entry(layer).or_default().push((press, nth));
        }
    }
    layers.values().filter_map(|dwells| map(dwells)).collect()
}

fn map(dwells: &[(&PressSummary, usize)]) -> Option<PlaceMap> {
    let along =
        |axis: usize| dwells.iter().map(|(press, _)| key_of_mm(press.at_mm[axis])).collect::<BTreeSet<_>>();
    let [x, y] = [along(0), along(1)].map(|places| places.into_iter().collect::<Vec<_>>());
    if x.len() < MAP_SIDE || y.len() < MAP_SIDE || 2 * dwells.len() < x.len() * y.len() {
        return None;
    }
    let (first, nth) = dwells.first()?;
    let (elements, dwell) = (first.dwells[*nth].rise_counts.len(), &first.dwells[*nth]);
    let total =
        |element: usize| dwells.iter().map(|(press, nth)| press.rise(*nth, element)).sum::<f64>().abs();
    let element = (0..elements).max_by(|a, b| total(*a).total_cmp(&total(*b)))?;
    let mut rise_counts = vec![f32::NAN; x.len() * y.len()];
    for (press, nth) in dwells {
        let [col, row] = [(&x, press.at_mm[0]), (&y, press.at_mm[1])]
            .map(|(places, mm)| places.binary_search(&key_of_mm(mm)));
        if let (Ok(col), Ok(row), Some(rise)) = (col, row, press.dwells[*nth].rise_counts.get(element)) {
            rise_counts[row * x.len() + col] = *rise;
        }
    }
    let [x_mm, y_mm] = [x, y].map(|places| places.into_iter().map(|key| key as f64 * 1e-3).collect());
    Some(PlaceMap {
        element,
        covering_mm: dwell.covering_mm,
        depth_mm: dwell.depth_mm,
        x_mm,
        y_mm,
        rise_counts,
    })
}

/// Means of a second above the first one, from `[s, counts]` of the frames at rest; empty if they span too little. A second that was
/// mostly motion has too few frames to count.
fn drift(rest: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let seconds = || rest.chunk_by(|a, b| a[0].floor().to_bits() == b[0].floor().to_bits());
    let most = seconds().map(<[_]>::len).max().unwrap_or(0);
    let mean = |frames: &[[f64; 2]], axis: usize| {
        frames.iter().map(|frame| frame[axis]).sum::<f64>() / frames.len() as f64
    };
    let whole = seconds().filter(|frames| 2 * frames.len() > most);
    let means: Vec<[f64; 2]> = whole.map(|frames| [mean(frames, 0), mean(frames, 1)]).collect();
    if means.len() < REST_SECONDS {
        return Vec::new();
    }
    let zero = means.first().map_or(0.0, |first| first[1]);
    means.into_iter().map(|[at_s, counts]| [at_s, counts - zero]).collect()
}

#[cfg(test)]
#[path = "comparisons_tests.rs"]
mod tests;
