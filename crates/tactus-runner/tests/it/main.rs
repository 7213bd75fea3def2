//! Runs without hardware: the embedded rig, and the service's core under random faults.

mod embedded;
mod schedules;
