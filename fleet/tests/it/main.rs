//! A fleet, through the program and the library.

mod book;
#[cfg(feature = "cluster")]
mod cluster;
mod ingest;
mod lab;
mod query;
mod survey;
#[path = "../../../crates/tactus-record/examples/synthetic/mod.rs"]
mod synthetic;
