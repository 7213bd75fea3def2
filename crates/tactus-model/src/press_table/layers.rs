//! The tables inside a press table, and how they are made.

use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};
use rayon::slice::ParallelSlice;

use super::waves::{Basis, Grid, Waves};
use super::{reach_mm, single};
use crate::contact::Cut;
use crate::quadrature::whole;
use crate::{Contact, Indenter};

/// The tables end at this distance from the tool, in standard deviations of the blur. Beyond it the signal is negligible.
const TAIL: f64 = 6.0;
/// Nodes per standard deviation of the blur.
const NODES_PER_SIGMA: f64 = 6.0;
/// Pieces of the depth range are halved until their cubics are this close to the signal in their middle, as a share of the signal at the
/// greatest depth.
const PIECE_ERROR_MAX: f64 = 4e-5;
/// Pieces are halved at most this many times.
const HALVINGS_MAX: u32 = 9;

/// Tables in the tool's frame, one for each piece of the depth range.
#[derive(Debug, Clone)]
pub(super) struct Layers {
    pub(super) origin_mm: [f32; 2],
    pub(super) per_mm: f32,
    pub(super) nodes: [usize; 2],
    pub(super) turns: Turns,
    pub(super) circle: Vec<[f64; 2]>,
    pub(super) depth: Depth,
}

/// Nodes of the rotation.
#[derive(Debug, Clone, Copy)]
pub(super) enum Turns {
    /// One node: a round tool.
    Round,
    /// Three nodes over a quarter turn: any other tool above square elements.
    Square,
    /// Seven nodes over half a turn: any other tool above oblong elements.
    Oblong,
}

/// How the signal grows with depth.
#[derive(Debug, Clone)]
pub(super) enum Depth {
    /// A flat underside: the signal is proportional to depth. The table holds the signal of 1 mm.
    Flat(Vec<f32>),
    /// Any other underside: one table for each piece of the depth range.
    Pieces(Vec<Piece>),
}

/// One range of depth. The signal is a cubic, given by its value and slope at both ends.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    from_mm: f64,
    to_mm: f64,
    pub(super) table: Vec<f32>,
}

impl Turns {
    fn nodes_rad(self) -> Vec<f64> {
        let count = self.count();
        (0..count).map(|node| self.period_rad() * node as f64 / count as f64).collect()
    }

    fn count(self) -> usize {
        match self {
            Self::Round => 1,
            Self::Square => 3,
            Self::Oblong => 7,
        }
    }

    fn period_rad(self) -> f64 {
        match self {
            Self::Round | Self::Oblong => std::f64::consts::PI,
            Self::Square => std::f64::consts::FRAC_PI_2,
        }
    }

    /// Weights of the nodes in the trigonometric polynomial through them, at a rotation given by its sine and cosine.
    pub(super) fn weights(self, [sin, cos]: [f64; 2], nodes: &[[f64; 2]]) -> [f64; 7] {
        let times = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * d + b * c, b * d - a * c];
        let twice = times([sin, cos], [sin, cos]);
        let turned = if matches!(self, Self::Square) { times(twice, twice) } else { twice };
        let mut weights = [0.0; 7];
        for (weight, [sin, cos]) in weights.iter_mut().zip(nodes) {
            let aside = times(turned, [-sin, *cos]);
            let mut harmonic = [0.0, 1.0];
            let mut sum = 1.0;
            for _ in 0..nodes.len() / 2 {
                harmonic = times(harmonic, aside);
                sum += 2.0 * harmonic[1];
            }
            *weight = sum / nodes.len() as f64;
        }
        weights
    }

    /// Sines and cosines of angles that spread the nodes evenly over the full circle.
    fn circle(self) -> Vec<[f64; 2]> {
        let count = self.count();
        (0..count).map(|node| (std::f64::consts::TAU * node as f64 / count as f64).sin_cos().into()).collect()
    }
}

impl Layers {
    /// Tables for a tool and depths up to `depth_max_mm`, in units of the reference press.
    pub(super) fn new(
        press: &Contact,
        depth_max_mm: f64,
        sigma_mm: f64,
        element_mm: [f64; 2],
        reference_mm2: f64,
    ) -> Self {
        let [width_mm, height_mm] = element_mm;
        let turns = match press.indenter {
            Indenter::Cylinder { .. } | Indenter::Sphere { .. } | Indenter::Cone { .. } => Turns::Round,
            Indenter::Box { .. } | Indenter::Mesh(_) if width_mm.total_cmp(&height_mm).is_eq() => {
                Turns::Square
            }
            Indenter::Box { .. } | Indenter::Mesh(_) => Turns::Oblong,
        };
        let step_mm = sigma_mm / NODES_PER_SIGMA;
        let half_mm = reach_mm(&press.indenter) + TAIL * sigma_mm + width_mm.hypot(height_mm) / 2.0;
        let steps = whole(half_mm / step_mm);
        let grid = Grid { step_mm, steps };
        let basis = Basis::new(grid, sigma_mm, element_mm, &turns.nodes_rad());
        let maker = Maker { press, sigma_mm, basis, nodes: grid.nodes(), reference_mm2 };
        Self {
            origin_mm: [single(-(steps as f64) * step_mm); 2],
            per_mm: single(1.0 / step_mm),
            nodes: [grid.nodes(); 2],
            turns,
            circle: turns.circle(),
            depth: maker.depth(depth_max_mm),
        }
    }
}

