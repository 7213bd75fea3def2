//! Triangles in integer coordinates, which decide the samples that a triangle covers.
//!
//! A cell has 1024 x 1024 points and 16 of them are sampled. Integer arithmetic on the numbers of a [`Facet`] decides which
//! facets cover a sample. The CPU makes these numbers once for itself and for the shaders, so both agree.

use std::ops::Range;

use tactus_model::Mesh;

use crate::Pose;
use crate::lattice::{Lattice, single, whole};

/// Points along a cell's side.
pub(crate) const POINTS: i32 = 1024;

/// Samples along a cell's side, each somewhere in its own square of points.
const SIDE: usize = 4;

/// Samples of a cell.
pub(crate) const SAMPLES: usize = 16;

/// Points along a sample's square.
const SQUARE: usize = POINTS as usize / SIDE;

/// Difference in points between a sample's position in its square and that of its neighbour along x and along y, modulo
/// the square's side: first for its x, then for its y. Chosen from many random steps for the error of the area of
/// rectangles at random angles. Long edges at 2.7 degrees from the y axis (slope 12/256) coincide with a row of samples and
/// have the greatest error.
pub(crate) const STEPS: [[usize; 2]; 2] = [[0, 12], [94, 8]];

/// Greater than the height of any tool: a greater depth changes nothing.
const DEPTH_MAX_MM: f64 = 1e6;

/// Cells of the lattice that a pose can reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Window {
    /// First column and row of cells.
    pub(crate) first: [usize; 2],
    /// Columns and rows.
    pub(crate) cells: [usize; 2],
}

/// A triangle that stands below the surface; x and y in cells from the window's first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Facet {
    /// Of each side, what a column counts for...
    a: [i32; 3],
    /// ... and a row...
    b: [i32; 3],
    /// ... in `a x + b y + c`, which is negative on the other side of it. That of the neighbour across the side
    /// is `-(a x + b y + c) - 1`: each sample is on exactly one of the two.
    c: [i32; 3],
    /// Depth below the surface at `x = y = 0`, in mm, and how it grows with x and y.
    plane_mm: [f32; 3],
    /// Depth of its deepest corner, or of the covering's foot where that is less.
    deepest_mm: f32,
    /// First column and row of the window that it can cover, and those after the last.
    bounds: [[u16; 2]; 2],
}

/// Room to place a mesh's vertices in, kept between poses.
pub(crate) type Placed = Vec<[f64; 3]>;

/// Makes the facets of a tool at a pose. There are none without contact or beside the lattice.
pub(crate) fn facets(
    mesh: &Mesh,
    pose: &Pose,
    lattice: &Lattice,
    foot_mm: f64,
    placed: &mut Placed,
    facets: &mut Vec<Facet>,
) -> Window {
    facets.clear();
    place(mesh, pose, lattice, placed);
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| placed[vertex as usize]);
    let size = lattice.axes.each_ref().map(|axis| axis.cells);
    let seen =
        || mesh.triangles().iter().map(corners).filter_map(|corners| Some((corners, seen(&corners, size)?)));

    let mut reached = [[usize::MAX; 2], [0; 2]];
    for (_, [first, end]) in seen() {
        for axis in [0, 1] {
            reached[0][axis] = reached[0][axis].min(first[axis]);
            reached[1][axis] = reached[1][axis].max(end[axis]);
        }
    }
    let [first, end] = reached;
    if first[0] >= end[0] {
        return Window::default();
    }
    let window = Window { first, cells: [end[0] - first[0], end[1] - first[1]] };
    let frame = WindowGrid::of(window);
    facets.extend(seen().filter_map(|(corners, bounds)| frame.facet(corners, bounds, foot_mm)));
    window
}

