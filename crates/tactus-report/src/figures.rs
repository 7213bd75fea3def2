//! The paper's Figures 3, 4, 5b, 6, 8, 9b and 10, computed from the model.
//!
//! [`draw_all`] computes and writes them all. Each figure is also a function from plain inputs to a [`Sheet`], which
//! displays itself as SVG. A virtual sensor replaces the paper's sensor; its elements differ, and it has noise and a
//! converter. Every caption says so.

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
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use rayon::prelude::*;

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

/// Why figures cannot be computed or written.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// A figure's model is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A figure's elastic layer is invalid.
    #[error(transparent)]
    Layer(#[from] LayerError),
    /// A figure's row of elements is invalid.
    #[error(transparent)]
    Acuity(#[from] AcuityError),
    /// A figure's finite-element mesh is invalid.
    #[error(transparent)]
    Bricks(#[from] BricksError),
    /// A file or folder cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

/// A figure that is finished, and the number of those so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Title of the figure.
    pub title: &'static str,
    /// Figures finished so far, this one included.
    pub finished: usize,
    /// Figures to finish.
    pub figures: usize,
}

/// Tells the progress of figures that are drawn in parallel.
struct Reporting<F> {
    figures: usize,
    /// Number of finished figures, and who is told.
    told: Mutex<(usize, F)>,
}

impl<F: FnMut(Progress)> Reporting<F> {
    fn new(figures: usize, progress: F) -> Self {
        Self { figures, told: Mutex::new((0, progress)) }
    }

    fn finished(&self, title: &'static str) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let (finished, progress) = &mut *told;
        *finished += 1;
        progress(Progress { title, finished: *finished, figures: self.figures });
    }
}

/// Computes the figures in parallel and writes each into `out_dir` as an SVG file, and all of them with captions as
/// `index.html`. Returns the files in the paper's order. The files are the same, byte for byte, each time.
///
/// `progress` is called after each figure, in the order in which they finish.
///
/// # Errors
/// [`FigureError::Write`] names the file that cannot be written.
pub fn draw_all(out_dir: &Path, progress: impl FnMut(Progress) + Send) -> Result<Vec<PathBuf>, FigureError> {
    fs::create_dir_all(out_dir).map_err(|source| FigureError::Write { path: out_dir.into(), source })?;
    let write = |name: &str, text: String| {
        let path = out_dir.join(name);
        match fs::write(&path, text) {
            Ok(()) => Ok(path),
            Err(source) => Err(FigureError::Write { path, source }),
        }
    };
    let reporting = Reporting::new(FIGURES.len(), progress);
    let draw = |figure: &PaperFigure| {
        let drawing = (figure.draw)()?;
        let path = write(&format!("figure-{}.svg", figure.number), drawing.sheet.to_string())?;
        reporting.finished(figure.title);
        Ok((path, drawing))
    };
    let drawn: Result<Vec<_>, FigureError> = FIGURES.par_iter().map(draw).collect();
    let (mut paths, drawings): (Vec<PathBuf>, Vec<Drawing>) = drawn?.into_iter().unzip();
    paths.push(write("index.html", page::page(&drawings))?);
    Ok(paths)
}

/// Computes the figures with these numbers, such as `["3", "6a"]`, in parallel; unknown numbers are ignored.
///
/// `progress` is called after each figure, in the order in which they finish.
///
/// # Errors
/// If a figure's model is invalid; the shipped ones are valid.
pub fn finished(
    numbers: &[&str],
    progress: impl FnMut(Progress) + Send,
) -> Result<Vec<StudyFigure>, FigureError> {
    let find = |number: &&str| FIGURES.iter().find(|figure| figure.number == *number);
    let wanted: Vec<&PaperFigure> = numbers.iter().filter_map(find).collect();
    let reporting = Reporting::new(wanted.len(), progress);
    let draw = |figure: &PaperFigure| {
        let drawing = (figure.draw)()?;
        reporting.finished(figure.title);
        Ok(StudyFigure {
            number: figure.number.into(),
            title: figure.title.into(),
            caption: drawing.caption,
            svg: drawing.sheet.to_string(),
        })
    };
    wanted.into_par_iter().map(draw).collect()
}

/// One figure of the paper.
struct PaperFigure {
    /// Number in the paper.
    number: &'static str,
    title: &'static str,
    draw: fn() -> Result<Drawing, FigureError>,
}

/// A figure and its caption.
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
    PaperFigure { number: "6b", title: "Resolving two points", draw: acuity::draw_two_points },
    PaperFigure { number: "8a", title: "The H at several angles", draw: side_by_side::draw_angles },
    PaperFigure { number: "8b", title: "The H under each covering", draw: side_by_side::draw_coverings },
    PaperFigure { number: "9b", title: "The H in the covering", draw: views::draw_pressed },
    PaperFigure { number: "10a", title: "Three tools on three resolutions", draw: resolutions::draw },
    PaperFigure { number: "10b", title: "Wrench and spaceship", draw: views::draw_tools },
];

/// A model of identical elements: 1 count per mm of equivalent indentation.
fn uniform(array: Array, psf: Psf) -> Result<ForwardModel, ModelError> {
    let response = Response::uniform(array.elements(), 1.0, 0.0);
    ForwardModel::new(array, psf, response)
}

/// The paper's cylinder.
const REFERENCE_INDENTER: Indenter = Indenter::Cylinder { diameter_mm: 1.0 };

/// Centre of an array's active area.
fn middle_mm(array: &Array) -> [f64; 2] {
    array.extent_mm().map(|[least, most]| f64::midpoint(least, most))
}

/// An image scaled to 0 to 1; all 0 if all values are equal.
fn zero_to_one(image: &[f64]) -> Vec<f32> {
    let [least, most] = image.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| {
        [least.min(*value), most.max(*value)]
    });
    let range = if most > least { most - least } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
    image.iter().map(|value| ((value - least) / range) as f32).collect()
}

/// A covering's thickness in inches, as it is sold.
pub fn inches(covering: Covering) -> String {
    format!("{:.2} inch", covering.thickness_mm / 25.4)
}

#[cfg(test)]
#[path = "figures_tests.rs"]
mod tests;
