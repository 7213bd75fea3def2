//! Characterisation of a tactile array from measured presses, and the resolution that its covering allows.
//!
//! This crate has no I/O, no async, no clock and no global random numbers.
