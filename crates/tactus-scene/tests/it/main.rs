//! Images of meshes, through the public interface.

mod accuracy;
mod files;
#[cfg(feature = "gpu")]
mod gpu;
mod random_poses;
