//! The tables inside a press table, and how they are sampled.

#![expect(
    clippy::inline_always,
    reason = "sums of products are inlined into the function that has the instructions"
)]

use wide::{f32x4, f32x8};

use super::field::{Field, Grid, spline};
use super::products::{Products, Work, on_this_processor};
use super::{reach_mm, single};
use crate::blur::Blur;
use crate::quadrature::{coarse, whole};
use crate::{Contact, Indenter};

/// The tables end at this distance from the tool, in standard deviations of the blur. Beyond it the signal is negligible.
const TAIL: f64 = 6.0;
/// Nodes per standard deviation of the blur.
const NODES_PER_SIGMA: f64 = 6.0;
/// Even pieces of the depth range. Each depth at which the contact area jumps adds one more.
const DEPTH_PIECES: u32 = 8;

/// Tables in the tool's frame, one for each piece of the depth range.
#[derive(Debug, Clone)]
pub(super) struct Layers {
    origin_mm: [f32; 2],
    per_mm: f32,
    nodes: [usize; 2],
    turns: Turns,
    circle: Vec<[f64; 2]>,
    depth: Depth,
}

/// Nodes of the rotation.
#[derive(Debug, Clone, Copy)]
enum Turns {
    /// One node: a round tool.
    Round,
    /// Three nodes over a quarter turn: any other tool above square elements.
    Square,
    /// Seven nodes over half a turn: any other tool above oblong elements.
    Oblong,
}

/// How the signal grows with depth.
#[derive(Debug, Clone)]
enum Depth {
    /// A flat underside: the signal is proportional to depth. The table holds the signal of 1 mm.
    Flat(Vec<f32>),
    /// Any other underside: one table for each piece of the depth range.
    Pieces(Vec<Piece>),
}

/// One range of depth. The signal is a cubic, given by its value and slope at both ends.
#[derive(Debug, Clone)]
struct Piece {
    from_mm: f64,
    to_mm: f64,
    table: Vec<f32>,
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
    fn weights(self, [sin, cos]: [f64; 2], nodes: &[[f64; 2]]) -> [f64; 7] {
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
        let grid = Grid { origin_mm: [-(steps as f64) * step_mm; 2], step_mm, nodes: [2 * steps + 1; 2] };
        let maker = Maker { press, sigma_mm, element_mm, turns, grid, reference_mm2 };
        Self {
            origin_mm: grid.origin_mm.map(single),
            per_mm: single(1.0 / step_mm),
            nodes: grid.nodes,
            turns,
            circle: turns.circle(),
            depth: maker.depth(depth_max_mm),
        }
    }

    /// Signal of every element, in units of the reference press, for a tool at a positive depth.
    ///
    /// The first argument has, for x and for y, the tool's position and the elements' centres, in mm.
    pub(super) fn sample(
        &self,
        tool_and_centres: [(f64, &Vec<f32>); 2],
        rotation_deg: f64,
        depth_mm: f64,
        values: &mut [f32],
    ) {
        on_this_processor(self.sampling(tool_and_centres, rotation_deg, depth_mm, values));
    }

    fn sampling<'a>(
        &'a self,
        [(tool_x, columns), (tool_y, rows)]: [(f64, &'a Vec<f32>); 2],
        rotation_deg: f64,
        depth_mm: f64,
        values: &'a mut [f32],
    ) -> Sampling<'a> {
        let turn: [f64; 2] = match self.turns {
            Turns::Round => [0.0, 1.0],
            Turns::Square | Turns::Oblong => rotation_deg.to_radians().sin_cos().into(),
        };
        let turns = self.turns.weights(turn, &self.circle);
        let tool = [single(tool_x), single(tool_y)];
        let place = TablePose { tool, turn: turn.map(single), columns, rows };
        Sampling { layers: self, place, turns, depth_mm, values }
    }
}

/// One image to be sampled.
struct Sampling<'a> {
    layers: &'a Layers,
    place: TablePose<'a>,
    turns: [f64; 7],
    depth_mm: f64,
    values: &'a mut [f32],
}

