//! How fast the models are, how exact, how they grow, and how far from the machine's limits.
//!
//! What measures the forward model (`tactus-bench --help`, the criterion bench) presses the same [`Tool`]s at the
//! same [`Pose`]s on the same arrays, along one [`Way`] from pose to image or another. [`Fem`] is the finite element
//! model of the covering. [`evidence`] is another matter: how well discovery finds and names what is hidden in data.

pub mod evidence;

mod acuity;
mod calibration;
mod clock;
mod fem;
mod forward;
mod growth;
mod limits;
mod models;
mod press;
mod way;

pub use acuity::Acuity;
pub use calibration::{Calibration, Sweep};
pub use clock::per_image_s;
pub use fem::Fem;
pub use forward::Forward;
pub use growth::Growth;
pub use limits::{Kernel, Limits};
pub use models::{even, model};
pub use press::{COVERING, DEPTH_MAX_MM, Pose, Tool, fine_sphere, poses};
pub use way::{Painter, Way};
