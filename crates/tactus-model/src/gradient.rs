//! Derivatives of an image by the model's parameters and the tool's place, in closed form.

use crate::blur::Blur;
use crate::contact::Slice;
use crate::{Array, Contact, Covering, ForwardModel};

/// Counts of every element and their derivatives by each parameter; every list has one value per element,
/// row-major. (By its baseline an element's derivative is 1.)
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// The image itself, as [`ForwardModel::image`] gives it.
    pub counts: Vec<f64>,
    /// By the tool's x and y, in counts per mm.
    pub by_position_mm: [Vec<f64>; 2],
    /// By the tool's rotation about its axis, in counts per degree.
    pub by_rotation_deg: Vec<f64>,
    /// By the tool's depth, in counts per mm; towards greater depth where it jumps.
    pub by_depth_mm: Vec<f64>,
    /// By [`Psf::sigma_intercept_mm`](crate::Psf), in counts per mm.
    pub by_sigma_intercept_mm: Vec<f64>,
    /// By [`Psf::sigma_per_mm`](crate::Psf), in counts.
    pub by_sigma_per_mm: Vec<f64>,
    /// By the element's own sensitivity, in mm.
    pub by_sensitivity: Vec<f64>,
    /// By the element's own quadratic term, in counts mm.
    pub by_quadratic: Vec<f64>,
}

/// Signal of every element and its derivatives, in units of the model's reference press.
struct Signal {
    value: Vec<f64>,
    by_position: [Vec<f64>; 2],
    by_rotation_rad: Vec<f64>,
    by_depth: Vec<f64>,
    by_sigma: Vec<f64>,
}

impl ForwardModel {
    /// Counts of every element under a contact and their derivatives.
    ///
    /// The spread acts twice: on the signal, and on the reference press for which sensitivity is stated. The derivatives
    /// include both. The derivative by depth of a tool with a flat face is the one in contact.
    ///
    /// Accuracy: as the image's; against central differences, see the tests.
    pub fn gradient(&self, contact: &Contact, covering: Covering) -> Gradient {
        let sigma_mm = self.psf().sigma_mm(covering);
        let mut signal = self.signal(contact, sigma_mm, 1.0);
        if contact.depth_mm > covering.thickness_mm {
            let beyond = Contact { depth_mm: contact.depth_mm - covering.thickness_mm, ..contact.clone() };
            signal.add(&self.signal(&beyond, sigma_mm, -1.0));
        }
        let response = self.response();
        let reference_mm = response.reference_covering.thickness_mm;
        // d_ref changes with the spread under the reference covering: u = d / d_ref.
        let shrink = self.reference_by_sigma();
        let mut gradient = Gradient {
            counts: signal.value.clone(),
            by_position_mm: signal.by_position,
            by_rotation_deg: signal.by_rotation_rad,
            by_depth_mm: signal.by_depth,
            by_sigma_intercept_mm: Vec::new(),
            by_sigma_per_mm: Vec::new(),
            by_sensitivity: Vec::new(),
            by_quadratic: Vec::new(),
        };
        self.respond(&mut gradient.counts);
        for (element, &u) in signal.value.iter().enumerate() {
            let (sensitivity, quadratic) =
                (response.sensitivity_counts_per_mm[element], response.quadratic_per_mm[element]);
            let per_mm = sensitivity * (1.0 + 2.0 * quadratic * u);
            let [by_x, by_y] = &mut gradient.by_position_mm;
            by_x[element] *= per_mm;
            by_y[element] *= per_mm;
            gradient.by_rotation_deg[element] *= per_mm * 1.0_f64.to_radians();
            gradient.by_depth_mm[element] *= per_mm;
            let by_sigma = signal.by_sigma[element];
            gradient.by_sigma_intercept_mm.push(per_mm * (by_sigma - u * shrink));
            let by_slope = covering.thickness_mm * by_sigma - reference_mm * u * shrink;
            gradient.by_sigma_per_mm.push(per_mm * by_slope);
            gradient.by_sensitivity.push(u + quadratic * u * u);
            gradient.by_quadratic.push(sensitivity * u * u);
        }
        gradient
    }

