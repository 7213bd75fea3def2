//! The real programs, as people use them.

mod awake;
mod bad_input;
mod bench;
mod calibrate;
mod continued;
mod design;
mod devices;
mod discover;
mod disk;
mod effects;
mod embedded;
mod import;
mod kill_trials;
mod link;
mod reports;
mod runs;
mod scripts;
mod service;
mod signals;
mod simulate;
mod soak;
mod stage;
mod stop_trials;
mod truth;
mod unread;
mod web;
