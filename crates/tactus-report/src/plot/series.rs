//! Series of points in a figure.

/// Points and their style.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) mark: Mark,
    pub(super) ink: Ink,
    pub(super) label: Option<String>,
    pub(super) dashes: &'static str,
    pub(super) width_px: f64,
    pub(super) opacity: f64,
}

/// Colours for light and dark backgrounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ink {
    /// The colour of text.
    #[default]
    Text,
    /// A lighter text colour.
    Muted,
    /// Class `red` in the style sheet.
    Red,
    /// Class `blue` in the style sheet.
    Blue,
    /// Class `green` in the style sheet.
    Green,
    /// Class `amber` in the style sheet.
    Amber,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Line,
    Dots,
    Stems,
}

impl Series {
    /// A line through points `[x, y]`, broken where one is not finite.
    pub fn line(points: Vec<[f64; 2]>) -> Self {
        Self::new(points, Mark::Line, 1.5)
    }

    /// A round dot at each point.
    pub fn dots(points: Vec<[f64; 2]>) -> Self {
        Self::new(points, Mark::Dots, 4.0)
    }

    /// A vertical line from the bottom of the figure to each point.
    pub fn stems(points: Vec<[f64; 2]>) -> Self {
        Self::new(points, Mark::Stems, 1.5)
    }

    /// A vertical bar from `lo` to `hi` at each `[x, lo, hi]`, for intervals.
    pub fn bars(bars: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let points = bars.into_iter().flat_map(|[x, lo, hi]| [[x, lo], [x, hi], [f64::NAN; 2]]);
        Self::new(points.collect(), Mark::Line, 1.5)
    }

    /// Sets the colour.
    #[must_use]
    pub fn ink(mut self, ink: Ink) -> Self {
        self.ink = ink;
        self
    }

    /// Adds a legend entry.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Sets the line width or the dots' diameter.
    #[must_use]
    pub fn width_px(mut self, width_px: f64) -> Self {
        self.width_px = width_px;
        self
    }

    /// Sets the opacity: 0 invisible, 1 solid.
    #[must_use]
    pub fn opacity(mut self, opacity: f64) -> Self {
        self.opacity = opacity;
        self
    }

    /// Draws the line dashed.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashes = "7 4";
        self
    }

    /// Draws the line dotted.
    #[must_use]
    pub fn dotted(mut self) -> Self {
        self.dashes = "1.5 2.5";
        self
    }

    fn new(points: Vec<[f64; 2]>, mark: Mark, width_px: f64) -> Self {
        Self { points, mark, ink: Ink::Text, label: None, dashes: "", width_px, opacity: 1.0 }
    }
}

impl Ink {
    /// Class in the style sheet.
    pub(crate) fn class(self) -> &'static str {
        match self {
            Self::Text => "ink",
            Self::Muted => "muted",
            Self::Red => "red",
            Self::Blue => "blue",
            Self::Green => "green",
            Self::Amber => "amber",
        }
    }
}
