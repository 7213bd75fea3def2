//! Images of a closed mesh in any attitude, by integrals along its outline.

#![expect(clippy::inline_always, reason = "sums are inlined into the function that has the instructions")]

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use crate::blur::Blur;
use crate::contact::{Edge, Outliner};
use crate::quadrature::{few, whole};
use crate::{Covering, ForwardModel, Mesh};

/// Images of one tool in any attitude: the fast version of the forward model where a tool is at every pose another, so that a table of it
/// would be of no use.
///
/// By the divergence theorem the image of a mesh is a sum of integrals along the edges at which its depth ends or bends. The functions of x
/// and of y in them are tabulated for each column and row of elements when this is made, and an image takes some points along each edge.
/// Preparation takes milliseconds and does not depend on the tool.
///
/// Accuracy: within 3e-4 of the greatest rise of [`ForwardModel::image`] of the turned mesh; see the tests.
///
/// ```
/// use std::sync::Arc;
///
/// use tactus_model::{Array, Covering, ForwardModel, Mesh, MeshImages, Psf, Response};
///
/// // A wedge of 2 x 2 mm, 1 mm high, that stands on an edge.
/// let corners = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]];
/// let faces = [[0, 2, 1], [1, 2, 3], [0, 1, 4], [1, 5, 4], [2, 4, 3], [3, 4, 5], [0, 4, 2], [1, 3, 5]];
/// let mesh = Arc::new(Mesh::new(&corners, &faces)?);
/// let covering = Covering { thickness_mm: 1.016 };
/// let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, Response::uniform(48, 1000.0, 100.0))?;
/// let mut images = MeshImages::new(&model, mesh, covering).expect("a closed mesh");
/// let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let mut counts = [0.0; 48];
/// assert!(images.image([2.9, 4.9], upright, 0.3, &mut counts));
/// assert!(counts[17] > 200.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MeshImages {
    mesh: Arc<Mesh>,
    tables: Arc<Tables>,
    outliner: Outliner,
    /// Of the last image, in units of the reference press, row by row; each row is as wide as a table.
    signal: Vec<f64>,
    /// The first and the second integral of a column's share up to the middle of the outline.
    to_middle: Vec<f64>,
    /// Terms of a point along x.
    of_cols: Vec<f64>,
    /// Terms of a point along y.
    of_rows: Vec<f64>,
}

/// What does not depend on the tool.
#[derive(Debug)]
struct Tables {
    model: ForwardModel,
    thickness_mm: f64,
    sigma_mm: f64,
    /// The second integral of the share of a column, the first, the share, and its first two derivatives.
    columns: Table,
    /// The share of a row, and its first four derivatives.
    rows: Table,
}

/// A function of the place along an axis for each column or row of elements, and its derivatives. Between lines a Taylor series serves.
#[derive(Debug)]
struct Table {
    origin_mm: f64,
    per_mm: f64,
    step_mm: f64,
    /// Columns or rows, and how many numbers a derivative takes: full registers.
    count: usize,
    width: usize,
    /// Line by line, derivative by derivative.
    values: Vec<f64>,
}

/// A function and four derivatives.
const ORDERS: usize = 5;

/// Lines of a table for each standard deviation of the blur. Series then end within 1e-9 of the function.
const LINES_PER_SIGMA: f64 = 16.0;

/// Beyond so many standard deviations from a side nothing arrives.
const REACH: f64 = 5.5;

/// Numbers in the widest registers there are.
const LANES: usize = 8;

/// An edge at which the depth bends more has more points: what its faces give are differences of much greater numbers.
const BEND_MAX: f64 = 0.1;

/// What arrives of a point in a row is left out where it is less.
const SHARE_LEAST: f64 = 1e-9;

