//! Figures 9b and 10b: oblique views of tools and sensor.

use tactus_model::{Array, Covering};
use tactus_scene::shapes::{Scene, Surface};

use super::{COVERINGS, Drawing, FigureError, inches, middle_mm};
use crate::plot::{Face, Label, ObliqueView, Paint, Sheet};

const BLUE: Paint = Paint { rgb: [66.0, 124.0, 226.0], opacity: 1.0 };
const YELLOW: Paint = Paint { rgb: [255.0, 220.0, 70.0], opacity: 0.42 };
const RED: Paint = Paint { rgb: [222.0, 62.0, 50.0], opacity: 1.0 };
const STEEL: Paint = Paint { rgb: [172.0, 182.0, 196.0], opacity: 1.0 };

/// Height of the blocks that represent the elements.
const BLOCK_MM: f64 = 1.2;
/// Border of the covering beyond the elements.
const BORDER_MM: f64 = 0.4;

/// Draws a tool pressed into the middle of a covered array: blue elements, translucent yellow covering, red tool.
pub fn pressed_view(array: &Array, covering: Covering, tool: &Surface, depth_mm: f64) -> Sheet {
    // The origin is in the middle of the undeformed surface.
    let [middle_x, middle_y] = middle_mm(array);
    let [[left, right], [front, back]] = array.extent_mm();
    let bottom = -covering.thickness_mm;
    let covering = Face::of_box(
        [
            [left - middle_x - BORDER_MM, right - middle_x + BORDER_MM],
            [front - middle_y - BORDER_MM, back - middle_y + BORDER_MM],
            [bottom, 0.0],
        ],
        YELLOW,
    );
    let [width, height] = array.element_mm().map(|size| size / 2.0);
    let blocks = (0..array.elements()).filter_map(|element| array.centre_mm(element)).map(|[x, y]| {
        let [x, y] = [x - middle_x, y - middle_y];
        Face::of_box([[x - width, x + width], [y - height, y + height], [bottom - BLOCK_MM, bottom]], BLUE)
    });
    let (tops, sides): (Vec<_>, Vec<_>) = blocks.map(|[top, sides @ ..]| (top, sides)).unzip();
    let tool = tool.corners_mm().map(|corners| Face {
        corners_mm: corners.map(|[x, y, z]| [x, y, z - depth_mm]).to_vec(),
        paint: RED,
    });
    // The covering is first and stays whole; the plane of the elements' tops separates them from the tool.
    let faces = covering.into_iter().chain(tops).chain(tool).chain(sides.into_iter().flatten()).collect();
    let view = ObliqueView { faces, azimuth_deg: -62.0, elevation_deg: 32.0, px_per_mm: 26.0 };
    let mut sheet = Sheet::new("The H in the covering", [690.0, 560.0]);
    sheet.put([345.0, 340.0], &view);
    sheet
}

/// Draws tools obliquely, each from above and from below, where the sensor meets it.
pub fn tools_view(tools: &[(&str, Surface)]) -> Sheet {
    const STEP_X_PX: f64 = 421.0;
    const STEP_Y_PX: f64 = 270.0;
    let mut sheet = Sheet::new("Wrench and spaceship", [842.0, STEP_Y_PX * tools.len() as f64]);
    for (row, (name, surface)) in tools.iter().enumerate() {
        let y = 12.0 + STEP_Y_PX * row as f64;
        for (col, (side, elevation_deg)) in
            [("from above", 38.0), ("from below", -38.0)].into_iter().enumerate()
        {
            let x = STEP_X_PX * col as f64;
            let faces =
                surface.corners_mm().map(|corners| Face { corners_mm: corners.to_vec(), paint: STEEL });
            let view =
                ObliqueView { faces: faces.collect(), azimuth_deg: -20.0, elevation_deg, px_per_mm: 23.0 };
            sheet.put([x, y], &Label::new(format!("{name}, {side}")).heading());
            sheet.put([x + STEP_X_PX / 2.0, y + STEP_Y_PX / 2.0 - 4.0], &view);
        }
    }
    sheet
}

#[expect(clippy::unnecessary_wraps, reason = "all figures have this signature")]
pub(super) fn draw_pressed() -> Result<Drawing, FigureError> {
    const DEPTH_SHARE: f64 = 0.3;
    let covering = COVERINGS[1];
    let depth_mm = DEPTH_SHARE * covering.thickness_mm;
    let caption = format!(
        "The H pressed into the sensor, drawn to scale. Blue: the 48 elements with their gaps. Yellow: the covering of {}. \
         Red: the H, which is {depth_mm:.2} mm deep in it.",
        inches(covering)
    );
    let sheet = pressed_view(&Array::digitacts(), covering, &Scene::H.surface(), depth_mm);
    Ok(Drawing { sheet, caption })
}

#[expect(clippy::unnecessary_wraps, reason = "all figures have this signature")]
pub(super) fn draw_tools() -> Result<Drawing, FigureError> {
    let tools = [Scene::Wrench, Scene::Spaceship].map(|tool| (tool.name(), tool.surface()));
    let caption = "The wrench and the spaceship of Figure 10a: left from above, right from below, where the \
                   sensor meets them. Both are shapes of our own."
        .into();
    Ok(Drawing { sheet: tools_view(&tools), caption })
}