impl Work for Sampling<'_> {
    #[inline(always)]
    fn by(self, products: impl Products) {
        match &self.layers.depth {
            Depth::Flat(table) => {
                let channels = [self.depth_mm];
                match self.layers.turns {
                    Turns::Round => self.taps::<1, 4>(products, table, &channels),
                    Turns::Square => self.taps::<3, 12>(products, table, &channels),
                    Turns::Oblong => self.taps::<7, 28>(products, table, &channels),
                }
            }
            Depth::Pieces(pieces) => {
                let piece = piece_at(pieces, self.depth_mm);
                let (table, channels) = (&piece.table, piece.weights(self.depth_mm));
                match self.layers.turns {
                    Turns::Round => self.taps::<4, 16>(products, table, &channels),
                    Turns::Square => self.taps::<12, 48>(products, table, &channels),
                    Turns::Oblong => self.taps::<28, 112>(products, table, &channels),
                }
            }
        }
    }
}

impl Sampling<'_> {
    /// Signals of all elements from the `C` channels of a table. Four neighbouring nodes have `N = 4 C` numbers.
    #[inline(always)]
    fn taps<const C: usize, const N: usize>(self, products: impl Products, table: &[f32], by_depth: &[f64]) {
        let Self { layers, place, turns, values, .. } = self;
        let channels: [f32; C] = weigh(&turns, by_depth);
        let channels = std::array::from_fn(|four| {
            f32x4::from(std::array::from_fn::<f32, 4, _>(|lane| channels[(4 * four + lane) % C]))
        });
        for (row, centre_y) in values.chunks_exact_mut(place.columns.len()).zip(place.rows) {
            let dy = centre_y - place.tool[1];
            for (values, centres_x) in row.chunks_mut(LANES).zip(place.columns.chunks(LANES)) {
                let spots = layers.spots(&place, centres_x, dy);
                // The signal is 0 beyond the table.
                if spots.inside == [0; LANES] {
                    values.fill(0.0);
                    continue;
                }
                for (lane, value) in values.iter_mut().enumerate() {
                    *value = if spots.inside[lane] == 0 {
                        0.0
                    } else {
                        spots.sample::<C, N>(products, lane, table, layers.nodes[0], &channels)
                    };
                }
            }
        }
    }
}

impl Layers {
    /// Positions of some elements of a row among the nodes.
    #[inline(always)]
    fn spots(&self, place: &TablePose<'_>, centres_x: &[f32], dy: f32) -> Spots {
        let [sin, cos] = place.turn;
        let mut dx = [0.0_f32; LANES];
        for (dx, centre_x) in dx.iter_mut().zip(centres_x) {
            *dx = centre_x - place.tool[0];
        }
        let dx = f32x8::from(dx);
        let [x0, y0] = [sin * dy - self.origin_mm[0], cos * dy - self.origin_mm[1]];
        let along_x = Spline::at((dx * cos + x0) * self.per_mm, self.nodes[0]);
        let along_y = Spline::at((dx * -sin + y0) * self.per_mm, self.nodes[1]);
        Spots {
            inside: (along_x.inside & along_y.inside).to_array().map(f32::to_bits),
            column: along_x.first,
            row: along_y.first,
            across: along_x.weights.map(f32x8::to_array),
            along: along_y.weights.map(f32x8::to_array),
        }
    }
}

/// Number of elements whose positions are computed together.
const LANES: usize = 8;

/// Positions of elements among a table's nodes: the first of the 4 x 4 nodes around each element, and the weights of
/// these nodes.
struct Spots {
    /// All bits are set within the table, none beyond it.
    inside: [u32; LANES],
    column: [u32; LANES],
    row: [u32; LANES],
    across: [[f32; LANES]; 4],
    along: [[f32; LANES]; 4],
}

