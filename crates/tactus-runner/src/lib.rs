//! From a rig file and an experiment to a run: what the service `tactusd` and the embedded rig of the CLI share.
//!
//! | module | what it composes |
//! |---|---|
//! | [`config`] | the configuration and rig files |
//! | [`experiments`] | names to scripts |
//! | [`order`] | a request to a checked order, its run id and its recording |
//! | [`devices`] | transports, drivers and virtual devices of a rig |
//! | [`recorder`] | the recording behind the engine |
//! | [`twin`] | the dry run on a simulated twin |
//! | [`embedded`] | one run in this process, without a service |
//! | [`stage_check`] | a look at a rig's stage alone: what it is, and whether it moves as it says |

pub mod config;
pub mod devices;
pub mod embedded;
pub mod experiments;
pub mod logging;
pub mod order;
pub mod recorder;
pub mod stage_check;
pub mod twin;

mod virtual_time;
