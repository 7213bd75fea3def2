//! Virtual devices, through the production drivers.

mod hidden;
mod rig;
mod stages;
mod terminal;
