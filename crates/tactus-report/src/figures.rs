//! The paper's figures, drawn again from the model: Figures 3, 4, 5b, 6, 8, 9b and 10.
//!
//! [`draw_all`] computes and writes them all. Each figure is also a function from plain inputs to a
//! [`Sheet`], which displays itself as SVG. Where the paper shows its sensor, a virtual sensor stands in, with
//! elements that differ, noise and a converter; every caption says so.

mod acuity;
mod imaging_models;
mod impulse_responses;
mod page;
mod point_spreads;
mod resolutions;
mod side_by_side;
mod trade_off;
mod views;
mod virtual_sensor;

use std::{
    fs, io,
    panic::resume_unwind,
    path::{Path, PathBuf},
    thread,
};

use tactus_calibrate::acuity::AcuityError;
use tactus_model::{Array, Covering, ForwardModel, Indenter, ModelError, Psf, Response};
use tactus_solid::{fem::BricksError, layered::LayerError};

use crate::{plot::Sheet, study::StudyFigure};

pub use imaging_models::{ModelledPress, imaging_models};
pub use impulse_responses::{Widening, impulse_responses};
pub use point_spreads::point_spreads;
pub use resolutions::{Resolution, resolutions};
pub use side_by_side::{SideBySide, side_by_side};
pub use trade_off::trade_off;
pub use views::{pressed_view, tools_view};

pub(crate) use point_spreads::profiles;

/// The paper's coverings: 0.04, 0.1, 0.14 and 0.2 inch.
pub const COVERINGS: [Covering; 4] = Covering::PAPER;

/// Why there are no figures.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// A figure's model cannot be made.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A figure's elastic layer cannot be made.
    #[error(transparent)]
    Layer(#[from] LayerError),
    /// A figure's row of elements cannot be made.
    #[error(transparent)]
    Acuity(#[from] AcuityError),
    /// A figure's finite elements cannot be made.
    #[error(transparent)]
    Bricks(#[from] BricksError),
    /// A file or folder cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// A figure that [`draw_all`] has written, and how far that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What it shows.
    pub title: &'static str,
    /// Figures written.
    pub written: usize,
    /// Figures in all.
    pub figures: usize,
}

/// Computes every figure and writes it into `out_dir`, each as an SVG file, and all of them with captions as
/// `index.html`. Returns the files. Drawn again, they are the same bytes.
///
/// `progress` is called after each figure. The figures are computed side by side, each in a thread of its own.
///
/// # Errors
/// [`FigureError::Write`] names the file that cannot be written.
pub fn draw_all(out_dir: &Path, mut progress: impl FnMut(Progress)) -> Result<Vec<PathBuf>, FigureError> {
    fs::create_dir_all(out_dir).map_err(|source| FigureError::Write { path: out_dir.into(), source })?;
    let mut paths = Vec::new();
    let mut write = |name: &str, text: String| {
        let path = out_dir.join(name);
        fs::write(&path, text).map_err(|source| FigureError::Write { path: path.clone(), source })?;
        paths.push(path);
        Ok::<_, FigureError>(())
    };
    let mut written = 0;
    let drawings = drawn(&FIGURES.each_ref(), |figure, drawing| {
        write(&format!("figure-{}.svg", figure.number), drawing.sheet.to_string())?;
        written += 1;
        progress(Progress { title: figure.title, written, figures: FIGURES.len() });
        Ok(())
    })?;
    write("index.html", page::page(&drawings))?;
    Ok(paths)
}

/// Computes the figures of these numbers, in this order, such as `["3", "6a"]`; numbers that are none are left out.
///
/// The figures are computed side by side, each in a thread of its own.
///
/// # Errors
/// If a figure's model cannot be made, which no shipped one does.
pub fn finished(numbers: &[&str]) -> Result<Vec<StudyFigure>, FigureError> {
    let figure = |number: &&str| FIGURES.iter().find(|figure| figure.number == *number);
    let wanted: Vec<&PaperFigure> = numbers.iter().filter_map(figure).collect();
    let drawings = drawn(&wanted, |_, _| Ok(()))?;
    let finish = |(figure, drawing): (&PaperFigure, Drawing)| StudyFigure {
        number: figure.number.into(),
        title: figure.title.into(),
        caption: drawing.caption,
        svg: drawing.sheet.to_string(),
    };
    Ok(wanted.into_iter().zip(drawings).map(finish).collect())
}

/// Draws figures side by side, each in a thread of its own, and shows each to `take`, in order.
fn drawn(
    figures: &[&PaperFigure],
    mut take: impl FnMut(&PaperFigure, &Drawing) -> Result<(), FigureError>,
) -> Result<Vec<Drawing>, FigureError> {
    thread::scope(|scope| {
        let threads: Vec<_> = figures.iter().map(|figure| (*figure, scope.spawn(figure.draw))).collect();
        let drawings = threads.into_iter().map(|(figure, thread)| {
            let drawing = thread.join().unwrap_or_else(|panic| resume_unwind(panic))?;
            take(figure, &drawing)?;
            Ok(drawing)
        });
        drawings.collect()
    })
}

/// One figure of the paper.
struct PaperFigure {
    /// In the paper.
    number: &'static str,
    title: &'static str,
    draw: fn() -> Result<Drawing, FigureError>,
}

/// A figure and what is to be said of it.
struct Drawing {
    sheet: Sheet,
    caption: String,
}

const FIGURES: [PaperFigure; 10] = [
    PaperFigure { number: "3", title: "Impulse responses of coverings", draw: impulse_responses::draw },
    PaperFigure { number: "4", title: "One press through four imaging models", draw: imaging_models::draw },
    PaperFigure {
        number: "5b",
        title: "Point spread functions of the four coverings",
        draw: point_spreads::draw,
    },
    PaperFigure { number: "6a", title: "Locating a point", draw: acuity::draw_locations },
    PaperFigure { number: "6b", title: "Telling two points apart", draw: acuity::draw_two_points },
    PaperFigure { number: "8a", title: "The H at several angles", draw: side_by_side::draw_angles },
    PaperFigure { number: "8b", title: "The H under each covering", draw: side_by_side::draw_coverings },
    PaperFigure { number: "9b", title: "The H in the covering", draw: views::draw_pressed },
    PaperFigure { number: "10a", title: "Three tools on three resolutions", draw: resolutions::draw },
    PaperFigure { number: "10b", title: "Wrench and spaceship", draw: views::draw_tools },
];

/// Elements that all answer alike: 1 count for each mm of equivalent indentation.
fn uniform(array: Array, psf: Psf) -> Result<ForwardModel, ModelError> {
    let response = Response::uniform(array.elements(), 1.0, 0.0);
    ForwardModel::new(array, psf, response)
}

/// The paper's cylinder.
const REFERENCE_INDENTER: Indenter = Indenter::Cylinder { diameter_mm: 1.0 };

/// The middle of an array's active area.
fn middle_mm(array: &Array) -> [f64; 2] {
    array.extent_mm().map(|[least, most]| f64::midpoint(least, most))
}

/// An image scaled so that its least value is 0 and its greatest 1; all 0 if they are equal.
fn zero_to_one(image: &[f64]) -> Vec<f32> {
    let [least, most] = image.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| {
        [least.min(*value), most.max(*value)]
    });
    let range = if most > least { most - least } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
    image.iter().map(|value| ((value - least) / range) as f32).collect()
}

/// A covering's thickness as it is sold.
pub fn inches(covering: Covering) -> String {
    format!("{:.2} inch", covering.thickness_mm / 25.4)
}

#[cfg(test)]
#[path = "figures_tests.rs"]
mod tests;