impl MeshImages {
    /// Prepares images of a mesh under a covering. `None` if the mesh is not closed, or passes through itself.
    pub fn new(model: &ForwardModel, mesh: Arc<Mesh>, covering: Covering) -> Option<Self> {
        mesh.skin()?;
        let sigma_mm = model.psf().sigma_mm(covering);
        let [cols, rows] = model.array().sides_mm();
        let blur = Blur { sigma_mm };
        let tables = Tables {
            model: model.clone(),
            thickness_mm: covering.thickness_mm,
            sigma_mm,
            columns: Table::new(&cols, blur, true, |x_mm, side_mm| {
                let [once, twice] = blur.up_to(x_mm, side_mm);
                let [share, slope, bend, ..] = blur.slopes_of_point(x_mm, side_mm);
                [twice, once, share, slope, bend]
            }),
            rows: Table::new(&rows, blur, false, |y_mm, side_mm| blur.slopes_of_point(y_mm, side_mm)),
        };
        Some(Self::from_tables(mesh, Arc::new(tables)))
    }

    fn from_tables(mesh: Arc<Mesh>, tables: Arc<Tables>) -> Self {
        let Table { width, .. } = tables.columns;
        Self {
            mesh,
            outliner: Outliner::default(),
            signal: vec![0.0; width * tables.rows.count],
            to_middle: vec![0.0; 2 * width],
            of_cols: vec![0.0; width],
            of_rows: vec![0.0; tables.rows.width],
            tables,
        }
    }

    /// Counts of every element before noise, saturation and quantisation; row-major, overwritten.
    ///
    /// The tool's origin stands at `position_mm` (sensor frame), its vertices are turned by `rotation`, row by row, and its lowest point is
    /// `depth_mm` below the surface. False, and no counts, if too much of the tool is hidden below the surface, such as the teeth of a comb on
    /// its side.
    ///
    /// # Panics
    /// If `counts` has not one place per element.
    pub fn image(
        &mut self,
        position_mm: [f64; 2],
        rotation: [[f64; 3]; 3],
        depth_mm: f64,
        counts: &mut [f32],
    ) -> bool {
        let tables = Arc::clone(&self.tables);
        let Tables { model, thickness_mm, columns, rows, .. } = &*tables;
        assert_eq!(counts.len(), model.array().elements(), "one place per element");
        self.signal.fill(0.0);
        // The tool cannot go deeper than the covering: min(I, t) = max(0, I) - max(0, I - t).
        for (depth_mm, sign) in [(depth_mm, 1.0), (depth_mm - thickness_mm, -1.0)] {
            if depth_mm > 0.0 && !self.add(position_mm, rotation, depth_mm, sign) {
                return false;
            }
        }
        let signals = self.signal.chunks_exact(columns.width).take(rows.count);
        let signals = signals.flat_map(|row| &row[..columns.count]);
        for ((element, count), u) in counts.iter_mut().enumerate().zip(signals) {
            *count = single(model.response().counts(element, *u));
        }
        true
    }

    /// Adds what is pressed at a depth. False if that is not known.
    fn add(&mut self, [x, y]: [f64; 2], rotation: [[f64; 3]; 3], depth_mm: f64, sign: f64) -> bool {
        let Some(skin) = self.mesh.skin() else { return false };
        let Outliner { placed, .. } = &mut self.outliner;
        placed.clear();
        let mut lowest_mm = f64::INFINITY;
        placed.extend(skin.points_mm.iter().map(|[u, v, w]| {
            let [right, back, up] = rotation.map(|[a, b, c]| a * u + b * v + c * w);
            lowest_mm = lowest_mm.min(up);
            [x + right, y + back, up]
        }));
        for [_, _, z] in placed {
            *z = depth_mm + lowest_mm - *z;
        }
        if self.outliner.outline(skin).is_none() {
            return false;
        }
        let Self { tables, outliner, signal, to_middle, of_cols, of_rows, .. } = self;
        let edges = &outliner.edges;
        let scale = sign / tables.model.reference_mm2();
        let middle_mm = middle_mm(edges);
        Arch::new().dispatch(Integral {
            tables,
            edges,
            scale,
            middle_mm,
            signal,
            to_middle,
            of_cols,
            of_rows,
        });
        true
    }
}

/// A copy for another thread: tables are shared, and memory is its own.
impl Clone for MeshImages {
    fn clone(&self) -> Self {
        Self::from_tables(Arc::clone(&self.mesh), Arc::clone(&self.tables))
    }
}

