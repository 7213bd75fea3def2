//! How fast the forward model is, how exact, how it grows, and how far from the machine's limits.
//!
//! Every part of the program (`tactus-bench --help`) and every criterion bench presses the same [`Tool`]s at the
//! same [`Pose`]s on the same arrays, along one [`Way`] from pose to image or another.

mod acuity;
mod clock;
mod forward;
mod growth;
mod limits;
mod models;
mod press;
mod way;

pub use acuity::Acuity;
pub use clock::per_image_s;
pub use forward::Forward;
pub use growth::Growth;
pub use limits::{Kernel, Limits};
pub use models::{even, model};
pub use press::{COVERING, DEPTH_MAX_MM, Pose, Tool, fine_sphere, poses};
pub use way::{Painter, Way};
