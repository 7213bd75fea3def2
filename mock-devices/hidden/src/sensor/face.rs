//! The image of a cylinder's face, which may lean, under a spread that may differ along x and y. It is computed by
//! quadrature over the disc, independently of the base model's method.

use std::f64::consts::{PI, TAU};

use tactus_model::{Blur, ForwardModel};

use super::Tool;

/// Gauss-Legendre nodes and weights on `[0, 1]` for the square of the radius, n = 2 and n = 4.
const TWO: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];
const FOUR: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_727),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273),
    (0.930_568_155_797_026_3, 0.173_927_422_568_727),
];

/// A face at a place, prepared for any depth.
///
/// ```text
/// u_e = 1/d_ref sum over points of the face of dA max(0, depth + lean . (p - c) - |lean| D/2) G_x G_y
/// ```
///
/// A flat face agrees with [`ForwardModel::indentation`] to 1e-7 of the peak where both hold.
#[derive(Debug, Clone)]
pub(super) struct Face(Vec<Point>);

/// A point of the face.
#[derive(Debug, Clone)]
struct Point {
    /// Its share of the face, in units of the reference press.
    share: f64,
    /// Height above the face's lowest point.
    above_mm: f64,
    /// The share that arrives in each column, and in each row.
    of_cols: Vec<f64>,
    of_rows: Vec<f64>,
}

impl Face {
    pub(super) fn new(model: &ForwardModel, [x_mm, y_mm]: [f64; 2], tool: &Tool) -> Self {
        let steepness = tool.lean[0].hypot(tool.lean[1]);
        // The depth over a leaning face has a kink where the surface cuts it.
        let (rings, points): (&[_], u32) = if steepness > 0.0 { (&FOUR, 12) } else { (&TWO, 6) };
        let array = model.array();
        let [width_mm, height_mm] = array.element_mm();
        let radius_mm = tool.diameter_mm / 2.0;
        let lowered_mm = radius_mm * steepness;
        let face = PI * radius_mm * radius_mm / model.reference_mm2() / f64::from(points);
        let arrives = |sigma_mm: f64, at_mm: f64, centres: &[f64], size: f64| -> Vec<f64> {
            let blur = Blur { sigma_mm };
            centres
                .iter()
                .map(|centre| blur.of_point(at_mm, [centre - size / 2.0, centre + size / 2.0]))
                .collect()
        };
        let point = |ring: &(f64, f64), place: u32| {
            let (sin, cos) = (TAU * (f64::from(place) + 0.5) / f64::from(points)).sin_cos();
            let [dx, dy] = [cos, sin].map(|by| by * radius_mm * ring.0.sqrt());
            Point {
                share: face * ring.1,
                above_mm: lowered_mm - tool.lean[0] * dx - tool.lean[1] * dy,
                of_cols: arrives(tool.sigma_mm[0], x_mm + dx, array.col_centres_mm(), width_mm),
                of_rows: arrives(tool.sigma_mm[1], y_mm + dy, array.row_centres_mm(), height_mm),
            }
        };
        Self(rings.iter().flat_map(|ring| (0..points).map(move |place| point(ring, place))).collect())
    }

    /// Equivalent indentation of every element, mm, overwritten.
    pub(super) fn indentation(&self, depth_mm: f64, indentation_mm: &mut [f64]) {
        indentation_mm.fill(0.0);
        for Point { share, above_mm, of_cols, of_rows } in &self.0 {
            let pressed = share * (depth_mm - above_mm).max(0.0);
            for (row, of_row) in indentation_mm.chunks_exact_mut(of_cols.len()).zip(of_rows) {
                for (value, of_col) in row.iter_mut().zip(of_cols) {
                    *value += pressed * of_row * of_col;
                }
            }
        }
    }
}
