//! Scenes: meshes from files, generated tools, and their image on the sensor, as in the paper's simulator (Sec. 5).
//!
//! The sensor is an orthographic camera that looks up at the tool, and its viewing volume is the covering. The z-buffer
//! is the penetration map, which a Gaussian blur and the elements' areas turn into signals, and the response into counts:
//!
//! ```text
//! Z        = z-buffer of the tool's depth below the surface, in [0, covering thickness], in mm; rows x cols cells
//! d        = A_y Z A_x^T                                                               mm^3, one per element
//! counts_e = baseline_e + sensitivity_e (u_e + k_e u_e^2),   u_e = d_e / d_ref
//! ```
//!
//! `A_x[col, i]` is the length of cell `i` that arrives in column `col` after the blur. Blur and integration separate into
//! x and y, and the matrices contain both exactly. Only the edge of the tool within a cell is approximate: the value of a
//! cell is the mean of 16 samples.
//!
//! | | |
//! |---|---|
//! | [`load`], [`read`] | a [`Mesh`](tactus_model::Mesh) from STL (binary, ASCII), OBJ or PLY, in mm |
//! | [`shapes`] | generated tools: H, wrench, spaceship (Fig. 9, 10) |
//! | [`Pose`], [`Attitude`] | position, attitude and depth of the tool |
//! | [`Renderer`] | its [`DepthMap`] and image on the CPU; the image of a closed mesh follows from its edges, without a raster |
//! | `GpuRenderer` | the same by compute shaders, many poses at once; with the feature `gpu` |
//!
//! Accuracy: [`Renderer`] states the bound and what was measured. Of the raster, compared with
//! [`ForwardModel::image`](tactus_model::ForwardModel::image), which has no raster, 99 of 100 poses that touch 1000 cells
//! or more agree to 1e-3 of the image's peak (worst 6e-3). Contacts with an edge or a corner touch fewer cells and are
//! less accurate. The error falls with the power 1.5 of a cell's side.
//! CPU and GPU agree to 1.3e-6 of full scale (a test requires 1e-5), because integers that are made once for both decide
//! which samples a triangle covers.
//!
//! Irregular meshes: triangles without area are left out; through a hole the next surface above is visible; the order of a
//! triangle's corners does not matter; surfaces may intersect. Coordinates that are not finite, indices without a vertex,
//! spans beyond 1 m, and surfaces that are not visible from below are refused.
//!
//! ```
//! use std::sync::Arc;
//!
//! use tactus_model::{Array, Covering, ForwardModel, Psf, Response};
//! use tactus_scene::{Attitude, Pose, Renderer, shapes::Scene};
//!
//! let covering = Covering { thickness_mm: 1.016 };
//! let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, Response::uniform(48, 1000.0, 100.0))?;
//! let renderer = Renderer::new(model, covering, Arc::new(Scene::H.mesh()))?;
//! // In the sensor's middle, turned by 30 degrees and tilted by 2, with its lowest corner 0.3 mm deep.
//! let attitude = Attitude { yaw_deg: 30.0, roll_deg: 2.0, ..Attitude::default() };
//! let pose = Pose { position_mm: [8.1, 5.9], attitude, depth_mm: 0.3 };
//! let mut counts = [0.0; 48];
//! renderer.image(&pose, &mut counts)?;
//! assert!(counts[20] > 500.0);
//! let map = renderer.depth_map(&pose)?;
//! let deepest = map.penetration_mm.iter().copied().fold(0.0, f32::max);
//! assert!(deepest > 0.25 && deepest <= 0.3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod depth;
mod facet;
mod file;
#[cfg(feature = "gpu")]
mod gpu;
mod image;
mod lattice;
mod pose;
pub mod shapes;

pub use depth::DepthMap;
pub use file::{BYTES_MAX, FileError, Format, TRIANGLES_MAX, load, read};
#[cfg(feature = "gpu")]
pub use gpu::{GpuError, GpuRenderer};
pub use image::{RenderError, Renderer};
pub use pose::{Attitude, Pose};