impl Spots {
    /// The spline's value for one element. `channels` repeats the weights of the channels.
    #[inline(always)]
    fn sample<const C: usize, const N: usize>(
        &self,
        products: impl Products,
        lane: usize,
        table: &[f32],
        columns: usize,
        channels: &[f32x4; C],
    ) -> f32 {
        let [column, row] = [self.column[lane], self.row[lane]].map(|node| node as usize);
        let mut sums = [f32x4::ZERO; C];
        for (weights, row) in self.along.iter().zip(row..) {
            // Four neighbouring nodes of a row, each with all its channels.
            let nodes = table.get(C * (row * columns + column)..).and_then(|nodes| nodes.first_chunk::<N>());
            let Some(nodes) = nodes else { return 0.0 };
            let weight = f32x4::splat(weights[lane]);
            for (four, sum) in sums.iter_mut().enumerate() {
                let of_nodes = f32x4::from(std::array::from_fn::<f32, 4, _>(|lane| nodes[4 * four + lane]));
                *sum = products.add(*sum, weight, of_nodes);
            }
        }
        let across = self.across.map(|weights| weights[lane]);
        let mut total = f32x4::ZERO;
        for (four, (sum, channels)) in sums.into_iter().zip(channels).enumerate() {
            let across = f32x4::from(std::array::from_fn::<f32, 4, _>(|lane| across[(4 * four + lane) / C]));
            total = products.add(total, sum * channels, across);
        }
        total.reduce_add()
    }
}

/// A cubic B-spline along one axis: the first of the four nodes around each position, and the weights of these nodes.
struct Spline {
    /// All bits are set within the table, none beyond it.
    inside: f32x8,
    first: [u32; LANES],
    weights: [f32x8; 4],
}

impl Spline {
    /// For positions in units of the distance between nodes.
    #[inline(always)]
    fn at(places: f32x8, nodes: usize) -> Self {
        const SIXTH: f32 = 1.0 / 6.0;
        // Adding 2^23 rounds an `f32` to a whole number, which its lowest bits then hold.
        const WHOLE: f32 = 8_388_608.0;
        let within = places.fast_max(f32x8::splat(1.5)).fast_min(f32x8::splat(nodes as f32 - 3.0));
        let shifted = within - 0.5 + WHOLE;
        let t = within - (shifted - WHOLE);
        let u = 1.0 - t;
        Self {
            inside: places.simd_eq(within),
            first: shifted.to_array().map(|shifted| (shifted.to_bits() & 0x7f_ffff) - 1),
            weights: [
                u * u * u * SIXTH,
                t * t * (t * 0.5 - 1.0) + 2.0 / 3.0,
                u * u * (u * 0.5 - 1.0) + 2.0 / 3.0,
                t * t * t * SIXTH,
            ],
        }
    }
}

/// The tool's position in mm, its rotation as sine and cosine, and the elements' centres in mm.
struct TablePose<'a> {
    tool: [f32; 2],
    turn: [f32; 2],
    columns: &'a [f32],
    rows: &'a [f32],
}

/// Weights of the channels: the weight of the rotation times that of the depth.
fn weigh<const C: usize>(turns: &[f64; 7], by_depth: &[f64]) -> [f32; C] {
    std::array::from_fn(|channel| {
        single(turns[channel / by_depth.len()] * by_depth[channel % by_depth.len()])
    })
}

/// The piece that contains a depth.
fn piece_at(pieces: &[Piece], depth_mm: f64) -> &Piece {
    let place = pieces.partition_point(|piece| piece.to_mm < depth_mm);
    &pieces[place.min(pieces.len() - 1)]
}

impl Piece {
    /// Weights of the values and slopes at both ends, by cubic Hermite interpolation.
    fn weights(&self, depth_mm: f64) -> [f64; 4] {
        let width_mm = self.to_mm - self.from_mm;
        let t = (depth_mm - self.from_mm) / width_mm;
        let u = 1.0 - t;
        [u * u * (1.0 + 2.0 * t), t * t * (1.0 + 2.0 * u), t * u * u * width_mm, -t * t * u * width_mm]
    }
}

/// Computes the tables of one tool.
struct Maker<'a> {
    press: &'a Contact,
    sigma_mm: f64,
    element_mm: [f64; 2],
    turns: Turns,
    grid: Grid,
    reference_mm2: f64,
}