/// The piece that contains a depth.
pub(super) fn piece_at(pieces: &[Piece], depth_mm: f64) -> &Piece {
    let place = pieces.partition_point(|piece| piece.to_mm < depth_mm);
    &pieces[place.min(pieces.len() - 1)]
}

impl Piece {
    /// Weights of the values and slopes at both ends, by cubic Hermite interpolation.
    pub(super) fn weights(&self, depth_mm: f64) -> [f64; 4] {
        weights(self.from_mm, self.to_mm, depth_mm)
    }
}

/// Computes the tables of one tool.
struct Maker<'a> {
    press: &'a Contact,
    sigma_mm: f64,
    basis: Basis,
    /// Of the grid, along each axis.
    nodes: usize,
    reference_mm2: f64,
}

/// The spline coefficients of one channel, one table for each rotation.
type Tables = Vec<Vec<f64>>;

/// The signal at a depth and its slope by depth.
struct AtDepth {
    depth_mm: f64,
    value: Waves,
    /// Just below this depth.
    slope: Waves,
    /// Just above it, where the contact area jumps.
    slope_above: Option<Waves>,
}

impl Maker<'_> {
    fn depth(&self, depth_max_mm: f64) -> Depth {
        let Some(jumps_mm) = jumps_mm(&self.press.indenter, depth_max_mm) else {
            let table = self.tables(&self.waves(Cut::Footprint, depth_max_mm));
            return Depth::Flat(interleave(&[&table], self.nodes));
        };
        // Two equal ends would give a piece of zero width. Slopes are taken well inside a piece.
        let least_mm = 1e-6 * depth_max_mm;
        let aside_mm = 1e-3 * least_mm;
        let mut ends_mm: Vec<f64> = [0.0, depth_max_mm].into_iter().chain(jumps_mm).collect();
        ends_mm.sort_by(f64::total_cmp);
        ends_mm.dedup_by(|after, before| *after - *before < least_mm);
        let given: Vec<AtDepth> =
            ends_mm.iter().map(|end_mm| self.at_depth(*end_mm, aside_mm, true)).collect();
        let most = PIECE_ERROR_MAX * given.last().map_or(0.0, |deepest| deepest.value.bound());
        let mut given = given.into_iter();
        let mut ends: Vec<AtDepth> = given.next().into_iter().collect();
        for to in given {
            let middle = |from_mm, to_mm| self.at_depth(f64::midpoint(from_mm, to_mm), aside_mm, false);
            halve(&mut ends, to, HALVINGS_MAX, most, &middle);
        }
        Depth::Pieces(self.pieces(&ends))
    }

    fn at_depth(&self, depth_mm: f64, aside_mm: f64, jumps: bool) -> AtDepth {
        let slope = |depth_mm| self.waves(Cut::Footprint, depth_mm);
        let (value, (slope, slope_above)) = rayon::join(
            || self.waves(Cut::Penetration, depth_mm),
            || (slope(depth_mm + aside_mm), jumps.then(|| slope(depth_mm - aside_mm))),
        );
        AtDepth { depth_mm, value, slope, slope_above }
    }

    /// Pieces between depths.
    fn pieces(&self, ends: &[AtDepth]) -> Vec<Piece> {
        type OfEnd = (Tables, Tables, Option<Tables>);
        let tables = |of: &AtDepth| -> OfEnd {
            let above = of.slope_above.as_ref().map(|slope| self.tables(slope));
            (self.tables(&of.value), self.tables(&of.slope), above)
        };
        let tables: Vec<OfEnd> = ends.par_iter().map(tables).collect();
        let piece = |(ends, tables): (&[AtDepth], &[OfEnd])| {
            let [(from_value, from_slope, _), (value, below, above)] = [&tables[0], &tables[1]];
            let above = above.as_ref().unwrap_or(below);
            Piece {
                from_mm: ends[0].depth_mm,
                to_mm: ends[1].depth_mm,
                table: interleave(&[from_value, value, from_slope, above], self.nodes),
            }
        };
        ends.par_windows(2).zip(tables.par_windows(2)).map(piece).collect()
    }

    /// In units of the reference press.
    fn tables(&self, field: &Waves) -> Tables {
        let mut tables = self.basis.tables(field);
        tables.iter_mut().flatten().for_each(|value| *value /= self.reference_mm2);
        tables
    }

    /// The blurred penetration at a depth, or its derivative by depth.
    fn waves(&self, cut: Cut, depth_mm: f64) -> Waves {
        let contact = Contact { depth_mm, ..self.press.clone() };
        self.basis.waves(&contact.pressed(cut, [0.0; 2], self.sigma_mm), cut)
    }
}

