//! A sheet of figures, images and labels.

use std::fmt;

use super::STYLE;
use crate::markup::Text;

/// Margin around the panels.
const MARGIN_PX: f64 = 12.0;

/// A part of a [`Sheet`].
pub trait Panel {
    /// Writes its SVG relative to an origin that the sheet positions.
    ///
    /// # Errors
    /// Those of the formatter.
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// Panels on one sheet; displays itself as a complete SVG document with inline style.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    name: String,
    size_px: [f64; 2],
    panels: Vec<String>,
}

impl Sheet {
    /// An empty sheet of a width and height; the name is its title for screen readers.
    pub fn new(name: impl Into<String>, size_px: [f64; 2]) -> Self {
        Self { name: name.into(), size_px, panels: Vec::new() }
    }

    /// Draws a panel with its origin at a position, in front of the others.
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

/// A line of text; the origin is the left end of its base line.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    text: String,
    class: &'static str,
    anchor: &'static str,
}

impl Label {
    /// A label in the colour of text.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), class: "name", anchor: "start" }
    }

    /// Styles the label as a heading.
    #[must_use]
    pub fn heading(mut self) -> Self {
        self.class = "name heading";
        self
    }

    /// Uses a lighter text colour.
    #[must_use]
    pub fn muted(mut self) -> Self {
        self.class = "note";
        self
    }

    /// Moves the origin to the middle.
    #[must_use]
    pub fn centred(mut self) -> Self {
        self.anchor = "middle";
        self
    }

    /// Moves the origin to the right end.
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
