//! Forward model of a tactile array under an elastic covering.
//!
//! The sensor is a grid of square elements under a covering of thickness `t`. An indenter that
//! stands a depth below the covering's undeformed surface makes a penetration map `I(x, y)` in mm.
//! The covering spreads it by a Gaussian point spread function (PSF), each element integrates the
//! spread map over its active square, and the element answers with counts:
//!
//! ```text
//! d_e      = integral over element e of (I * G_sigma)
//! counts_e = baseline_e + gain_e * R(d_e)
//! ```
//!
//! [`ForwardModel`] gives counts as real numbers; [`Readout`] makes of them what a converter gives. A [`Simulator`]
//! puts both into time: its [`Pipeline`] follows a tip, with the [`effect`]s that the base model lacks.
//!
//! This crate has no I/O, no async, no clock and no global random numbers.

pub mod effect;

mod array;
mod blur;
mod contact;
mod covering;
mod forward;
mod gradient;
mod indenter;
mod mesh;
mod pipeline;
mod quadrature;
mod readout;
mod registration;
mod simulator;
mod stamp;
mod trajectory;

pub use array::{Array, ArrayError};
pub use blur::Blur;
pub use contact::Contact;
pub use covering::{Covering, Psf};
pub use effect::{Effect, EffectError};
pub use forward::{ForwardModel, ModelError, Response};
pub use gradient::Gradient;
pub use indenter::Indenter;
pub use mesh::{Mesh, MeshError};
pub use pipeline::{Moment, Pipeline};
pub use readout::Readout;
pub use registration::Registration;
pub use simulator::{Image, Simulator};
pub use stamp::{Stamp, StampError};
pub use trajectory::{Path, Trajectory, TrajectoryError};

/// Centre-to-centre distance of the DigiTacts elements, in mm: the "sensor element width" in which
/// the paper states lengths (Eq. 4 gives the printed 1.36 for the 0.04 inch covering only with it).
pub const DIGITACTS_PITCH_MM: f64 = 2.0;
