//! A table of presses, sampled once: the fast version of the forward model for one tool under one covering.

mod layers;
mod products;
mod sampling;
mod waves;

use crate::{Contact, Covering, ForwardModel, Indenter};
use layers::Layers;

/// A table of the signal of an element as a function of its position under the tool, the tool's rotation and depth.
///
/// With the element's active square turned by the tool's rotation `theta` and centred at `p` in the tool's frame,
///
/// ```text
/// T(p, theta, depth) = integral over the square of (I_depth * G_sigma)
/// ```
///
/// is smooth in all its arguments because the blur has removed fine detail. So `T` is computed once, as a sum of the waves that the blur
/// leaves, and then interpolated: by cubic B-splines over `p` (nodes a sixth of the blur apart), by three nodes of a
/// trigonometric polynomial over the quarter turn under which a square is symmetric, and by cubic Hermite polynomials
/// over depth, whose pieces end where the contact area jumps and are halved until they are close enough. Round tools need one rotation, and tools with a flat
/// underside one depth. An image takes 16 to 192 multiplications per element, for any mesh.
///
/// Accuracy: within 5e-5 of the greatest rise of [`ForwardModel::image`] at the greatest depth, for elements no larger than the blur's `sigma`
/// (the tests and benchmarks print it). Values are `f32`; their last bits depend on the processor.
///
/// ```
/// use tactus_model::{Array, Covering, ForwardModel, Indenter, Psf, Response, PressTable};
///
/// let covering = Covering { thickness_mm: 1.016 };
/// let indenter = Indenter::Cylinder { diameter_mm: 1.0 };
/// let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, Response::uniform(48, 1000.0, 100.0))?;
/// let table = PressTable::new(&model, &indenter, covering, 0.6)?;
/// let mut counts = [0.0; 48];
/// table.image([2.9, 4.9], 0.0, 0.3, &mut counts)?;
/// // The reference press at the centre of element 17: sensitivity times depth above the baseline.
/// assert!((counts[17] - 400.0).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PressTable {
    depth_max_mm: f64,
    layers: Layers,
    col_centres_mm: Vec<f32>,
    row_centres_mm: Vec<f32>,
    response: Vec<Element>,
}

/// `counts = baseline + gain (u + quadratic u^2)`.
#[derive(Debug, Clone, Copy)]
struct Element {
    baseline: f32,
    gain: f32,
    quadratic: f32,
}

/// Why a press table cannot be made or sampled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum PressTableError {
    /// The depth is beyond what the press table was made for, or not a number.
    #[error("depth {depth_mm} mm is beyond {depth_max_mm} mm, for which the press table was made")]
    Depth { depth_mm: f64, depth_max_mm: f64 },
    /// The greatest depth asked for is not within the covering.
    #[error(
        "the greatest depth must lie above 0 and within the covering of {thickness_mm} mm, not at {depth_max_mm} mm"
    )]
    DepthMax { depth_max_mm: f64, thickness_mm: f64 },
    /// The blur is too fine for a table, relative to the elements or the tool.
    #[error(
        "a blur of {sigma_mm} mm is too fine for a press table: it needs half an element ({element_mm} mm) and 1/200 of the tool ({tool_mm} mm)"
    )]
    Fine { sigma_mm: f64, element_mm: f64, tool_mm: f64 },
    /// The output does not have one value per element.
    #[error("an image of {elements} elements does not fit {places} places")]
    Length { elements: usize, places: usize },
}

