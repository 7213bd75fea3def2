//! Recordings and tables, through the public interface.

mod damage;
mod export;
mod extremes;
mod round_trip;
mod rows;
#[path = "../../examples/synthetic/mod.rs"]
mod synthetic;
mod table;
