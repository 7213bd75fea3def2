//! The blurred penetration, before elements integrate it, as a cubic B-spline over the plane.

use std::f64::consts::PI;

use crate::blur::Blur;
use crate::contact::Slice;

/// Evenly spaced nodes over a rectangle of the tool's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// Position of node (0, 0).
    pub(super) origin_mm: [f64; 2],
    /// Distance of neighbouring nodes.
    pub(super) step_mm: f64,
    /// Number of nodes along x and y.
    pub(super) nodes: [usize; 2],
}

/// Values at a grid's nodes, or the coefficients of a cubic B-spline through them; row-major.
#[derive(Debug, Clone)]
pub(super) struct Field {
    grid: Grid,
    coefficients: Vec<f64>,
}

impl Grid {
    /// Positions of the nodes along x and y.
    pub(super) fn places_mm(&self) -> [Vec<f64>; 2] {
        [0, 1].map(|axis| {
            (0..self.nodes[axis]).map(|node| self.origin_mm[axis] + self.step_mm * node as f64).collect()
        })
    }
}

impl Field {
    /// Blurs slices: `(I * G_sigma)` at the grid's nodes, in mm, as a spline.
    pub(super) fn of(slices: &[Slice], blur: Blur, grid: Grid) -> Self {
        let [columns, rows] = grid.places_mm();
        let mut values = vec![0.0; columns.len() * rows.len()];
        for of_one_x in slices.chunk_by(|one, other| one.x_mm.total_cmp(&other.x_mm).is_eq()) {
            let Some(Slice { x_mm, .. }) = of_one_x.first() else { continue };
            let across: Vec<f64> = columns.iter().map(|x| density(x - x_mm, blur.sigma_mm)).collect();
            for (row, y) in values.chunks_exact_mut(columns.len()).zip(&rows) {
                // The blur is symmetric: a line's share at a point is the point's share on the line.
                let along: f64 =
                    of_one_x.iter().map(|slice| slice.weight_mm2 * blur.of_point(*y, slice.y_mm)).sum();
                for (value, across) in row.iter_mut().zip(&across) {
                    *value += along * across;
                }
            }
        }
        Self { grid, coefficients: spline(values, grid.nodes) }
    }

    /// The spline's value at a position; 0 beyond the grid.
    pub(super) fn at(&self, place_mm: [f64; 2]) -> f64 {
        let [columns, rows] = self.grid.nodes;
        let [Some((column, across)), Some((row, along))] = [0, 1].map(|axis| {
            let place = (place_mm[axis] - self.grid.origin_mm[axis]) / self.grid.step_mm;
            taps(place, self.grid.nodes[axis])
        }) else {
            return 0.0;
        };
        debug_assert!(column + 4 <= columns && row + 4 <= rows);
        let of_row = |row: usize| -> f64 {
            let first = row * columns + column;
            self.coefficients[first..first + 4].iter().zip(across).map(|(c, weight)| c * weight).sum()
        };
        (row..row + 4).zip(along).map(|(row, weight)| weight * of_row(row)).sum()
    }
}

/// The first of the four nodes around a position, in units of the distance between nodes, and the nodes' weights; `None`
/// beyond the grid.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 1 and the number of nodes"
)]
fn taps(place: f64, nodes: usize) -> Option<(usize, [f64; 4])> {
    if !(place >= 1.0 && place < nodes as f64 - 2.0) {
        return None;
    }
    let (t, u) = (place.fract(), 1.0 - place.fract());
    let inner = |t: f64| (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0;
    Some((place as usize - 1, [u * u * u / 6.0, inner(t), inner(u), t * t * t / 6.0]))
}

/// Coefficients of the cubic B-spline through values that vanish at the grid's border: the solution of
/// `(c[i - 1] + 4 c[i] + c[i + 1]) / 6 = value[i]` along each axis.
pub(super) fn spline(mut values: Vec<f64>, [columns, rows]: [usize; 2]) -> Vec<f64> {
    for row in 0..rows {
        solve(&mut values, row * columns, 1, columns);
    }
    for column in 0..columns {
        solve(&mut values, column, columns, rows);
    }
    values
}

/// Solves the tridiagonal equations in place by Gauss elimination, for every `step`th value.
fn solve(values: &mut [f64], first: usize, step: usize, count: usize) {
    let mut pivots = Vec::with_capacity(count);
    let (mut pivot, mut before) = (0.0, 0.0);
    for value in values[first..].iter_mut().step_by(step).take(count) {
        pivot = 1.0 / (4.0 - pivot);
        pivots.push(pivot);
        *value = (6.0 * *value - before) * pivot;
        before = *value;
    }
    let mut after = 0.0;
    for (place, pivot) in pivots.into_iter().enumerate().rev() {
        let value = &mut values[first + place * step];
        *value -= pivot * after;
        after = *value;
    }
}

fn density(distance_mm: f64, sigma_mm: f64) -> f64 {
    let z = distance_mm / sigma_mm;
    (-0.5 * z * z).exp() / (sigma_mm * (2.0 * PI).sqrt())
}
