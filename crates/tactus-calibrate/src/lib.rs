//! Characterisation of a tactile array from measured presses, and the resolution that its covering allows.
//!
//! This crate has no I/O, no async, no clock and no global random numbers.
//!
//! - [`acuity`] is how finely a row of elements that round can locate and tell apart (paper Sec. 4).
//! - [`design`] makes of it which covering to order.

pub mod acuity;
pub mod design;
