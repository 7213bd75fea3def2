//! Characterisation of a tactile array from measured presses, and the resolution that its covering allows.
//!
//! [`Gather`] makes presses and dwells of frames; [`calibrate`] takes them through the steps of the paper's Sections 2
//! and 3: faulty elements, registration, element response, point spread, spread against thickness. Every number comes
//! with its standard error, which holds the errors of the steps before.
//!
//! [`acuity`] is how finely a row of elements that round can locate and tell apart (paper, Sec. 4); [`design`] makes of
//! it which covering to order.
//!
//! This crate has no I/O, no async, no clock and no global random numbers.

pub mod acuity;
pub mod design;

mod calibration;
mod estimate;
mod faults;
#[cfg(test)]
mod lab;
mod least_squares;
mod order;
mod readings;
mod registration;
mod response;
mod setting;
mod spread;
mod thickness;

pub use calibration::{Calibration, Data, calibrate};
pub use estimate::Estimate;
pub use faults::{Fault, FaultKind, Health};
pub use readings::{Dwell, Gather, Press, Readings, Rest, distinct_places};
pub use registration::RegistrationFit;
pub use response::{ElementResponse, Form, ResponseFit, Trial};
pub use setting::Declared;
pub use spread::SpreadFit;
pub use thickness::{CoveringSpread, Curve, ThicknessFit};
