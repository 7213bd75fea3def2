//! Virtual devices, through the production drivers.

mod damage;
mod rig;
mod schedules;
mod stages;
