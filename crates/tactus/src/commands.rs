//! One module for each command or group of commands.

pub(crate) mod calibrate;
pub(crate) mod collect;
pub(crate) mod control;
pub(crate) mod design;
pub(crate) mod devices;
pub(crate) mod discover;
pub(crate) mod effects;
pub(crate) mod experiments;
pub(crate) mod figures;
pub(crate) mod files;
pub(crate) mod fleet;
pub(crate) mod import;
pub(crate) mod library;
pub(crate) mod link;
pub(crate) mod plan;
pub(crate) mod run;
pub(crate) mod runs;
pub(crate) mod simulate;
pub(crate) mod stage;
pub(crate) mod study;
pub(crate) mod validate;
pub(crate) mod watch;