/// Turns and moves the vertices: x and y in cells from the lattice's first, z in mm below the surface.
fn place(mesh: &Mesh, pose: &Pose, lattice: &Lattice, placed: &mut Placed) {
    let rotation = pose.attitude.matrix();
    let depth_mm = pose.depth_mm.min(DEPTH_MAX_MM);
    let per_mm = 1.0 / lattice.cell_mm;
    let [x, y]: [f64; 2] = std::array::from_fn(|axis| pose.position_mm[axis] - lattice.axes[axis].origin_mm);
    let mut lowest_mm = f64::INFINITY;
    placed.clear();
    placed.extend(mesh.vertices_mm().iter().map(|[u, v, w]| {
        let [right, back, up] = rotation.map(|[a, b, c]| a * u + b * v + c * w);
        lowest_mm = lowest_mm.min(up);
        [(x + right) * per_mm, (y + back) * per_mm, up]
    }));
    for [_, _, z] in placed {
        *z = depth_mm + lowest_mm - *z;
    }
}

/// The cells that a triangle can cover, from the first of each axis to that after the last, if it has any
/// and a corner below the surface.
fn seen(corners: &[[f64; 3]; 3], size: [usize; 2]) -> Option<[[usize; 2]; 2]> {
    if corners.iter().all(|[_, _, below_mm]| *below_mm <= 0.0) {
        return None;
    }
    let [[left, right], [front, back]] = [0, 1].map(|axis| {
        let [a, b, c] = corners.map(|corner| corner[axis]);
        [whole(a.min(b).min(c)).min(size[axis]), whole(a.max(b).max(c) + 1.0).min(size[axis])]
    });
    (left < right && front < back).then_some([[left, front], [right, back]])
}

/// Conversion to the window's integer coordinates.
struct WindowGrid {
    first: [f64; 2],
    /// Its middle, in cells from its first.
    middle: [f64; 2],
    /// Length of a side's normal `(a, b)`, so that over the window `a x + b y` stays below 2^29, and over a cell
    /// below 2^24.
    normal: f64,
}

impl WindowGrid {
    fn of(Window { first, cells }: Window) -> Self {
        let [first, cells] = [first, cells].map(|window| window.map(|cells| cells as f64));
        Self {
            first,
            middle: cells.map(|cells| cells / 2.0),
            normal: (f64::from(1 << 29) / cells[0].hypot(cells[1])).min(f64::from(1 << 23)),
        }
    }

    /// `bounds` counted from the lattice's first cell. None of a triangle that stands upright.
    fn facet(&self, corners: [[f64; 3]; 3], bounds: [[usize; 2]; 2], foot_mm: f64) -> Option<Facet> {
        // A point is the middle of its share of the cell.
        let half = 0.5 / f64::from(POINTS);
        let [p, mut q, mut r] =
            corners.map(|[x, y, below_mm]| [x - self.first[0] - half, y - self.first[1] - half, below_mm]);
        let mut area = cross(p, q, r);
        if area < 0.0 {
            (q, r, area) = (r, q, -area);
        }
        let [along_x, along_y] = [
            ((q[2] - p[2]) * (r[1] - p[1]) - (r[2] - p[2]) * (q[1] - p[1])) / area,
            ((r[2] - p[2]) * (q[0] - p[0]) - (q[2] - p[2]) * (r[0] - p[0])) / area,
        ];
        let plane_mm = [p[2] - along_x * p[0] - along_y * p[1], along_x, along_y].map(single);
        if !plane_mm.iter().all(|mm| mm.is_finite()) {
            return None;
        }
        let [[a0, b0, c0], [a1, b1, c1], [a2, b2, c2]] = [self.side(p, q), self.side(q, r), self.side(r, p)];
        let [first_x, first_y] = self.first.map(whole);
        let cell = |[x, y]: [usize; 2]| {
            [x - first_x, y - first_y].map(|cell| u16::try_from(cell).unwrap_or(u16::MAX))
        };
        Some(Facet {
            a: [a0, a1, a2],
            b: [b0, b1, b2],
            c: [c0, c1, c2],
            plane_mm,
            deepest_mm: single(p[2].max(q[2]).max(r[2]).min(foot_mm)),
            bounds: bounds.map(cell),
        })
    }