impl PressTable {
    /// Makes the press table of a tool under a covering for depths up to `depth_max_mm`, in mm.
    ///
    /// Takes a millisecond for flat tools, some 20 for those that are tilted, and more for finely tessellated ones.
    ///
    /// # Errors
    /// [`PressTableError::DepthMax`] unless `0 < depth_max_mm <= ` the covering's thickness; [`PressTableError::Fine`] if the
    /// blur is less than half an element or 1/200 of the tool.
    pub fn new(
        model: &ForwardModel,
        indenter: &Indenter,
        covering: Covering,
        depth_max_mm: f64,
    ) -> Result<Self, PressTableError> {
        let thickness_mm = covering.thickness_mm;
        if !(depth_max_mm > 0.0 && depth_max_mm <= thickness_mm) {
            return Err(PressTableError::DepthMax { depth_max_mm, thickness_mm });
        }
        let sigma_mm = model.psf().sigma_mm(covering);
        let [width_mm, height_mm] = model.array().element_mm();
        let (element_mm, tool_mm) = (width_mm.max(height_mm), 2.0 * reach_mm(indenter));
        if sigma_mm < element_mm / 2.0 || sigma_mm < tool_mm / 200.0 {
            return Err(PressTableError::Fine { sigma_mm, element_mm, tool_mm });
        }
        let narrow = |values: &[f64]| values.iter().map(|value| single(*value)).collect();
        let response = model.response();
        let elements = response.baseline_counts.iter().zip(&response.sensitivity_counts_per_mm);
        let press =
            Contact { indenter: indenter.clone(), position_mm: [0.0; 2], rotation_deg: 0.0, depth_mm: 0.0 };
        Ok(Self {
            depth_max_mm,
            layers: Layers::new(&press, depth_max_mm, sigma_mm, [width_mm, height_mm], model.reference_mm2),
            col_centres_mm: narrow(model.array().col_centres_mm()),
            row_centres_mm: narrow(model.array().row_centres_mm()),
            response: elements
                .zip(&response.quadratic_per_mm)
                .map(|((baseline, gain), quadratic)| Element {
                    baseline: single(*baseline),
                    gain: single(*gain),
                    quadratic: single(*quadratic),
                })
                .collect(),
        })
    }

    /// Counts of every element before noise, saturation and quantisation.
    ///
    /// The tool's axis stands at `position_mm` (sensor frame), turned by `rotation_deg` counter-clockwise, its
    /// lowest point `depth_mm` below the surface; at or above it nothing presses. `counts`: one per element,
    /// row-major, overwritten.
    ///
    /// # Errors
    /// [`PressTableError::Depth`] beyond the depth that the press table was made for, [`PressTableError::Length`] if `counts` has
    /// not one place per element.
    pub fn image(
        &self,
        position_mm: [f64; 2],
        rotation_deg: f64,
        depth_mm: f64,
        counts: &mut [f32],
    ) -> Result<(), PressTableError> {
        self.indentation(position_mm, rotation_deg, depth_mm, counts)?;
        for (count, element) in counts.iter_mut().zip(&self.response) {
            *count = element.baseline + element.gain * (*count + element.quadratic * *count * *count);
        }
        Ok(())
    }

    /// Equivalent indentation of every element, in mm, for a tool placed as in [`PressTable::image`].
    ///
    /// `indentation_mm`: one per element, row-major, overwritten.
    ///
    /// # Errors
    /// As [`PressTable::image`].
    pub fn indentation(
        &self,
        position_mm: [f64; 2],
        rotation_deg: f64,
        depth_mm: f64,
        indentation_mm: &mut [f32],
    ) -> Result<(), PressTableError> {
        if indentation_mm.len() != self.response.len() {
            return Err(PressTableError::Length {
                elements: self.response.len(),
                places: indentation_mm.len(),
            });
        }
        if depth_mm.is_nan() || depth_mm > self.depth_max_mm {
            return Err(PressTableError::Depth { depth_mm, depth_max_mm: self.depth_max_mm });
        }
        if depth_mm > 0.0 {
            let offsets = [(position_mm[0], &self.col_centres_mm), (position_mm[1], &self.row_centres_mm)];
            self.layers.sample(offsets, rotation_deg, depth_mm, indentation_mm);
        } else {
            indentation_mm.fill(0.0);
        }
        Ok(())
    }
}

/// Greatest distance of the tool's face from its axis.
fn reach_mm(indenter: &Indenter) -> f64 {
    match indenter {
        Indenter::Cylinder { diameter_mm }
        | Indenter::Sphere { diameter_mm }
        | Indenter::Cone { diameter_mm, .. } => diameter_mm / 2.0,
        Indenter::Box { size_mm: [width_mm, height_mm] } => width_mm.hypot(*height_mm) / 2.0,
        Indenter::Mesh(mesh) => mesh.vertices_mm().iter().map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the press table's values are single precision")]
fn single(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
#[path = "press_table_tests.rs"]
mod tests;