impl Table {
    /// `goes_on`: beyond the last line the function goes on in a straight line; otherwise it is 0 there, as it is before the first.
    fn new(
        sides_mm: &[[f64; 2]],
        blur: Blur,
        goes_on: bool,
        of: impl Fn(f64, [f64; 2]) -> [f64; ORDERS],
    ) -> Self {
        let step_mm = blur.sigma_mm / LINES_PER_SIGMA;
        let reach_mm = REACH * blur.sigma_mm;
        let least_mm = sides_mm.iter().map(|[least, _]| *least).fold(f64::INFINITY, f64::min) - reach_mm;
        let most_mm = sides_mm.iter().map(|[_, most]| *most).fold(f64::NEG_INFINITY, f64::max) + reach_mm;
        let (count, width) = (sides_mm.len(), sides_mm.len().next_multiple_of(LANES));
        let lines = whole((most_mm - least_mm) / step_mm) + 1;
        let mut values = vec![0.0; lines * ORDERS * width];
        for (line, values) in values.chunks_exact_mut(ORDERS * width).enumerate() {
            let at_mm = least_mm + step_mm * line as f64;
            for (place, side_mm) in sides_mm.iter().enumerate() {
                let mut derivatives = of(at_mm, *side_mm);
                // These lines hold for all places beyond.
                if line == 0 {
                    derivatives = [0.0; ORDERS];
                } else if line + 1 == lines {
                    derivatives[if goes_on { 2 } else { 0 }..].fill(0.0);
                }
                for (derivative, value) in derivatives.into_iter().enumerate() {
                    let of_derivative = &mut values[derivative * width..][..width];
                    of_derivative[place] = value;
                }
            }
        }
        Self { origin_mm: least_mm, per_mm: 1.0 / step_mm, step_mm, count, width, values }
    }

    /// The line nearest to a place, and how far the place is beyond it.
    #[inline(always)]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates, as it should"
    )]
    fn near(&self, at_mm: f64) -> (&[f64], f64) {
        let last = self.values.len() / (ORDERS * self.width) - 1;
        let line = (((at_mm - self.origin_mm) * self.per_mm + 0.5) as usize).min(last);
        let of_line = &self.values[line * ORDERS * self.width..][..ORDERS * self.width];
        (of_line, at_mm - self.origin_mm - self.step_mm * line as f64)
    }
}

/// The middle of an outline along x.
fn middle_mm(edges: &[Edge]) -> f64 {
    let xs = edges.iter().flat_map(|edge| edge.ends_mm.map(|[x, ..]| x));
    let [least, most] =
        xs.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| [least.min(x), most.max(x)]);
    if least <= most { f64::midpoint(least, most) } else { 0.0 }
}

/// Integrals along edges.
///
/// A constant in the first integral over x, and a straight line in the second, change nothing in the sum over an outline. They are
/// chosen so that both integrals are 0 in its middle. Then errors of a column are as small as what it gets.
struct Integral<'a> {
    tables: &'a Tables,
    edges: &'a [Edge],
    scale: f64,
    middle_mm: f64,
    signal: &'a mut [f64],
    to_middle: &'a mut [f64],
    of_cols: &'a mut [f64],
    of_rows: &'a mut [f64],
}

impl WithSimd for Integral<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        self.start_in_middle(simd);
        for Edge { ends_mm: [from, to], rim, bend } in self.edges {
            let goes: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
            if goes[1] == 0.0 {
                continue;
            }
            let sigmas = (goes[0] * goes[0] + goes[1] * goes[1]).sqrt() / self.tables.sigma_mm;
            let (nodes, panels) = few(sigmas, bend.abs() > BEND_MAX);
            let half = 0.5 / panels as f64;
            for panel in 0..panels {
                let middle = half * (2.0 * panel as f64 + 1.0);
                for (node, weight) in nodes {
                    for share in [middle - half * node, middle + half * node] {
                        let [x, y, z] = std::array::from_fn(|axis| from[axis] + share * goes[axis]);
                        let along_y = self.scale * half * weight * goes[1];
                        self.add(simd, [x, y], rim * z * along_y, -bend * along_y);
                    }
                }
            }
        }
    }
}

