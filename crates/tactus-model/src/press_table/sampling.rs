//! How the tables of a tool are sampled.

#![expect(
    clippy::inline_always,
    reason = "sums of products are inlined into the function that has the instructions"
)]

use wide::{f32x4, f32x8};

use super::layers::{Depth, Layers, Turns, piece_at};
use super::products::{Products, Work, on_this_processor};
use super::single;

impl Layers {
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

#[cfg(test)]
#[path = "sampling_tests.rs"]
mod tests;
