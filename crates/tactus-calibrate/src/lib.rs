//! Characterisation of a tactile array from measured presses, and the resolution that its covering allows.
//!
//! [`ReadingsBuilder`] makes presses and dwells from frames; [`calibrate`] takes them through the steps of the paper's Sections 2
//! and 3: faulty elements, registration, element response, point spread, spread against thickness. Every number comes
//! with its standard error, which includes the errors of the earlier steps.
//!
//! [`acuity`] computes how finely a row of quantising elements can locate points and tell them apart (paper, Sec. 4).
//! [`design`] derives from it which covering to order.
//!
//! This crate has no I/O, no async, no clock and no global random numbers.

pub mod acuity;
pub mod design;
pub mod places;

mod calibration;
mod estimate;
mod faults;
mod least_squares;
mod order;
mod placement;
mod readings;
mod registration;
mod response;
mod spread;
#[cfg(test)]
mod synthetic_sensor;
mod thickness;

pub use calibration::{Calibration, DataSummary, calibrate, health};
pub use estimate::Estimate;
pub use faults::{FaultKind, FaultyElement, Health};
pub use placement::Declared;
pub use readings::{Dwell, MeasuredPress, Readings, ReadingsBuilder, Rest};
pub use registration::RegistrationFit;
pub use response::{ElementResponse, ResponseFit, ResponseForm, Trial};
pub use spread::SpreadFit;
pub use thickness::{CoveringSpread, Curve, ThicknessFit};
