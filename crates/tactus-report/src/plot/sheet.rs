//! Figures, images and labels on one sheet.

use std::fmt;

use super::STYLE;
use crate::markup::Text;

/// Room around the panels.
const MARGIN_PX: f64 = 12.0;

/// What can stand on a [`Sheet`].
pub trait Panel {
    /// Writes its SVG, about an origin that the sheet puts in its place.
    ///
    /// # Errors
    /// Those of the formatter.
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// Panels beside each other; displays itself as one SVG document that stands alone, its style inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    name: String,
    size_px: [f64; 2],
    panels: Vec<String>,
}

impl Sheet {
    /// An empty sheet with room for panels of a width and height; the name is for those who cannot see it.
    pub fn new(name: impl Into<String>, size_px: [f64; 2]) -> Self {
        Self { name: name.into(), size_px, panels: Vec::new() }
    }

    /// Draws a panel with its origin at a place, over those before.
    pub fn put(&mut self, [x, y]: [f64; 2], panel: &impl Panel) {
        let drawn = fmt::from_fn(|f| panel.draw(f));
        self.panels.push(format!(r#"<g transform="translate({x:.2} {y:.2})">{drawn}</g>"#));
    }
}

impl fmt::Display for Sheet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, size_px, panels } = self;
        let [width, height] = size_px.map(|size| size + 2.0 * MARGIN_PX);
        write!(
            f,
            r#"<svg xmlns="http://www.w3.org/2000/svg" class="figure" viewBox="-{MARGIN_PX} -{MARGIN_PX} {width} {height}" width="{width}" height="{height}" role="img"><title>{}</title><style>:root {{ color-scheme: light dark; }} {STYLE}</style>{}</svg>"#,
            Text(name),
            panels.concat()
        )
    }
}

/// A line of text; its origin is at the left of its base line.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    text: String,
    class: &'static str,
    anchor: &'static str,
}

impl Label {
    /// In the colour of text.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), class: "name", anchor: "start" }
    }

    /// As a heading.
    #[must_use]
    pub fn heading(mut self) -> Self {
        self.class = "name heading";
        self
    }

    /// Less than text.
    #[must_use]
    pub fn muted(mut self) -> Self {
        self.class = "note";
        self
    }

    /// With its origin in its middle.
    #[must_use]
    pub fn centred(mut self) -> Self {
        self.anchor = "middle";
        self
    }

    /// With its origin at its right.
    #[must_use]
    pub fn right(mut self) -> Self {
        self.anchor = "end";
        self
    }
}

impl Panel for Label {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { text, class, anchor } = self;
        write!(f, r#"<text class="{class}" text-anchor="{anchor}">{}</text>"#, Text(text))
    }
}

#[cfg(test)]
#[path = "sheet_tests.rs"]
mod tests;
