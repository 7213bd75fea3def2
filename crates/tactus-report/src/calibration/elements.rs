//! Maps of the array: health and sensitivity of each element.

use std::fmt;

use tactus_calibrate::{FaultKind, Health, ResponseFit};
use tactus_model::Array;

use crate::{
    numbers::digits,
    plot::{ColourBar, HeatMap, Image, Label, Panel, Scale, Sheet},
};

/// Largest size of a map.
const MAP_PX: [f64; 2] = [336.0, 300.0];
/// Elements smaller than this show no number.
const NUMBERED_PX: f64 = 18.0;

/// The elements at their positions: faulty ones marked at their corners, unjudged ones dashed. A line goes from a
/// cross-wired element to the one whose signal it gives.
pub fn health_map(array: &Array, health: &Health) -> Sheet {
    let map = HealthMap { array, health };
    let [width, height] = map.size_px();
    let mut sheet = Sheet::new("Health of the elements", [width.max(MAP_PX[0]), height + 44.0]);
    sheet.put([0.0, 0.0], &map);
    for (nth, (state, name)) in [
        (ElementState::Sound, "sound"),
        (ElementState::Faulty, "faulty"),
        (ElementState::NotJudged, "not judged"),
    ]
    .into_iter()
    .enumerate()
    {
        let x = 104.0 * nth as f64;
        sheet.put([x, height + 22.0], &state);
        sheet.put([x + 23.0, height + 34.0], &Label::new(name));
    }
    sheet
}

/// The sensitivity of each element as a colour; an element without one stays blank.
pub fn sensitivity_map(array: &Array, response: &ResponseFit) -> Sheet {
    let (rows, cols) = (array.rows(), array.cols());
    let sensitivities = || response.elements.iter().map(|one| one.sensitivity_counts_per_mm.value);
    let [lo, hi] =
        sensitivities().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], s| [lo.min(s), hi.max(s)]);
    let scale = if lo <= hi { Scale::new(lo, hi) } else { Scale::new(0.0, 1.0) };
    let mut values = vec![f32::NAN; array.elements()];
    for one in &response.elements {
        if let Some(value) = values.get_mut(one.element) {
            #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
            {
                *value = one.sensitivity_counts_per_mm.value as f32;
            }
        }
    }
    let cell_px = (416.0 / cols as f64).min(300.0 / rows as f64).clamp(1.0, 44.0);
    let title = format!("{} to {} counts/mm", digits(lo, 4), digits(hi, 4));
    let (width, height) = (cell_px * cols as f64, cell_px * rows as f64);
    let mut sheet = Sheet::new("Sensitivity of the elements", [width.max(440.0), height + 48.0]);
    sheet.put([0.0, 0.0], &Image { heat: HeatMap { values: &values, rows, cols }, cell_px, scale, title });
    sheet.put([-12.0, height + 12.0], &ColourBar { scale, title: "counts per mm".into() });
    sheet
}

struct HealthMap<'a> {
    array: &'a Array,
    health: &'a Health,
}

#[derive(Clone, Copy)]
enum ElementState {
    Sound,
    Faulty,
    NotJudged,
}

impl HealthMap<'_> {
    fn px_per_mm(&self) -> f64 {
        let [width, height] = self.array.extent_mm().map(|[least, most]| most - least);
        (MAP_PX[0] / width).min(MAP_PX[1] / height)
    }

    fn size_px(&self) -> [f64; 2] {
        self.array.extent_mm().map(|[least, most]| (most - least) * self.px_per_mm())
    }

    /// The middle of an element; y points up on the sensor and down on the page.
    fn centre_px(&self, element: usize) -> Option<[f64; 2]> {
        let [x, y] = self.array.centre_mm(element)?;
        let [[left, _], [_, back]] = self.array.extent_mm();
        Some([(x - left) * self.px_per_mm(), (back - y) * self.px_per_mm()])
    }

    fn state(&self, element: usize) -> ElementState {
        if self.health.faults.iter().any(|fault| fault.element == element) {
            ElementState::Faulty
        } else if self.health.not_judged.contains(&element) {
            ElementState::NotJudged
        } else {
            ElementState::Sound
        }
    }
}

impl Panel for HealthMap<'_> {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Slightly smaller, so that outlines do not overlap.
        let size_px = self.array.element_mm().map(|side| (side * self.px_per_mm() - 2.0).max(1.0));
        for element in 0..self.array.elements() {
            let Some([x, y]) = self.centre_px(element) else { continue };
            self.state(element).square(f, [x - size_px[0] / 2.0, y - size_px[1] / 2.0], size_px)?;
            if size_px[0].min(size_px[1]) >= NUMBERED_PX {
                write!(f, r#"<text class="x note" x="{x:.1}" y="{:.1}">{element}</text>"#, y + 4.0)?;
            }
        }
        for fault in &self.health.faults {
            let FaultKind::CrossWired { answers_for } = fault.kind else { continue };
            let (Some([x0, y0]), Some([x1, y1])) =
                (self.centre_px(fault.element), self.centre_px(answers_for))
            else {
                continue;
            };
            // Beside the elements' numbers.
            let aside = 0.3 * size_px[0].min(size_px[1]) / (x1 - x0).hypot(y1 - y0).max(1.0);
            let [dx, dy] = [aside * (y0 - y1), aside * (x1 - x0)];
            let [x0, y0, x1, y1] = [x0 + dx, y0 + dy, x1 + dx, y1 + dy];
            write!(
                f,
                r#"<path class="line blue" stroke-width="2" d="M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}"/><path class="dots blue" stroke-width="7" d="M{x1:.1} {y1:.1}h0"/>"#
            )?;
        }
        Ok(())
    }
}

impl Panel for ElementState {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.square(f, [0.0; 2], [16.0; 2])
    }
}

impl ElementState {
    /// Draws a square with its upper left corner at a position.
    fn square(self, f: &mut fmt::Formatter<'_>, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> fmt::Result {
        let style = match self {
            Self::Sound => r#"class="line muted" stroke-opacity="0.5""#,
            Self::Faulty => r#"class="line red" stroke-width="2""#,
            Self::NotJudged => r#"class="line amber" stroke-width="1.5" stroke-dasharray="3 3""#,
        };
        write!(f, r#"<path {style} d="M{x:.1} {y:.1}h{width:.1}v{height:.1}h-{width:.1}z"#)?;
        if matches!(self, Self::Faulty) {
            // Short strokes from each corner, which leave the number readable.
            let [dx, dy] = [0.28 * width, 0.28 * height];
            for [right, down] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                let corner = [x + right * width, y + down * height];
                let inwards = [dx * (1.0 - 2.0 * right), dy * (1.0 - 2.0 * down)];
                write!(f, "M{:.1} {:.1}l{:.1} {:.1}", corner[0], corner[1], inwards[0], inwards[1])?;
            }
        }
        f.write_str(r#""/>"#)
    }
}
