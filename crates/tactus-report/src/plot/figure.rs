//! A figure: two axes and series of points.

use std::fmt;

use super::{Axis, Panel, Series, axis::AxisScale, series::Mark};
use crate::markup::Text;

/// Margin left of the axes for tick labels and the title.
const LEFT_PX: f64 = 78.0;
/// Margin below the axes.
const BELOW_PX: f64 = 44.0;
/// Margin right of the axes for the last tick label.
const RIGHT_PX: f64 = 18.0;
/// Margin above the axes without and with a legend.
const ABOVE_PX: [f64; 2] = [12.0, 32.0];
/// Mean width of a letter in the legend.
const LETTER_PX: f64 = 6.4;

/// Two axes and series of points; displays itself as SVG.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    name: String,
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    size_px: [f64; 2],
}

impl Figure {
    /// An empty figure of 720 x 400 px; the name is its title for screen readers.
    pub fn new(name: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { name: name.into(), x, y, series: Vec::new(), size_px: [720.0, 400.0] }
    }

    /// Adds a series in front of the others.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Sets the total width and height.
    #[must_use]
    pub fn size_px(mut self, size_px: [f64; 2]) -> Self {
        self.size_px = size_px;
        self
    }

    /// Number of pixel columns between the axes' ends.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a size in pixels")]
    pub fn columns(&self) -> usize {
        (self.size_px[0] - LEFT_PX - RIGHT_PX).clamp(1.0, 10_000.0) as usize
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size_px;
        write!(
            f,
            r#"<svg class="figure" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img"><title>{}</title>"#,
            Text(&self.name)
        )?;
        self.draw(f)?;
        f.write_str("</svg>")
    }
}

impl Panel for Figure {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let area = PlotArea::new(self);
        area.grid(f)?;
        for series in &self.series {
            area.series(f, series)?;
        }
        area.axes(f, self)?;
        legend(f, &self.series)
    }
}

/// The area between the axes, in pixels.
struct PlotArea {
    x: AxisScale,
    y: AxisScale,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl PlotArea {
    fn new(figure: &Figure) -> Self {
        let [width, height] = figure.size_px;
        let legend = usize::from(figure.series.iter().any(|series| series.label.is_some()));
        let (left, right) = (LEFT_PX, width - RIGHT_PX);
        let (top, bottom) = (ABOVE_PX[legend], height - BELOW_PX);
        let along =
            |axis: usize| figure.series.iter().flat_map(move |s| s.points.iter().map(move |p| p[axis]));
        Self {
            x: figure.x.scale(along(0), ((right - left) / 90.0).max(4.0)),
            y: figure.y.scale(along(1), ((bottom - top) / 36.0).max(2.0)),
            left,
            right,
            top,
            bottom,
        }
    }

    /// A point in pixels; `None` if it is not finite.
    fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let across = self.left + self.x.share(x) * (self.right - self.left);
        let up = self.bottom - self.y.share(y) * (self.bottom - self.top);
        (across.is_finite() && up.is_finite()).then_some([across, up])
    }

    fn grid(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(r#"<path class="grid" d=""#)?;
        for tick in &self.y.ticks {
            let y = self.bottom - self.y.share(*tick) * (self.bottom - self.top);
            write!(f, "M{} {y:.1}H{}", self.left, self.right)?;
        }
        f.write_str(r#""/>"#)
    }

    fn axes(&self, f: &mut fmt::Formatter<'_>, figure: &Figure) -> fmt::Result {
        write!(f, r#"<path class="axis" d="M{} {}V{}H{}"#, self.left, self.top, self.bottom, self.right)?;
        let across = |tick: f64| self.left + self.x.share(tick) * (self.right - self.left);
        for tick in &self.x.ticks {
            write!(f, "M{:.1} {}v4", across(*tick), self.bottom)?;
        }
        f.write_str(r#""/>"#)?;
        for tick in &self.x.ticks {
            write!(
                f,
                r#"<text class="x" x="{:.1}" y="{}">{}</text>"#,
                across(*tick),
                self.bottom + 17.0,
                self.x.label(*tick)
            )?;
        }
        for tick in &self.y.ticks {
            let y = self.bottom - self.y.share(*tick) * (self.bottom - self.top) + 4.0;
            write!(
                f,
                r#"<text class="y" x="{}" y="{y:.1}">{}</text>"#,
                self.left - 7.0,
                self.y.label(*tick)
            )?;
        }
        let middle = f64::midpoint(self.left, self.right);
        write!(
            f,
            r#"<text class="x name" x="{middle}" y="{}">{}</text>"#,
            self.bottom + 37.0,
            Text(figure.x.title())
        )?;
        let middle = f64::midpoint(self.top, self.bottom);
        write!(
            f,
            r#"<text class="x name" transform="translate(12 {middle}) rotate(-90)">{}</text>"#,
            Text(figure.y.title())
        )
    }

    fn series(&self, f: &mut fmt::Formatter<'_>, series: &Series) -> fmt::Result {
        let kind = if series.mark == Mark::Dots { "dots" } else { "line" };
        write!(f, r#"<path class="{kind} {}" stroke-width="{}""#, series.ink.class(), series.width_px)?;
        if !series.dashes.is_empty() {
            write!(f, r#" stroke-dasharray="{}""#, series.dashes)?;
        }
        if series.opacity < 1.0 {
            write!(f, r#" stroke-opacity="{}""#, series.opacity)?;
        }
        f.write_str(r#" d=""#)?;
        let mut pen_down = false;
        for point in &series.points {
            let Some([x, y]) = self.place(*point) else {
                pen_down = false;
                continue;
            };
            match series.mark {
                Mark::Line => write!(f, "{}{x:.1} {y:.1}", if pen_down { "L" } else { "M" })?,
                Mark::Dots => write!(f, "M{x:.1} {y:.1}h0")?,
                Mark::Stems => write!(f, "M{x:.1} {}V{y:.1}", self.bottom)?,
            }
            pen_down = true;
        }
        f.write_str(r#""/>"#)
    }
}

fn legend(f: &mut fmt::Formatter<'_>, series: &[Series]) -> fmt::Result {
    let mut x = LEFT_PX;
    for series in series {
        let Some(label) = &series.label else { continue };
        let (class, y) = (series.ink.class(), 13.0);
        if series.mark == Mark::Dots {
            write!(
                f,
                r#"<path class="dots {class}" stroke-width="{}" d="M{} {y}h0"/>"#,
                series.width_px.max(5.0),
                x + 12.0
            )?;
        } else {
            write!(
                f,
                r#"<path class="line {class}" stroke-width="{}" stroke-dasharray="{}" d="M{x} {y}h24"/>"#,
                series.width_px, series.dashes
            )?;
        }
        write!(f, r#"<text class="name" x="{}" y="{}">{}</text>"#, x + 31.0, y + 4.0, Text(label))?;
        x += 31.0 + 22.0 + LETTER_PX * label.chars().count() as f64;
    }
    Ok(())
}

#[cfg(test)]
#[path = "figure_tests.rs"]
mod tests;
