//! Figure 4: one press in four imaging models.

use tactus_model::{Array, Contact, Covering, Psf};
use tactus_solid::fem::Bricks;

use super::{
    COVERINGS, Drawing, FigureError, REFERENCE_INDENTER, inches, uniform, virtual_sensor::VirtualSensor,
};
use crate::plot::{ColourBar, HeatMap, Image, Label, Scale, Sheet, number};

/// Poisson's ratio of the covering: rubber is nearly incompressible.
const POISSON_RATIO: f64 = 0.49;
/// Bricks along a side and layers of them, under each covering.
const ACROSS: u32 = 480;
const LAYERS: u32 = 40;
/// Depth of the press, as a share of the covering's thickness (paper, Sec. 3.1).
const DEPTH_SHARE: f64 = 0.3;
const SEED: u64 = 4;

/// One press of the 1 mm cylinder, imaged by four models.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelledPress {
    /// The pressed covering.
    pub covering: Covering,
    /// Position of the press in words.
    pub place: &'static str,
    /// Spread of the Gaussian fitted to the finite elements' response to a point.
    pub fitted_sigma_mm: f64,
    /// Spread of Eq. 4.
    pub sigma_mm: f64,
    /// Row-major images, each with its peak at 1: finite elements, fitted Gaussian, Gaussian of Eq. 4, virtual sensor.
    pub images: [Vec<f64>; 4],
}

impl ModelledPress {
    /// Images a press at a position of the `DigiTacts` array under a covering.
    pub(super) fn new(
        covering: Covering,
        place: &'static str,
        position_mm: [f64; 2],
    ) -> Result<Self, FigureError> {
        let array = Array::digitacts();
        let bricks = Bricks::cubes(ACROSS, LAYERS, covering.thickness_mm / f64::from(LAYERS), POISSON_RATIO)?;
        let fitted = Psf { sigma_intercept_mm: bricks.under_point().gaussian_sigma_mm(), sigma_per_mm: 0.0 };
        let depth_mm = DEPTH_SHARE * covering.thickness_mm;
        let contact = Contact { indenter: REFERENCE_INDENTER, position_mm, rotation_deg: 0.0, depth_mm };

        let reaction = bricks.under_disc(1.0)?;
        let [width_mm, height_mm] = array.element_mm();
        let elastic = (0..array.elements()).filter_map(|element| array.centre_mm(element)).map(|[x, y]| {
            let side = |away_mm: f64, size_mm: f64| [away_mm - size_mm / 2.0, away_mm + size_mm / 2.0];
            reaction.force_on([side(x - position_mm[0], width_mm), side(y - position_mm[1], height_mm)])
        });
        let gaussian = |psf| {
            let mut image = vec![0.0; array.elements()];
            uniform(array.clone(), psf)?.indentation(&contact, covering, &mut image);
            Ok::<_, FigureError>(image)
        };
        let images = [
            elastic.collect(),
            gaussian(fitted)?,
            gaussian(Psf::PAPER)?,
            VirtualSensor::new(array.clone(), SEED)?.indentation_mm(&contact, covering),
        ];
        Ok(Self {
            covering,
            place,
            fitted_sigma_mm: fitted.sigma_intercept_mm,
            sigma_mm: Psf::PAPER.sigma_mm(covering),
            images: images.map(peak_one),
        })
    }

