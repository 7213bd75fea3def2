//! The real programs, as people use them.

mod bad_input;
mod calibrate;
mod design;
mod devices;
mod discover;
mod embedded;
mod link;
mod service;
mod simulate;
mod stage;
mod truth;
mod web;
