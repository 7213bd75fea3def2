//! Self-contained HTML reports with figures in SVG.
//!
//! A run's report is made in two steps: [`run_report`] reads the recording and computes the report's data;
//! [`render_html`] makes one HTML page of them. The page contains its style and figures and loads nothing. The same
//! recording always gives the same page.
//!
//! [`figures`] computes the paper's figures from the model. [`calibration`] reports a calibration, [`discovery`] the
//! effects that a model was missing, [`study`] a repetition of the paper on one rig, [`fleet`] what many runs say together.
//!
//! [`viewer_file`] writes a recording for stock MCAP viewers; [`viewer`] makes the messages, live ones too.
//!
//! - [`fit`] fits polynomials by least squares, with standard errors.
//! - [`plot`] draws figures and heat images as SVG; it does not depend on the reports.

pub mod calibration;
pub mod discovery;
pub mod figures;
pub mod fit;
pub mod fleet;
pub mod plot;
pub mod study;
pub mod viewer;

mod document;
mod markup;
mod numbers;
mod page;
mod run;

pub use page::render_html;
pub use run::{
    Baseline, Comparisons, Directions, DwellSummary, ElementCurve, FrameLoss, Intervals, Ladder, LoggedEvent,
    PlaceMap, PressCurve, PressSummary, PressWay, ReportError, RespondsTo, ResponseCurves, RunReport,
    RunSummary, Timing, Trace, UnresponsiveElement, run_report,
};
pub use viewer::{ViewerFile, viewer_file};
