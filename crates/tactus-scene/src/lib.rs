//! Scenes: meshes from files, made shapes, and their depth image under an orthographic camera.

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
