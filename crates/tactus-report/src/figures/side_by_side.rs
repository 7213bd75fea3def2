//! Figure 8: the H on the virtual sensor and in the model.

use std::sync::Arc;

use tactus_model::{Array, Contact, Covering, Indenter, Mesh, Psf};
use tactus_scene::shapes::Scene;

use super::{
    COVERINGS, Drawing, FigureError, inches, middle_mm, uniform,
    virtual_sensor::{GAIN_SPREAD, NOISE_COUNTS, VirtualSensor},
    zero_to_one,
};
use crate::plot::{ColourBar, HeatMap, Image, Label, Scale, Sheet, number};

/// Light enough for the full scale of the sensor.
const DEPTH_MM: f64 = 0.15;
const ANGLES_DEG: [f64; 6] = [0.0, 15.0, 30.0, 45.0, 60.0, 90.0];
const SEED: u64 = 8;

/// One contact as the virtual sensor and as the model image it.
#[derive(Debug, Clone, PartialEq)]
pub struct SideBySide {
    /// Heading above the images.
    pub heading: String,
    /// The virtual sensor's image, row-major, 0 to 1.
    pub sensor: Vec<f32>,
    /// The model's image, row-major, 0 to 1.
    pub model: Vec<f32>,
}

impl SideBySide {
    fn new(
        sensor: &mut VirtualSensor,
        heading: String,
        mesh: &Arc<Mesh>,
        rotation_deg: f64,
        covering: Covering,
    ) -> Result<Self, FigureError> {
        let array = Array::digitacts();
        let position_mm = middle_mm(&array);
        let indenter = Indenter::Mesh(Arc::clone(mesh));
        let contact = Contact { indenter, position_mm, rotation_deg, depth_mm: DEPTH_MM };
        let mut model = vec![0.0; array.elements()];
        uniform(array, Psf::PAPER)?.indentation(&contact, covering, &mut model);
        Ok(Self::scaled(heading, &sensor.indentation_mm(&contact, covering), &model))
    }

    /// Two images, row-major, each scaled to 0 to 1.
    pub fn scaled(heading: String, sensor: &[f64], model: &[f64]) -> Self {
        Self { heading, sensor: zero_to_one(sensor), model: zero_to_one(model) }
    }

    /// Largest difference of the two, in percent of their range.
    pub fn difference_percent(&self) -> f64 {
        let pairs = self.sensor.iter().zip(&self.model);
        100.0 * pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
    }
}

/// Draws contacts on the `DigiTacts` array side by side, the virtual sensor's image above the model's.
pub fn side_by_side(name: &str, contacts: &[SideBySide]) -> Sheet {
    const CELL_PX: f64 = 14.0;
    const LEFT_PX: f64 = 108.0;
    const TOP_PX: f64 = 24.0;
    const STEP_X_PX: f64 = 124.0;
    const STEP_Y_PX: f64 = 96.0;
    let array = Array::digitacts();
    let [rows, cols] = [array.rows(), array.cols()];
    let [width_px, height_px] = [cols, rows].map(|count| CELL_PX * count as f64);
    let mut sheet = Sheet::new(
        name,
        [LEFT_PX + STEP_X_PX * contacts.len().max(5) as f64 - 12.0, TOP_PX + 2.0 * STEP_Y_PX + 56.0],
    );
    for (row, [name, below]) in [["virtual sensor", "simulated"], ["model", ""]].into_iter().enumerate() {
        let middle_px = TOP_PX + STEP_Y_PX * row as f64 + height_px / 2.0;
        sheet.put([0.0, middle_px], &Label::new(name).heading());
        sheet.put([0.0, middle_px + 16.0], &Label::new(below).muted());
    }
    for (col, contact) in contacts.iter().enumerate() {
        let x = LEFT_PX + STEP_X_PX * col as f64;
        let middle_px = x + width_px / 2.0;
        sheet.put([middle_px, TOP_PX - 10.0], &Label::new(&contact.heading).heading().centred());
        for (row, values) in [&contact.sensor, &contact.model].into_iter().enumerate() {
            let heat = HeatMap { values, rows, cols };
            let title = contact.heading.clone();
            let at_px = [x, TOP_PX + STEP_Y_PX * row as f64];
            sheet.put(at_px, &Image { heat, cell_px: CELL_PX, scale: Scale::new(0.0, 1.0), title });
        }
        let differs = format!("differs by {} %", number(contact.difference_percent(), 1));
        let below_px = TOP_PX + STEP_Y_PX + height_px + 16.0;
        sheet.put([middle_px, below_px], &Label::new(differs).muted().centred());
    }
    let bar =
        ColourBar { scale: Scale::new(0.0, 1.0), title: "each image from its least to its greatest".into() };
    sheet.put([LEFT_PX - 12.0, TOP_PX + 2.0 * STEP_Y_PX + 22.0], &bar);
    sheet
}

pub(super) fn draw_angles() -> Result<Drawing, FigureError> {
    let caption = format!(
        "The H in the middle of the array at several angles from upright, counter-clockwise, under the thinnest covering. \
         Above: the virtual sensor, which replaces the paper's; simulated, with gains that differ by {} %, {} \
         counts of noise and a 12-bit converter, averaged over 250 ms and corrected by the linear response fitted \
         to each element. Below: the model. Each image is scaled to 0 to 1; the largest difference of the two is at the \
         bottom.",
        100.0 * GAIN_SPREAD,
        NOISE_COUNTS
    );
    Ok(Drawing { sheet: side_by_side("The H at several angles", &angles()?), caption })
}

pub(super) fn draw_coverings() -> Result<Drawing, FigureError> {
    let caption = "The H upright under each of the four coverings, as in Figure 8a. A thicker covering spreads the image more, \
                   on the virtual sensor and in the model. By Eq. 4 the spread is 1.36 element \
                   widths even under the thinnest covering, so the two strokes, 3 widths apart, already merge."
        .into();
    Ok(Drawing { sheet: side_by_side("The H under each covering", &coverings()?), caption })
}

/// The H at each angle under the thinnest covering.
pub(super) fn angles() -> Result<Vec<SideBySide>, FigureError> {
    contacts(&ANGLES_DEG.map(|angle_deg| (format!("{angle_deg}\u{b0}"), angle_deg, COVERINGS[0])))
}

/// The H upright under each covering.
pub(super) fn coverings() -> Result<Vec<SideBySide>, FigureError> {
    contacts(&COVERINGS.map(|covering| (inches(covering), 0.0, covering)))
}

/// The H with a heading, at an angle under a covering.
fn contacts(cases: &[(String, f64, Covering)]) -> Result<Vec<SideBySide>, FigureError> {
    let mut sensor = VirtualSensor::new(Array::digitacts(), SEED)?;
    let mesh = Arc::new(Scene::H.mesh());
    let one = |(heading, angle_deg, covering): &(String, f64, Covering)| {
        SideBySide::new(&mut sensor, heading.clone(), &mesh, *angle_deg, *covering)
    };
    cases.iter().map(one).collect()
}
