//! Runs without hardware: the embedded rig, and the service's core under random faults and for days.

mod days;
mod embedded;
mod schedules;
