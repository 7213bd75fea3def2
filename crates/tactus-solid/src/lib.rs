//! Reference mechanics of an elastic covering.
//!
//! The covering is an elastic layer on a rigid base, pressed at its top: what arrives at the base is what the
//! elements measure. [`layered`] has the solution in closed form up to an integral; [`fem`] is the paper's finite
//! element model of the same layer, which converges to it.

pub mod fem;
pub mod layered;

mod quadrature;
mod search;
