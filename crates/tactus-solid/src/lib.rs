//! Reference mechanics of an elastic covering.
//!
//! The covering is an elastic layer on a rigid base, loaded at its top. The elements measure the pressure at the base.
//! [`layered`] has the solution in closed form up to an integral. [`fem`] is the paper's finite element model of the same
//! layer, which converges to it.

pub mod fem;
pub mod layered;

mod quadrature;
mod search;
