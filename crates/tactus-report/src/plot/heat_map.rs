//! Images of the array with one value per element.

use std::{collections::BTreeMap, fmt};

use super::colour::{colour, is_bright};
use super::{Panel, Scale};
use crate::markup::Text;

/// Squares that are smaller have no numbers.
const NUMBERED_PX: f64 = 22.0;

/// One value for each of `rows x cols` elements, row-major. Row 0 is drawn at the bottom, because y points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatMap<'a> {
    /// The values; NaN is not drawn.
    pub values: &'a [f32],
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
}

/// A heat map with its own colour scale, for a [`Sheet`](super::Sheet); the origin is its upper left corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<'a> {
    /// Values of the elements, row-major.
    pub heat: HeatMap<'a>,
    /// Side of an element's square.
    pub cell_px: f64,
    /// Colour scale, with its limits in the unit of the values.
    pub scale: Scale,
    /// Tooltip.
    pub title: String,
}

/// The number of each element on an [`Image`] with the same origin, in a colour that its square lets show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementNumbers<'a> {
    /// The image's values.
    pub heat: HeatMap<'a>,
    /// Side of an element's square; of small squares nothing is drawn.
    pub cell_px: f64,
    /// The image's colour scale.
    pub scale: Scale,
}

/// A heat map at a position in a [`Mosaic`].
#[derive(Debug, Clone, PartialEq)]
pub struct Tile<'a> {
    /// Upper left corner.
    pub at_px: [f64; 2],
    /// Values of the elements, row-major.
    pub heat: HeatMap<'a>,
    /// Tooltip.
    pub title: String,
}

/// Many heat maps with one colour scale, and captions; displays itself as SVG.
#[derive(Debug, Clone, PartialEq)]
pub struct Mosaic<'a> {
    /// Title for screen readers.
    pub name: String,
    /// Total width and height.
    pub size_px: [f64; 2],
    /// Side of an element's square.
    pub cell_px: f64,
    /// Colour scale that all tiles share.
    pub scale: Scale,
    /// One image each, from left to right.
    pub tiles: Vec<Tile<'a>>,
    /// Texts with their lower left corners.
    pub captions: Vec<([f64; 2], String)>,
}

impl Panel for Image<'_> {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { heat, cell_px, scale, title } = self;
        write!(f, r#"<g class="cells" transform="scale({cell_px})"><title>{}</title>"#, Text(title))?;
        heat.write(f, *scale)?;
        f.write_str("</g>")
    }
}

impl Panel for ElementNumbers<'_> {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { heat, cell_px, scale } = self;
        if *cell_px < NUMBERED_PX {
            return Ok(());
        }
        for (element, value) in heat.values.iter().enumerate().take(heat.rows * heat.cols) {
            let x = cell_px * (0.5 + (element % heat.cols) as f64);
            let y = cell_px * (0.5 + (heat.rows - 1 - element / heat.cols) as f64) + 4.0;
            let class = match scale.level(f64::from(*value)) {
                Some(level) if is_bright(level) => "on-bright",
                Some(_) => "on-dark",
                None => "note",
            };
            write!(
                f,
                r#"<text class="{class}" text-anchor="middle" x="{x:.1}" y="{y:.1}">{element}</text>"#
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for Mosaic<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size_px;
        write!(
            f,
            r#"<svg class="figure" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img"><title>{}</title>"#,
            Text(&self.name)
        )?;
        for ([x, y], text) in &self.captions {
            write!(f, r#"<text x="{x}" y="{y}" font-size="10">{}</text>"#, Text(text))?;
        }
        f.write_str(r#"<g class="cells">"#)?;
        for tile in &self.tiles {
            let [x, y] = tile.at_px;
            write!(
                f,
                r#"<g transform="translate({x} {y}) scale({})"><title>{}</title>"#,
                self.cell_px,
                Text(&tile.title)
            )?;
            tile.heat.write(f, self.scale)?;
            f.write_str("</g>")?;
        }
        f.write_str("</g></svg>")
    }
}

impl HeatMap<'_> {
    /// Writes one path per colour, with cells of one unit.
    fn write(&self, f: &mut fmt::Formatter<'_>, scale: Scale) -> fmt::Result {
        let mut cells: BTreeMap<u8, Vec<[usize; 2]>> = BTreeMap::new();
        for (index, value) in self.values.iter().enumerate().take(self.rows * self.cols) {
            if let Some(level) = scale.level(f64::from(*value)) {
                cells.entry(level).or_default().push([index % self.cols, self.rows - 1 - index / self.cols]);
            }
        }
        for (level, cells) in cells {
            write!(f, r#"<path fill="{}" d=""#, colour(level))?;
            for [x, y] in cells {
                write!(f, "M{x} {y}h1v1h-1z")?;
            }
            f.write_str(r#""/>"#)?;
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "heat_map_tests.rs"]
mod tests;
