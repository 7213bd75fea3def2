//! The real programs, as people use them.

mod awake;
mod bad_input;
mod book;
mod calibrate;
mod continued;
mod design;
mod devices;
mod discover;
mod effects;
mod embedded;
mod hosts;
mod import;
mod link;
mod reports;
mod rigs;
mod runs;
mod scripts;
mod service;
mod signals;
mod simulate;
mod stage;
mod truth;
mod unread;
mod watch;
mod web;
mod workers;