/// What a table contains, at a depth in mm.
#[derive(Clone, Copy)]
enum Channel {
    Value(f64),
    Slope(f64),
}

/// The spline coefficients of one channel, one table for each rotation.
type Tables = Vec<Vec<f64>>;

impl Maker<'_> {
    fn depth(&self, depth_max_mm: f64) -> Depth {
        let Some(jumps_mm) = jumps_mm(&self.press.indenter, depth_max_mm) else {
            return Depth::Flat(interleave(
                &[&self.tables(Channel::Slope(depth_max_mm))],
                self.grid.nodes[0],
            ));
        };
        let even = (0..=DEPTH_PIECES).map(|end| depth_max_mm * f64::from(end) / f64::from(DEPTH_PIECES));
        let mut ends_mm: Vec<f64> = even.chain(jumps_mm.iter().copied()).collect();
        ends_mm.sort_by(f64::total_cmp);
        // Two equal ends would give a piece of zero width. Slopes are taken well inside a piece.
        let least_mm = 1e-6 * depth_max_mm;
        let aside_mm = 1e-3 * least_mm;
        ends_mm.dedup_by(|after, before| *after - *before < least_mm);
        let mut pieces = Vec::new();
        let mut before: Option<(f64, Tables, Tables)> = None;
        for to_mm in ends_mm {
            let value = self.tables(Channel::Value(to_mm));
            let below = self.tables(Channel::Slope(to_mm + aside_mm));
            let jumps = jumps_mm.iter().any(|jump_mm| (jump_mm - to_mm).abs() < least_mm);
            let above = if jumps { self.tables(Channel::Slope(to_mm - aside_mm)) } else { below.clone() };
            if let Some((from_mm, from_value, from_slope)) = before {
                let table = interleave(&[&from_value, &value, &from_slope, &above], self.grid.nodes[0]);
                pieces.push(Piece { from_mm, to_mm, table });
            }
            before = Some((to_mm, value, below));
        }
        Depth::Pieces(pieces)
    }

    fn tables(&self, channel: Channel) -> Tables {
        let field = self.field(channel);
        self.turns.nodes_rad().into_iter().map(|turn_rad| self.integrated(&field, turn_rad)).collect()
    }

    /// The blurred penetration at a depth, or its derivative by depth, on a grid twice as fine as the table's.
    fn field(&self, channel: Channel) -> Field {
        let blur = Blur { sigma_mm: self.sigma_mm };
        let at = |depth_mm| Contact { depth_mm, ..self.press.clone() };
        let slices = match channel {
            Channel::Value(depth_mm) => at(depth_mm).slices(self.sigma_mm),
            Channel::Slope(depth_mm) => at(depth_mm).footprint(self.sigma_mm),
        };
        let nodes = self.grid.nodes.map(|nodes| 2 * nodes - 1);
        Field::of(&slices, blur, Grid { step_mm: self.grid.step_mm / 2.0, nodes, ..self.grid })
    }

    /// Integrates a field at every node over an element turned by `turn_rad`. The result is in units of the reference
    /// press, as spline coefficients.
    fn integrated(&self, field: &Field, turn_rad: f64) -> Vec<f64> {
        let (sin, cos) = turn_rad.sin_cos();
        let along = |side: f64| coarse(-side / 2.0, side / 2.0, self.sigma_mm).collect::<Vec<_>>();
        let [along_x, along_y] = self.element_mm.map(along);
        let mut points = Vec::with_capacity(along_x.len() * along_y.len());
        for (x, width) in &along_x {
            for (y, height) in &along_y {
                points.push(([cos * x + sin * y, cos * y - sin * x], width * height / self.reference_mm2));
            }
        }
        let [columns, rows] = self.grid.places_mm();
        let mut values = Vec::with_capacity(columns.len() * rows.len());
        for y in &rows {
            for x in &columns {
                values
                    .push(points.iter().map(|([dx, dy], weight)| weight * field.at([x + dx, y + dy])).sum());
            }
        }
        spline(values, self.grid.nodes)
    }
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

#[cfg(test)]
#[path = "layers_tests.rs"]
mod tests;
