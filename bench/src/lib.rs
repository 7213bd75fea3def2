//! Speed, accuracy and growth of the models, and their distance from the machine's limits.
//!
//! The measurements of the forward model (`tactus-bench --help` and the criterion benchmark) use the same [`Tool`]s at the
//! same [`Pose`]s on the same arrays, with each [`Method`] from pose to image. [`Fem`] is the finite element model of the
//! covering. [`latency`] measures the way of a frame, and [`RigsTrial`] a service of many rigs. [`evidence`] measures something else: how
//! well `tactus discover` finds and names hidden physics; so does [`truth`]: how well `tactus calibrate` recovers the parameters of rigs.

pub mod evidence;
pub mod latency;
pub mod truth;

mod acuity;
mod calibration;
mod clock;
mod fem;
mod forward;
mod growth;
mod limits;
mod method;
mod models;
mod press;
mod program;
mod rigs;

pub use acuity::Acuity;
pub use calibration::{Calibration, Sweep};
pub use clock::per_image_s;
pub use fem::Fem;
pub use forward::Forward;
pub use growth::Growth;
pub use limits::{Kernel, MachineLimits};
pub use method::{Method, Painter};
pub use models::{even, model};
pub use press::{COVERING, DEPTH_MAX_MM, Pose, Tool, fine_sphere, poses};
pub use rigs::{CollectorMeasured, Devices, RigsMeasured, RigsTrial, serve_devices};
