//! The real programs, as people use them.

mod awake;
mod bad_input;
mod calibrate;
mod continued;
mod design;
mod devices;
mod discover;
mod embedded;
mod link;
mod scripts;
mod service;
mod signals;
mod simulate;
mod stage;
mod truth;
mod unread;
mod web;
