//! Virtual devices, through the production drivers.

mod permits;
mod rig;
mod stages;
