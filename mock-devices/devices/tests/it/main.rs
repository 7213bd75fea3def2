//! Virtual devices, through the production drivers.

mod rig;
mod stages;
