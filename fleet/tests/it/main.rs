//! A fleet, through the program and the library.

mod book;
mod ingest;
mod lab;
#[path = "../../../crates/tactus-record/examples/synthetic/mod.rs"]
mod synthetic;
