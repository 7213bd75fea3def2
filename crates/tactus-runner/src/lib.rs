//! From a rig file and an experiment to a run: what the service `tactusd` and the embedded rig of the CLI share.
//!
//! | module | purpose |
//! |---|---|
//! | [`config`] | the configuration and rig files |
//! | [`experiments`] | finds scripts by name |
//! | [`open_files`] | how many files a process may have open |
//! | [`order`] | turns a request into a checked order with its run id and recording |
//! | [`devices`] | transports, drivers and virtual devices of a rig |
//! | [`recorder`] | writes the recording for the engine |
//! | [`continuation`] | what an earlier run confirmed, for a run that goes on with it |
//! | [`crashed`] | closes the recordings of runs whose service died |
//! | [`script_process`] | evaluates each script in a process of its own |
//! | [`signals`] | the signals that end a program, in order |
//! | [`twin`] | the dry run on a simulated twin |
//! | [`rehearsal`] | a dry run that keeps what a run would record |
//! | [`embedded`] | one run in this process, without a service |
//! | [`state`] | the state directory |
//! | [`stage_check`] | a check of a rig's stage alone: its identity, and whether it moves as it reports |

pub mod config;
pub mod continuation;
pub mod covering_file;
pub mod crashed;
pub mod devices;
pub mod embedded;
pub mod experiments;
pub mod open_files;
pub mod order;
pub mod recorder;
pub mod rehearsal;
pub mod script_process;
pub mod signals;
pub mod stage_check;
pub mod state;
pub mod twin;

mod outline;
mod virtual_time;