/// Appends the depth `to` to those before, and first such depths between it and the last that each cubic is off by at most `most` in its middle.
fn halve(
    ends: &mut Vec<AtDepth>,
    to: AtDepth,
    halvings_left: u32,
    most: f64,
    middle: &impl Fn(f64, f64) -> AtDepth,
) {
    if halvings_left > 0
        && let Some(from) = ends.last()
    {
        let between = middle(from.depth_mm, to.depth_mm);
        if off(from, &to, &between) > most {
            halve(ends, between, halvings_left - 1, most, middle);
            halve(ends, to, halvings_left - 1, most, middle);
            return;
        }
    }
    ends.push(to);
}

/// What the cubic between two depths is off by at one in between, at most.
fn off(from: &AtDepth, to: &AtDepth, between: &AtDepth) -> f64 {
    let [of_from, of_to, of_slope, of_slope_above] = weights(from.depth_mm, to.depth_mm, between.depth_mm);
    let above = to.slope_above.as_ref().unwrap_or(&to.slope);
    let difference = Waves::sum([
        (&between.value, 1.0),
        (&from.value, -of_from),
        (&to.value, -of_to),
        (&from.slope, -of_slope),
        (above, -of_slope_above),
    ]);
    difference.bound()
}

/// Weights of the values and slopes at both ends, by cubic Hermite interpolation.
fn weights(from_mm: f64, to_mm: f64, depth_mm: f64) -> [f64; 4] {
    let width_mm = to_mm - from_mm;
    let t = (depth_mm - from_mm) / width_mm;
    let u = 1.0 - t;
    [u * u * (1.0 + 2.0 * t), t * t * (1.0 + 2.0 * u), t * u * u * width_mm, -t * t * u * width_mm]
}

/// Puts several channels into one table, ordered by node, then by rotation, then by channel. A row of zeros is added, so
/// that a whole row follows every node.
fn interleave(channels: &[&Tables], columns: usize) -> Vec<f32> {
    let turns = channels.iter().map(|tables| tables.len()).min().unwrap_or(0);
    let order: Vec<&Vec<f64>> =
        (0..turns).flat_map(|turn| channels.iter().map(move |tables| &tables[turn])).collect();
    let nodes = order.first().map_or(0, |table| table.len());
    let of_nodes = (0..nodes).flat_map(|node| order.iter().map(move |table| single(table[node])));
    of_nodes.chain(std::iter::repeat_n(0.0, columns * order.len())).collect()
}

/// Depths below `depth_max_mm` at which the contact area jumps; `None` if the whole underside is flat.
fn jumps_mm(indenter: &Indenter, depth_max_mm: f64) -> Option<Vec<f64>> {
    match indenter {
        Indenter::Cylinder { .. } | Indenter::Box { .. } => None,
        Indenter::Sphere { diameter_mm } => Some(within(diameter_mm / 2.0, depth_max_mm)),
        Indenter::Cone { diameter_mm, apex_deg } => {
            Some(within(diameter_mm / 2.0 / (apex_deg.to_radians() / 2.0).tan(), depth_max_mm))
        }
        Indenter::Mesh(mesh) => {
            let [_, _, [lowest, _]] = mesh.bounds_mm();
            let mut flat = true;
            let mut jumps = Vec::new();
            // Vertical sides have no contact area.
            for corners in mesh.corners_mm().filter(|corners| twice_shadow_mm2(corners) != 0.0) {
                let heights = corners.map(|[_, _, z]| z - lowest);
                let (least, most) = (
                    heights.iter().copied().fold(f64::INFINITY, f64::min),
                    heights.iter().copied().fold(0.0, f64::max),
                );
                if least < depth_max_mm {
                    flat &= most <= 0.0;
                    if most - least < 1e-9 && most > 0.0 {
                        jumps.push(most);
                    }
                }
            }
            (!flat).then_some(jumps)
        }
    }
}

/// Twice the signed area of a triangle, seen from below.
fn twice_shadow_mm2([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

fn within(height_mm: f64, depth_max_mm: f64) -> Vec<f64> {
    if height_mm < depth_max_mm { vec![height_mm] } else { Vec::new() }
}
