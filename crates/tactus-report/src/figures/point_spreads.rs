//! Figure 5b: the point spread functions of the coverings.

use std::{f64::consts::PI, fmt};

use tactus_model::{Covering, DIGITACTS_PITCH_MM, Psf};

use super::{COVERINGS, Drawing, FigureError, inches};
use crate::plot::{Axis, Figure, HeatMap, Image, Ink, Label, Panel, Scale, Series, Sheet};

/// Draws the Gaussian of each covering as a profile of unit volume and as an image on its own scale. Lengths are in
/// pitches.
pub fn point_spreads(psf: Psf, pitch_mm: f64, coverings: &[Covering]) -> Sheet {
    let spread = |covering: &Covering| (inches(*covering), psf.sigma_mm(*covering) / pitch_mm);
    profiles(&coverings.iter().map(spread).collect::<Vec<_>>())
}

/// Draws Gaussians of spreads in pitches, each with its covering's name.
pub(crate) fn profiles(spreads: &[(String, f64)]) -> Sheet {
    const INKS: [Ink; 5] = [Ink::Blue, Ink::Green, Ink::Amber, Ink::Red, Ink::Text];
    const PIXELS: u32 = 60;
    const CELL_PX: f64 = 2.0;
    const IMAGE_PX: f64 = CELL_PX * PIXELS as f64;
    let widest = spreads.iter().map(|(_, sigma)| *sigma).fold(0.0, f64::max);
    let half_pitches = (2.5 * widest).ceil().max(6.0);
    let mut figure = Figure::new(
        "Profiles",
        Axis::new("distance from the press", "element widths").spanning([-half_pitches, half_pitches]),
        Axis::new("share of the signal", "per element width squared").from_zero(),
    )
    .size_px([640.0, 340.0]);
    let mut images = Vec::new();
    for ((name, sigma), ink) in spreads.iter().zip(INKS.into_iter().cycle()) {
        let sigma = *sigma;
        let spread = |r: f64| (-r * r / (2.0 * sigma * sigma)).exp();
        let at = |step: u32, steps: u32| half_pitches * (2.0 * f64::from(step) / f64::from(steps) - 1.0);
        let profile =
            (0..=240).map(|step| at(step, 240)).map(|r| [r, spread(r) / (2.0 * PI * sigma * sigma)]);
        let series = Series::line(profile.collect()).ink(ink).width_px(2.0);
        figure = figure.with(series.label(name));
        #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
        let pixel = |y: f64, x: f64| spread(x.hypot(y)) as f32;
        let centre = |step: u32| at(2 * step + 1, 2 * PIXELS);
        let values: Vec<f32> =
            (0..PIXELS).flat_map(|row| (0..PIXELS).map(move |col| pixel(centre(row), centre(col)))).collect();
        images.push((format!("{name}: \u{3c3} = {sigma:.2}"), sigma, values));
    }
    let height_px = 340_f64.max(20.0 + 156.0 * images.len().div_ceil(2) as f64);
    let mut sheet = Sheet::new("Point spread functions of the coverings", [926.0, height_px]);
    sheet.put([0.0, 0.0], &figure);
    for (nth, (title, sigma, values)) in images.iter().enumerate() {
        let [x, y] = [658.0 + 148.0 * (nth % 2) as f64, 20.0 + 156.0 * (nth / 2) as f64];
        sheet.put([x, y - 8.0], &Label::new(title));
        let heat = HeatMap { values, rows: PIXELS as usize, cols: PIXELS as usize };
        sheet.put(
            [x, y],
            &Image { heat, cell_px: CELL_PX, scale: Scale::new(0.0, 1.0), title: title.clone() },
        );
        let px_per_pitch = IMAGE_PX / (2.0 * half_pitches);
        sheet.put([x + IMAGE_PX / 2.0, y + IMAGE_PX / 2.0], &Ring { radius_px: sigma * px_per_pitch });
    }
    sheet
}

/// A circle about its origin, on an image.
struct Ring {
    radius_px: f64,
}

impl Panel for Ring {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            r##"<circle r="{:.2}" fill="none" stroke="#ffffff" stroke-width="1.2" stroke-dasharray="3 3"/>"##,
            self.radius_px
        )
    }
}

#[expect(clippy::unnecessary_wraps, reason = "as all figures are drawn")]
pub(super) fn draw() -> Result<Drawing, FigureError> {
    let caption = "The spread of a point press under each covering, by Eq. 4. Left: cuts through the Gaussians, each of \
                   unit volume, so that a wider one is lower. Right: the same from above over 12 element widths, each on \
                   its own scale from zero to one; the ring stands one \u{3c3} (in element widths of 2.0 mm) from the \
                   press."
        .into();
    Ok(Drawing { sheet: point_spreads(Psf::PAPER, DIGITACTS_PITCH_MM, &COVERINGS), caption })
}
