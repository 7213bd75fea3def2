//! Reference mechanics of an elastic covering.
//!
//! The covering is an elastic layer on a rigid base, pressed at its top: what arrives at the base is what the
//! elements measure. [`layered`] has the solution in closed form up to an integral; it is what a finite element
//! model of the same layer converges to.

pub mod layered;

mod quadrature;
