//! Self-contained HTML reports with figures in SVG.
//!
//! A report is made in two steps: [`run_report`] reads one run's recording and computes everything that is to be
//! said, as data; [`render_html`] makes one HTML page of it, with its style and figures inline, that loads nothing
//! from anywhere. The same recording always gives the same page.
//!
//! [`figures`] draws the paper's figures again from the model; [`calibration`] reports what was measured of a
//! sensor, [`discovery`] what its model was missing, [`study`] all of the paper on one rig.
//!
//! - [`fit`] fits polynomials by least squares, with standard errors.
//! - [`plot`] draws figures and heat images as SVG; it knows nothing of runs.

pub mod calibration;
pub mod discovery;
pub mod figures;
pub mod fit;
pub mod plot;
pub mod study;

mod document;
mod markup;
mod numbers;
mod page;
mod run;

pub use page::render_html;
pub use run::{
    Baseline, DwellSummary, ElementCurve, FrameLoss, Intervals, LoggedEvent, PressSummary, ReportError,
    ResponseCurves, RunReport, RunSummary, Timing, Trace, UnresponsiveElement, run_report,
};
