//! A fleet, through the program and the library.

mod book;
mod ingest;
mod lab;
mod query;
mod survey;
#[path = "../../../crates/tactus-record/examples/synthetic/mod.rs"]
mod synthetic;
