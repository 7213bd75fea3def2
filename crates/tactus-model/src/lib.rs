//! Forward model of a tactile array under an elastic covering: from a tool's contact to the reading of every element.
//!
//! # Geometry
//!
//! The sensor is a grid of rectangular elements ([`Array`]), row-major, row 0 column 0 at the origin corner of the
//! sensor frame; x runs along columns, y along rows, both in mm. The `DigiTacts` of the paper has 6 rows of 8
//! elements of 1.8 mm, 2.0 mm apart but for the middle column gap of each of its two halves (Fig. 1). On it lies a
//! [`Covering`] of thickness `t`. A [`Registration`] takes the robot's frame to the sensor's:
//!
//! ```text
//! p_sensor = Rot(-rotation) (p_robot - origin)
//! ```
//!
//! # One image
//!
//! An [`Indenter`] (cylinder, sphere, cone, box, or any [`Mesh`]) at a depth `z` below the undeformed surface ([`Contact`])
//! makes the penetration map
//!
//! ```text
//! I(x, y) = depth of the tool's underside below the surface, in [0, t] mm                  (Sec. 5, Fig. 7)
//! ```
//!
//! The covering spreads it by a Gaussian point spread function of unit volume, whose width grows with thickness
//! ([`Psf`], Eq. 4), each element integrates the spread map over its active area, and answers ([`Response`], Sec. 2.2):
//!
//! ```text
//! d_e      = integral over element e of (I * G_sigma)             mm^3     sigma = intercept + slope t
//! u_e      = d_e / d_ref                                          mm
//! counts_e = baseline_e + sensitivity_e (u_e + k_e u_e^2)
//! ```
//!
//! `d_ref` is the signal of the reference tool 1 mm deep at the element's own centre under the reference covering. So
//! sensitivity is what a calibration measures: counts per mm of that press. [`Readout`] then applies noise, saturation and
//! quantisation, in this order.
//!
//! A Gaussian blur and the integral over a rectangle separate into x and y. A tool is cut into slices of one x; the
//! share of a line that arrives between two edges has a closed form in the error function, and along x the integrand
//! is smooth, so that Gauss-Legendre quadrature between its corners converges fast ([`Blur`]).
//!
//! | what | compared with | agrees to |
//! |---|---|---|
//! | cylinder, sphere, cone | direct quadrature over the tool's face, without the error function | 1e-9 of each element |
//! | box, mesh | closed form; direct quadrature in the tool's own frame | 1e-9 |
//! | mesh of many triangles | finer slices | about 1e-5 of the peak |
//! | derivatives ([`Gradient`]) | central differences | 1e-6 of the largest |
//! | [`PressTable`] | the exact image | 5e-5 of the peak (4e-6 measured for the paper's H) |
//!
//! Tests also check conservation of volume, mirror symmetry, linearity in depth of flat tools, and the limits of zero and
//! infinite spread.
//!
//! ```
//! use tactus_model::{Array, Contact, Covering, ForwardModel, Indenter, Psf, Response};
//!
//! let covering = Covering { thickness_mm: 1.016 };
//! let cylinder = Indenter::Cylinder { diameter_mm: 1.0 };
//! let response = Response::uniform(48, 1000.0, 100.0);
//! let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, response)?;
//!
//! // Upon the centre of row 2, column 1, half a millimetre deep.
//! let press = Contact { indenter: cylinder, position_mm: [2.9, 4.9], rotation_deg: 0.0, depth_mm: 0.5 };
//! let mut counts = [0.0; 48];
//! model.image(&press, covering, &mut counts);
//! assert!((counts[17] - 600.0).abs() < 1e-9);
//! // Its neighbour along x reads 0.77 of it: the spread of Eq. 4 is 1.36 element widths.
//! assert!(((counts[16] - 100.0) / 500.0 - 0.77).abs() < 0.005);
//!
//! // Derivatives of the image, for fits and error propagation.
//! let gradient = model.gradient(&press, covering);
//! assert!((gradient.by_depth_mm[17] - 1000.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # In time
//!
//! A [`Simulator`] describes a sensor: the model, its registration, covering, tool and noise, and the [`effect`]s that the
//! base model lacks. Its [`Pipeline`] follows a [`Path`], such as a [`Trajectory`] of the stage, moment by moment: motion,
//! contact, covering, element, readout. Every clone is an independent sensor.
//!
//! # Speed
//!
//! A [`PressTable`] interpolates a tool's image from a table made once: about 1.7 million images a second on one core, for
//! any mesh on 48 elements. [`MeshImages`] make 390,000 a second of a closed mesh in any attitude, without a table. The exact image takes
//! 7 us for a cylinder and 65 us for the H.
//!
//! This crate has no I/O, no async, no clock and no global random numbers.
//!
//! # Source
//!
//! Pezzementi, Jantho, Estrade and Hager, *Characterization and Simulation of Tactile Sensors*, Haptics Symposium 2010;
//! section, figure and equation numbers are the paper's.

pub mod effect;

mod array;
mod blur;
mod contact;
mod covering;
#[cfg(test)]
mod fixtures;
mod forward;
mod gradient;
mod images;
mod indenter;
mod mesh;
mod mesh_images;
mod phase;
mod pipeline;
mod press_table;
mod quadrature;
mod readout;
mod registration;
mod simulator;
mod skin;
mod trace;
mod trail;
mod trajectory;

pub use array::{Array, ArrayError};
pub use blur::Blur;
pub use contact::Contact;
pub use covering::{Covering, Psf};
pub use effect::{Effect, EffectError};
pub use forward::{ForwardModel, ModelError, Response};
pub use gradient::Gradient;
pub use images::Images;
pub use indenter::Indenter;
pub use mesh::{Mesh, MeshError};
pub use mesh_images::MeshImages;
pub use phase::Phase;
pub use pipeline::{Moment, Pipeline};
pub use press_table::{PressTable, PressTableError};
pub use readout::Readout;
pub use registration::Registration;
pub use simulator::{Image, Simulator};
pub use trace::{Covariate, Seen, Trace};
pub use trail::Trail;
pub use trajectory::{Path, Trajectory, TrajectoryError};

/// Centre-to-centre distance of the DigiTacts elements, in mm: the "sensor element width" in which
/// the paper states lengths (Eq. 4 gives the printed 1.36 for the 0.04 inch covering only with it).
pub const DIGITACTS_PITCH_MM: f64 = 2.0;
