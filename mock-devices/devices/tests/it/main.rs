//! Virtual devices, through the production drivers.

mod damage;
mod permits;
mod rig;
mod schedules;
mod stages;
mod unwired;