    /// The side from one corner to another, its facet to the left: the same integers for both of its facets.
    fn side(&self, from: [f64; 3], to: [f64; 3]) -> [i32; 3] {
        if (to[0], to[1]) < (from[0], from[1]) {
            let [a, b, c] = self.side(to, from);
            return [-a, -b, -c - 1];
        }
        let (x, y) = (to[0] - from[0], to[1] - from[1]);
        let length = (x * x + y * y).sqrt().max(f64::MIN_POSITIVE);
        let [a, b] = [-y, x].map(|part| integer(part / length * self.normal));
        // Cutting turns the side a little, about its point nearest to the window's middle.
        let ahead = ((self.middle[0] - from[0]) * x + (self.middle[1] - from[1]) * y) / length;
        let share = (ahead / length).clamp(0.0, 1.0);
        let c = -(f64::from(a) * (from[0] + share * x) + f64::from(b) * (from[1] + share * y));
        let most = f64::from(1 << 30);
        [a, b, integer(c.clamp(-most, most))]
    }
}

/// Twice the area of a triangle, positive if its corners run counter-clockwise.
fn cross(p: [f64; 3], q: [f64; 3], r: [f64; 3]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

impl Facet {
    /// Writes the facet's depth to the samples of a window's cells, row by row, where it is deeper.
    pub(crate) fn draw(&self, window: Window, depths_mm: &mut [[f32; SAMPLES]]) {
        let [[left, front], [right, back]] = self.bounds;
        let crossings = self.crossings();
        for (row, depths_mm) in
            (front..back).zip(depths_mm.chunks_exact_mut(window.cells[0]).skip(front.into()))
        {
            let (touched, within) = runs(&crossings, row, left..right);
            for (col, depths_mm) in (0..).zip(depths_mm).take(touched.end.into()).skip(touched.start.into()) {
                if within.contains(&col) {
                    self.fill([col, row], depths_mm);
                } else {
                    self.cover([col, row], depths_mm);
                }
            }
        }
    }

    /// As the shaders read it: see `gpu/depth.wgsl`.
    #[cfg(feature = "gpu")]
    pub(crate) fn words(&self) -> [u32; 16] {
        let Self { a, b, c, plane_mm: [at_origin_mm, along_x_mm, along_y_mm], deepest_mm, bounds } = self;
        let [first, end] = bounds.map(|[col, row]| u32::from(row) << 16 | u32::from(col));
        let [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = [a, b, c].map(|sums| sums.map(i32::cast_unsigned));
        let [deepest, at_origin, along_x, along_y] =
            [deepest_mm, at_origin_mm, along_x_mm, along_y_mm].map(|mm| mm.to_bits());
        [a0, a1, a2, deepest, b0, b1, b2, at_origin, c0, c1, c2, along_x, along_y, first, end, 0]
    }

    /// Draws into a cell that is all covered.
    fn fill(&self, cell: [u16; 2], depths_mm: &mut [f32; SAMPLES]) {
        let here_mm = self.depths_mm(cell, samples(cell));
        for (depth_mm, here_mm) in depths_mm.iter_mut().zip(here_mm) {
            *depth_mm = deeper(*depth_mm, here_mm);
        }
    }

    /// Draws into a cell in which some samples may be covered.
    fn cover(&self, cell: [u16; 2], depths_mm: &mut [f32; SAMPLES]) {
        let [xs, ys] = samples(cell);
        let here_mm = self.depths_mm(cell, [xs, ys]);
        let [a, b, sums] = self.within(cell);
        for (((depth_mm, here_mm), x), y) in depths_mm.iter_mut().zip(here_mm).zip(xs).zip(ys) {
            let [p, q, r] = [0, 1, 2].map(|k| sums[k] + a[k] * x + b[k] * y);
            let here_mm = if p.min(q).min(r) >= 0.0 { here_mm } else { 0.0 };
            *depth_mm = deeper(*depth_mm, here_mm);
        }
    }

    /// The sides' numbers for the points of a cell.
    ///
    /// They and their sums are integers. Up to 2^24 an `f32` holds them exactly; greater ones are far from a side.
    fn within(&self, cell: [u16; 2]) -> [[f32; 3]; 3] {
        let [col, row] = cell.map(i32::from);
        // Cut towards zero, so that the neighbour's are the negatives.
        let [a, b] = [self.a, self.b].map(|per_cell| per_cell.map(|sum| (sum / POINTS) as f32));
        let beyond = 1 << 24;
        let sums = [0, 1, 2].map(|k| self.a[k] * col + self.b[k] * row + self.c[k]);
        [a, b, sums.map(|sum| sum.clamp(-beyond, beyond) as f32)]
    }

    /// Depths at points of a cell.
    fn depths_mm(&self, cell: [u16; 2], [xs, ys]: [&[f32; SAMPLES]; 2]) -> [f32; SAMPLES] {
        let [at_origin, along_x, along_y] = self.plane_mm;
        let [col, row] = cell.map(f32::from);
        let at_cell = at_origin + along_x * col + along_y * row;
        let [along_x, along_y] = [along_x, along_y].map(|mm| mm / POINTS as f32);
        std::array::from_fn(|sample| {
            let depth_mm = at_cell + along_x * xs[sample] + along_y * ys[sample];
            if depth_mm < self.deepest_mm { depth_mm } else { self.deepest_mm }
        })
    }

    fn crossings(&self) -> [Crossing; 3] {
        [0, 1, 2].map(|k| {
            let [a, b, c] = [self.a[k], self.b[k], self.c[k]].map(f64::from);
            // A side along the row touches all columns or none.
            let a = if a == 0.0 { 1e-9 } else { a };
            let slope = -b / a;
            Crossing {
                at: -(c + b / 2.0) / a - 0.5,
                slope,
                half: 0.5 + 0.5 * slope.abs(),
                rightwards: a > 0.0,
            }
        })
    }
}

/// Where a side crosses the rows.
struct Crossing {
    /// The column in row 0.
    at: f64,
    /// Columns from one row to the next.
    slope: f64,
    /// Half the columns that it touches in one.
    half: f64,
    /// Whether the facet lies to its right.
    rightwards: bool,
}

/// The columns of a row that a facet may touch, and those that are surely within it.
fn runs(crossings: &[Crossing; 3], row: u16, cols: Range<u16>) -> (Range<u16>, Range<u16>) {
    let (mut touched, mut within) = (cols.clone(), cols);
    for Crossing { at, slope, half, rightwards } in crossings {
        let crossed = at + slope * f64::from(row);
        let (least, most) = (crossed - half, crossed + half);
        if *rightwards {
            touched.start = touched.start.max(column(least));
            within.start = within.start.max(column(most + 1.0));
        } else {
            touched.end = touched.end.min(column(most + 1.0));
            within.end = within.end.min(column(least));
        }
    }
    (touched, within)
}

/// The x and y of a cell's samples, in points from its first.
fn samples(cell: [u16; 2]) -> [&'static [f32; SAMPLES]; 2] {
    [0, 1].map(|axis| {
        let ([by_col, by_row], [col, row]) = (STEPS[axis], cell.map(usize::from));
        &PLACES[axis][(by_col * col + by_row * row) % PLACES[axis].len()]
    })
}

/// For x and for y, the places of a cell's samples in cells whose first sample stands at 0, 4, 8, ...
static PLACES: [[[f32; SAMPLES]; SQUARE / SIDE]; 2] = {
    let mut places = [[[0.0; SAMPLES]; SQUARE / SIDE]; 2];
    let mut at = 0;
    while at < 2 * SQUARE / SIDE * SAMPLES {
        let (axis, first, sample) = (at % 2, at / 2 / SAMPLES, at / 2 % SAMPLES);
        let [x, y] = [sample % SIDE, sample / SIDE];
        let within = (SIDE * first + STEPS[axis][0] * x + STEPS[axis][1] * y) % SQUARE;
        let square = [x, y][axis];
        places[axis][first][sample] = (SQUARE * square + within) as f32;
        at += 1;
    }
    places
};

/// The greater of two depths, none of them NaN.
fn deeper(one: f32, other: f32) -> f32 {
    if other > one { other } else { one }
}

/// A number that is bounded by 2^30, cut towards zero.
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates, and has no need to")]
fn integer(bounded: f64) -> i32 {
    bounded as i32
}

/// The column that holds a coordinate, or the first or last there can be.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, as it should"
)]
fn column(coordinate: f64) -> u16 {
    coordinate as u16
}

#[cfg(test)]
#[path = "facet_tests.rs"]
mod tests;
