//! Colour scales.

use std::fmt;

use super::axis::{AxisScale, number};
use super::{Axis, Panel};
use crate::markup::Text;

/// Number of colours in a scale.
const LEVELS: u8 = 48;

/// Viridis at nine equally spaced positions. It is perceptually uniform, also in grey and for the colour-blind.
///
/// # Source
/// van der Walt and Smith's colour map of that name, released under CC0.
const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// A range of values mapped to colours; values beyond its ends have the colours of the ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    lo: f64,
    hi: f64,
}

impl Scale {
    /// A scale over a range. An empty range is extended upwards by one.
    pub fn new(lo: f64, hi: f64) -> Self {
        if hi > lo { Self { lo, hi } } else { Self { lo, hi: lo + 1.0 } }
    }

    /// From zero (or the least value, if clearly negative) to the greatest value; 0 to 1 without values.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let (lo, hi) = values
            .filter(|value| value.is_finite())
            .fold((0.0_f64, 0.0_f64), |(lo, hi), value| (lo.min(value), hi.max(value)));
        // Noise below zero does not extend the scale.
        let lo = if -lo < 0.05 * hi { 0.0 } else { lo };
        Self::new(lo, hi)
    }

    /// Index of a value's colour; `None` for NaN.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and LEVELS - 1")]
    pub(super) fn level(self, value: f64) -> Option<u8> {
        let share = (value - self.lo) / (self.hi - self.lo);
        (!share.is_nan()).then(|| (share * f64::from(LEVELS)).clamp(0.0, f64::from(LEVELS - 1)) as u8)
    }
}

/// True if black shows better than white on the colour with an index: the map's lightness rises evenly from 15 to 91 of 100.
pub(super) fn is_bright(level: u8) -> bool {
    level >= LEVELS / 2
}

/// The colour with an index as `#rrggbb`.
pub(super) fn colour(level: u8) -> String {
    let [r, g, b] = rgb(level);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The colour with an index: red, green, blue.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 255")]
pub(super) fn rgb(level: u8) -> [u8; 3] {
    let place = f64::from(level.min(LEVELS - 1)) / f64::from(LEVELS - 1) * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let share = place - below as f64;
    std::array::from_fn(|channel| {
        (VIRIDIS[below][channel] * (1.0 - share) + VIRIDIS[below + 1][channel] * share).round() as u8
    })
}

/// A legend of a colour scale; displays itself as SVG.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourBar {
    /// The scale that is shown.
    pub scale: Scale,
    /// Quantity and unit of the values.
    pub title: String,
}

/// Margin at both ends of a colour bar for tick labels.
const LEFT_PX: f64 = 12.0;
/// Width of one colour.
const STEP_PX: f64 = 6.0;

impl fmt::Display for ColourBar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all_px = STEP_PX * f64::from(LEVELS) + 2.0 * LEFT_PX + 260.0;
        write!(
            f,
            r#"<svg class="figure" viewBox="0 0 {all_px} 34" width="{all_px}" height="34" role="img"><title>colour scale</title>"#
        )?;
        self.draw(f)?;
        f.write_str("</svg>")
    }
}

impl Panel for ColourBar {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width_px = STEP_PX * f64::from(LEVELS);
        f.write_str(r#"<g class="cells">"#)?;
        for level in 0..LEVELS {
            let x = LEFT_PX + STEP_PX * f64::from(level);
            write!(f, r#"<path fill="{}" d="M{x} 2h{STEP_PX}v12h-{STEP_PX}z"/>"#, colour(level))?;
        }
        f.write_str("</g>")?;
        let Scale { lo, hi } = self.scale;
        let ticks: AxisScale = Axis::new("", "").spanning([lo, hi]).scale(std::iter::empty(), 5.0);
        for tick in &ticks.ticks {
            let x = LEFT_PX + ticks.share(*tick) * width_px;
            write!(
                f,
                r#"<path class="axis" d="M{x:.1} 14v4"/><text class="x" x="{x:.1}" y="30">{}</text>"#,
                ticks.label(*tick)
            )?;
        }
        let beside = width_px + LEFT_PX + 14.0;
        write!(f, r#"<text class="name" x="{beside}" y="12">{}</text>"#, Text(&self.title))?;
        if ticks.spans_range() {
            return Ok(());
        }
        write!(f, r#"<text x="{beside}" y="30">{} to {}</text>"#, number(lo, 0), number(hi, 0))
    }
}

#[cfg(test)]
#[path = "colour_tests.rs"]
mod tests;
