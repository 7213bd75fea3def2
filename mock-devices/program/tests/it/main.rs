//! The program `tactus-mock`, as a user runs it.

mod hidden;
mod terminal;
