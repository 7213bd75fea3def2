//! Figures as SVG text: axes with rounded ticks and units, lines, points, stems and heat images.
//!
//! Each type displays itself as one `<svg>` element. The colours are in [`STYLE`], which a page includes once; they suit
//! light and dark backgrounds and print. A [`Sheet`] combines several panels and contains its style, so that it can be a
//! file of its own.
//!
//! ```
//! use tactus_report::plot::{Axis, Figure, Ink, Series};
//!
//! let svg = Figure::new("A line", Axis::new("indentation", "mm").from_zero(), Axis::new("response", "counts"))
//!     .with(Series::line(vec![[0.2, 180.0], [0.6, 590.0]]).ink(Ink::Red).label("fit"))
//!     .to_string();
//! assert!(svg.starts_with("<svg") && svg.contains("indentation / mm"));
//! ```

mod axis;
mod colour;
mod decimate;
mod figure;
mod heat_map;
mod picture;
mod series;
mod sheet;
mod view;

pub use axis::Axis;
pub use colour::{ColourBar, Scale};
pub use decimate::{extremes, steps};
pub use figure::Figure;
pub use heat_map::{ElementNumbers, HeatMap, Image, Mosaic, Tile};
pub use picture::png;
pub use series::{Ink, Series};
pub use sheet::{Label, Panel, Sheet};
pub use view::{Face, ObliqueView, Paint};

pub(crate) use axis::{number, round_step};

/// Style sheet of the figures.
pub const STYLE: &str = include_str!("plot/figure.css");
