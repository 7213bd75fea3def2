//! The image of a cylinder's face that may lean, under a spread that may differ along x and y: by quadrature of the
//! disc, apart from the base model's own way.

use std::f64::consts::{PI, TAU};

use tactus_model::{Blur, ForwardModel};

use super::Tool;

/// Gauss-Legendre nodes and weights on `[0, 1]`, n = 4, for the square of the radius.
const RINGS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_727),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273),
    (0.930_568_155_797_026_3, 0.173_927_422_568_727),
];
/// Evenly spaced points on each ring.
const POINTS: u32 = 12;

/// Equivalent indentation of every element, mm, overwritten.
///
/// ```text
/// u_e = 1/d_ref sum over points of the face of dA max(0, depth + lean . (p - c) - |lean| D/2) G_x G_y
/// ```
///
/// Agrees with [`ForwardModel::indentation`] to 1e-8 of the peak where both hold.
pub(super) fn indentation(
    model: &ForwardModel,
    [x_mm, y_mm]: [f64; 2],
    depth_mm: f64,
    tool: &Tool,
    indentation_mm: &mut [f64],
) {
    let array = model.array();
    let radius_mm = tool.diameter_mm / 2.0;
    let lowered_mm = radius_mm * tool.lean[0].hypot(tool.lean[1]);
    let [along_x, along_y] = tool.sigma_mm.map(|sigma_mm| Blur { sigma_mm });
    let scale = PI * radius_mm * radius_mm / model.reference_mm2() / f64::from(POINTS);
    indentation_mm.fill(0.0);
    for (share, weight) in RINGS {
        for point in 0..POINTS {
            let (sin, cos) = (TAU * (f64::from(point) + 0.5) / f64::from(POINTS)).sin_cos();
            let [dx, dy] = [cos, sin].map(|by| by * radius_mm * share.sqrt());
            let stands_mm = depth_mm + tool.lean[0] * dx + tool.lean[1] * dy - lowered_mm;
            if stands_mm <= 0.0 {
                continue;
            }
            let share_of = |blur: Blur, at_mm: f64, centres: &[f64], size: f64| -> Vec<f64> {
                let share = |centre| blur.of_point(at_mm, [centre - size / 2.0, centre + size / 2.0]);
                centres.iter().copied().map(share).collect()
            };
            let [width_mm, height_mm] = array.element_mm();
            let of_cols = share_of(along_x, x_mm + dx, array.col_centres_mm(), width_mm);
            let of_rows = share_of(along_y, y_mm + dy, array.row_centres_mm(), height_mm);
            for (row, of_row) in indentation_mm.chunks_exact_mut(of_cols.len()).zip(&of_rows) {
                for (value, of_col) in row.iter_mut().zip(&of_cols) {
                    *value += scale * weight * stands_mm * of_row * of_col;
                }
            }
        }
    }
}