    fn signal(&self, contact: &Contact, sigma_mm: f64, sign: f64) -> Signal {
        let blur = Blur { sigma_mm };
        let scale = sign / self.reference_mm2;
        Signal::of(
            self.array(),
            contact,
            &contact.slices(sigma_mm),
            &contact.footprint(sigma_mm),
            blur,
            scale,
        )
    }

    /// Relative change of the reference press's signal with the spread, in 1/mm.
    fn reference_by_sigma(&self) -> f64 {
        let response = self.response();
        let blur = Blur { sigma_mm: self.psf().sigma_mm(response.reference_covering) };
        let reference = response.reference_press();
        let [side_x, side_y] = self.array().element_mm().map(|side| [-side / 2.0, side / 2.0]);
        let by_sigma = |slice: &Slice| {
            let (share, line) = (blur.of_point(slice.x_mm, side_x), blur.of_line(slice.y_mm, side_y));
            let ([_, of_share], [_, of_line]) =
                (blur.slope_of_point(slice.x_mm, side_x), blur.slope_of_line(slice.y_mm, side_y));
            slice.weight_mm2 * (of_share * line + share * of_line)
        };
        reference.slices(blur.sigma_mm).iter().map(by_sigma).sum::<f64>() / self.reference_mm2
    }
}

impl Signal {
    fn of(
        array: &Array,
        contact: &Contact,
        penetration: &[Slice],
        footprint: &[Slice],
        blur: Blur,
        scale: f64,
    ) -> Self {
        let none = vec![0.0; array.elements()];
        let mut signal = Self {
            value: none.clone(),
            by_position: [none.clone(), none.clone()],
            by_rotation_rad: none.clone(),
            by_depth: none.clone(),
            by_sigma: none,
        };
        let [cols, rows] = array.sides_mm();
        let [axis_x, axis_y] = contact.position_mm;
        for slice in penetration {
            let weight = scale * slice.weight_mm2;
            let of_cols: Vec<_> = cols
                .iter()
                .map(|side| (blur.of_point(slice.x_mm, *side), blur.slope_of_point(slice.x_mm, *side)))
                .collect();
            for (row, side) in rows.iter().enumerate() {
                let line = blur.of_line(slice.y_mm, *side);
                let [by_shift, by_sigma] = blur.slope_of_line(slice.y_mm, *side);
                let moment = blur.moment_of_line(slice.y_mm, *side) - axis_y * line;
                for (col, (share, [by_place, share_by_sigma])) in of_cols.iter().enumerate() {
                    let element = row * cols.len() + col;
                    signal.value[element] += weight * share * line;
                    signal.by_position[0][element] += weight * by_place * line;
                    signal.by_position[1][element] += weight * share * by_shift;
                    // A turn moves a point by -(y - axis) along x and by (x - axis) along y.
                    let turn = (slice.x_mm - axis_x) * share * by_shift - by_place * moment;
                    signal.by_rotation_rad[element] += weight * turn;
                    signal.by_sigma[element] += weight * (share_by_sigma * line + share * by_sigma);
                }
            }
        }
        for slice in footprint {
            let weight = scale * slice.weight_mm2;
            for (row, side_y) in rows.iter().enumerate() {
                let line = weight * blur.of_line(slice.y_mm, *side_y);
                for (col, side_x) in cols.iter().enumerate() {
                    signal.by_depth[row * cols.len() + col] += line * blur.of_point(slice.x_mm, *side_x);
                }
            }
        }
        signal
    }

    fn add(&mut self, other: &Self) {
        let [x, y] = &mut self.by_position;
        let [other_x, other_y] = &other.by_position;
        for (mine, theirs) in [
            (&mut self.value, &other.value),
            (x, other_x),
            (y, other_y),
            (&mut self.by_rotation_rad, &other.by_rotation_rad),
            (&mut self.by_depth, &other.by_depth),
            (&mut self.by_sigma, &other.by_sigma),
        ] {
            for (mine, theirs) in mine.iter_mut().zip(theirs) {
                *mine += theirs;
            }
        }
    }
}

#[cfg(test)]
#[path = "gradient_tests.rs"]
mod tests;