    /// Largest difference between two of the images, in percent of the peak.
    pub fn difference_percent(&self, one: usize, other: usize) -> f64 {
        let [one, other] = [one, other].map(|image| self.images[image].iter());
        100.0 * one.zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

/// Draws presses on the `DigiTacts` array in rows of four images, with the largest difference from the finite elements'
/// image below each.
pub fn imaging_models(presses: &[ModelledPress]) -> Sheet {
    const CELL_PX: f64 = 19.0;
    const LEFT_PX: f64 = 118.0;
    const TOP_PX: f64 = 40.0;
    const STEP_X_PX: f64 = 182.0;
    const STEP_Y_PX: f64 = 166.0;
    let array = Array::digitacts();
    let [rows, cols] = [array.rows(), array.cols()];
    let [width_px, height_px] = [cols, rows].map(|count| CELL_PX * count as f64);
    let below_px = TOP_PX + STEP_Y_PX * presses.len() as f64;
    let mut sheet = Sheet::new("One press through four imaging models", [818.0, below_px + 34.0]);
    let headings = [
        ["finite elements", "elastic, bonded"],
        ["Gaussian", "fitted to the finite elements"],
        ["Gaussian", "of the paper's Eq. 4"],
        ["virtual sensor", "simulated, with Eq. 4"],
    ];
    for (col, [heading, below]) in headings.into_iter().enumerate() {
        let middle_px = LEFT_PX + STEP_X_PX * col as f64 + width_px / 2.0;
        sheet.put([middle_px, 10.0], &Label::new(heading).heading().centred());
        sheet.put([middle_px, 26.0], &Label::new(below).muted().centred());
    }
    for (row, press) in presses.iter().enumerate() {
        let y = TOP_PX + STEP_Y_PX * row as f64;
        sheet.put([0.0, y + height_px / 2.0 - 4.0], &Label::new(inches(press.covering)).heading());
        sheet.put([0.0, y + height_px / 2.0 + 13.0], &Label::new(press.place).muted());
        for (col, image) in press.images.iter().enumerate() {
            let x = LEFT_PX + STEP_X_PX * col as f64;
            #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
            let values: Vec<f32> = image.iter().map(|value| *value as f32).collect();
            let heat = HeatMap { values: &values, rows, cols };
            let title = format!("{}, {} {}", headings[col].join(" "), inches(press.covering), press.place);
            sheet.put([x, y], &Image { heat, cell_px: CELL_PX, scale: Scale::new(0.0, 1.0), title });
            let percent = |one, other| format!("{} %", number(press.difference_percent(one, other), 1));
            let below = match col {
                0 => ["reference".into(), String::new()],
                1 => [percent(1, 0), format!("\u{3c3} = {:.2} mm", press.fitted_sigma_mm)],
                2 => [percent(2, 0), format!("\u{3c3} = {:.2} mm", press.sigma_mm)],
                _ => [percent(3, 0), format!("{} from Eq. 4", percent(3, 2))],
            };
            for (line, text) in below.into_iter().enumerate() {
                let at_px = [x + width_px / 2.0, y + height_px + 16.0 + 15.0 * line as f64];
                sheet.put(at_px, &Label::new(text).muted().centred());
            }
        }
    }
    let bar = ColourBar { scale: Scale::new(0.0, 1.0), title: "share of each image's own peak".into() };
    sheet.put([LEFT_PX - 12.0, below_px], &bar);
    let note = "below each: largest difference from the finite elements, of the peak";
    sheet.put([LEFT_PX + 305.0, below_px + 30.0], &Label::new(note).muted());
    sheet
}

pub(super) fn draw() -> Result<Drawing, FigureError> {
    let array = Array::digitacts();
    let [x, y] = array.centre_mm(2 * array.cols() + 3).unwrap_or_default();
    let [thinnest, .., thickest] = COVERINGS;
    let presses = [
        ModelledPress::new(thinnest, "element's centre", [x, y])?,
        ModelledPress::new(thinnest, "between four", [x - 1.0, y + 1.0])?,
        ModelledPress::new(thickest, "element's centre", [x, y])?,
        ModelledPress::new(thickest, "between four", [x - 1.0, y + 1.0])?,
    ];
    let most = |one, other| {
        let differences = presses.iter().map(|press| press.difference_percent(one, other));
        number(differences.fold(0.0, f64::max), 1)
    };
    let caption = format!(
        "The 1 mm cylinder, imaged by the 6 x 8 array at the centre of an element and between four of them, under the \
         thinnest and the thickest covering. Below each image is its largest difference from the finite elements' image, \
         in percent of the peak. The mesh has {ACROSS} x {ACROSS} x {LAYERS} cubes, bonded to the base, with a Poisson's ratio of \
         {POISSON_RATIO}; its images are within 0.2 % of those of the elastic layer that it represents. \
         After the elements integrate the forces, a Gaussian fitted to the response to a point is within {} %, so a point \
         spread function describes the covering well, as the paper found. The spread of Eq. 4 is larger: it includes \
         the sensor's own spread of 1.11 element widths, which no elastic covering explains. The virtual sensor \
         replaces the paper's; it is simulated with Eq. 4, different gains, noise and a converter, and corrected by its linear \
         response. It agrees with Eq. 4 within {} % by construction, which says nothing about a real sensor.",
        most(1, 0),
        most(3, 2)
    );
    Ok(Drawing { sheet: imaging_models(&presses), caption })
}

/// Scaled so that the greatest value is 1.
fn peak_one(image: Vec<f64>) -> Vec<f64> {
    let peak = image.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    image.into_iter().map(|value| value / peak).collect()
}