impl Integral<'_> {
    /// Computes the integrals up to the middle.
    #[inline(always)]
    fn start_in_middle<S: Simd>(&mut self, simd: S) {
        let up_to = Series::near(simd, &self.tables.columns, self.middle_mm);
        let (once, twice) = S::as_mut_simd_f64s(self.to_middle).0.split_at_mut(up_to.width);
        for (place, (once, twice)) in once.iter_mut().zip(twice).enumerate() {
            (*once, *twice) = (up_to.slope(place), up_to.value(place));
        }
    }

    /// Adds a point of an edge.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, [x, y]: [f64; 2], once: f64, twice: f64) {
        let Self { tables: Tables { columns, rows, .. }, signal, to_middle, of_cols, of_rows, .. } = self;
        let wide = |number: f64| simd.splat_f64s(number);

        let up_to = Series::near(simd, columns, x);
        let (of_cols, _) = S::as_mut_simd_f64s(of_cols);
        let (once_to_middle, twice_to_middle) = S::as_simd_f64s(to_middle).0.split_at(up_to.width);
        let (first_weight, second_weight, back) = (wide(once), wide(twice), wide(self.middle_mm - x));
        for (place, of_col) in of_cols.iter_mut().enumerate() {
            let from_middle = simd.sub_f64s(up_to.slope(place), once_to_middle[place]);
            *of_col = simd.mul_f64s(first_weight, from_middle);
            if twice != 0.0 {
                let from_middle = simd.sub_f64s(up_to.value(place), twice_to_middle[place]);
                let straight = simd.mul_add_e_f64s(once_to_middle[place], back, from_middle);
                *of_col = simd.mul_add_e_f64s(second_weight, straight, *of_col);
            }
        }

        let share = Series::near(simd, rows, y);
        for (place, of_row) in S::as_mut_simd_f64s(of_rows).0.iter_mut().enumerate() {
            *of_row = share.value(place);
        }

        let (signal, _) = S::as_mut_simd_f64s(signal);
        for (row, of_row) in signal.chunks_exact_mut(of_cols.len()).zip(of_rows.iter()) {
            if of_row.abs() < SHARE_LEAST {
                continue;
            }
            let of_row = wide(*of_row);
            for (element, of_col) in row.iter_mut().zip(of_cols.iter()) {
                *element = simd.mul_add_e_f64s(of_row, *of_col, *element);
            }
        }
    }
}

/// The Taylor series of a table's functions about the line nearest to a place.
struct Series<'a, S: Simd> {
    simd: S,
    /// The line, derivative by derivative, and how many registers each takes.
    line: &'a [S::f64s],
    width: usize,
    /// How far the place is beyond the line, divided by 1, 2, 3 and 4.
    beyond: [S::f64s; 4],
}

impl<'a, S: Simd> Series<'a, S> {
    #[inline(always)]
    fn near(simd: S, table: &'a Table, at_mm: f64) -> Self {
        let (line, beyond_mm) = table.near(at_mm);
        let (line, _) = S::as_simd_f64s(line);
        let beyond = [1.0, 2.0, 3.0, 4.0].map(|order| simd.splat_f64s(beyond_mm / order));
        Self { simd, line, width: line.len() / ORDERS, beyond }
    }

    /// The functions there.
    #[inline(always)]
    fn value(&self, place: usize) -> S::f64s {
        let [all, half, third, quarter] = self.beyond;
        let [value, slope, second, third_slope, fourth] = self.derivatives(place);
        let rest = self.plus(second, self.plus(third_slope, fourth, quarter), third);
        self.plus(value, self.plus(slope, rest, half), all)
    }

    /// Their first derivatives there.
    #[inline(always)]
    fn slope(&self, place: usize) -> S::f64s {
        let [all, half, third, _] = self.beyond;
        let [_, slope, second, third_slope, fourth] = self.derivatives(place);
        self.plus(slope, self.plus(second, self.plus(third_slope, fourth, third), half), all)
    }

    #[inline(always)]
    fn derivatives(&self, place: usize) -> [S::f64s; ORDERS] {
        std::array::from_fn(|derivative| self.line[derivative * self.width + place])
    }

    /// `a + b x`.
    #[inline(always)]
    fn plus(&self, a: S::f64s, b: S::f64s, x: S::f64s) -> S::f64s {
        self.simd.mul_add_e_f64s(b, x, a)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "images are single precision")]
fn single(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
#[path = "mesh_images_tests.rs"]
mod tests;
