//! Figure 10a: three tools on arrays of three resolutions.

use std::sync::Arc;

use tactus_model::{Array, Contact, Indenter, Psf};
use tactus_scene::shapes::{SCENES, Scene};

use super::{COVERINGS, Drawing, FigureError, middle_mm, uniform, zero_to_one};
use crate::plot::{ColourBar, HeatMap, Image, Label, Scale, Sheet, number};

/// Images of all tools on one array.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolution {
    /// The array that reads the images.
    pub array: Array,
    /// One image per tool, row-major, 0 to 1.
    pub images: Vec<Vec<f32>>,
}

impl Resolution {
    /// Presses tools into the middle of an array whose spread is one element width (paper, Sec. 5).
    pub(super) fn new(array: Array, tools: &[Scene]) -> Result<Self, FigureError> {
        let psf = Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 };
        let [.., thickest] = COVERINGS;
        let model = uniform(array.clone(), psf)?;
        let image = |tool: &Scene| {
            let (rotation_deg, depth_mm) = pose(*tool);
            let indenter = Indenter::Mesh(Arc::new(tool.mesh()));
            let contact = Contact { indenter, position_mm: middle_mm(&array), rotation_deg, depth_mm };
            let mut indentation_mm = vec![0.0; array.elements()];
            model.indentation(&contact, thickest, &mut indentation_mm);
            zero_to_one(&indentation_mm)
        };
        let images = tools.iter().map(image).collect();
        Ok(Self { array, images })
    }
}

/// Rotation in degrees and depth in mm at which a tool fits on the smallest array and all of its visible shape presses.
pub(super) fn pose(tool: Scene) -> (f64, f64) {
    match tool {
        Scene::H => (0.0, 0.5),
        Scene::Wrench => (90.0, 0.5),
        Scene::Spaceship => (90.0, 1.2),
    }
}

/// Draws tools (rows) on arrays (columns), all to the same scale.
pub fn resolutions(tools: &[&str], resolutions: &[Resolution]) -> Sheet {
    const PX_PER_MM: f64 = 9.6;
    const LEFT_PX: f64 = 88.0;
    const TOP_PX: f64 = 46.0;
    const STEP_X_PX: f64 = 252.0;
    const STEP_Y_PX: f64 = 180.0;
    let below_px = TOP_PX + STEP_Y_PX * tools.len() as f64;
    let mut sheet = Sheet::new("Three tools on three resolutions", [842.0, below_px + 44.0]);
    for (row, tool) in tools.iter().enumerate() {
        let middle_px = TOP_PX + STEP_Y_PX * (row as f64 + 0.5);
        sheet.put([0.0, middle_px + 4.0], &Label::new(*tool).heading());
    }
    for (col, Resolution { array, images }) in resolutions.iter().enumerate() {
        let middle_px = LEFT_PX + STEP_X_PX * (col as f64 + 0.5);
        let (rows, cols) = (array.rows(), array.cols());
        let per_cm2 = number((10.0 / array.pitch_mm()).powi(2), 0);
        let below = format!("{cols} \u{d7} {rows} elements, {per_cm2} per cm\u{b2}");
        sheet.put([middle_px, 10.0], &Label::new(array.name()).heading().centred());
        sheet.put([middle_px, 27.0], &Label::new(below).muted().centred());
        let cell_px = PX_PER_MM * array.pitch_mm();
        for (row, (values, tool)) in images.iter().zip(tools).enumerate() {
            let centre_px = [middle_px, TOP_PX + STEP_Y_PX * (row as f64 + 0.5)];
            let corner_px =
                [centre_px[0] - cell_px * cols as f64 / 2.0, centre_px[1] - cell_px * rows as f64 / 2.0];
            let heat = HeatMap { values, rows, cols };
            let title = format!("{tool} on {}", array.name());
            sheet.put(corner_px, &Image { heat, cell_px, scale: Scale::new(0.0, 1.0), title });
        }
    }
    let bar =
        ColourBar { scale: Scale::new(0.0, 1.0), title: "each image from its least to its greatest".into() };
    sheet.put([LEFT_PX - 12.0, below_px + 10.0], &bar);
    sheet
}

pub(super) fn draw() -> Result<Drawing, FigureError> {
    let arrays = Array::shipped().into_iter().map(|array| Resolution::new(array, &SCENES));
    let sheet = resolutions(&["H", "wrench", "spaceship"], &arrays.collect::<Result<Vec<_>, _>>()?);
    let caption = "The H, the wrench and the spaceship on arrays of the resolution of the paper's sensor, of the human \
                   fingertip and of the Tekscan sensor 5027, all to the same scale. The spread is one element width \
                   everywhere and all elements are identical; each image is scaled to 0 to 1. Finer \
                   elements show more of the jaw, the hexagon and the wings."
        .into();
    Ok(Drawing { sheet, caption })
}
