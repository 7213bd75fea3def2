//! The command line of Tactus: a client of the service, and the commands that work on files.
#![expect(clippy::print_stdout, reason = "standard output is this program's interface")]
#![expect(clippy::print_stderr, reason = "errors and hints go to standard error, results to standard output")]

mod cli;
mod commands;
mod completion;
mod connection;
mod exit;
mod interrupt;
mod output;
mod progress;
mod sha256;
mod source_line;

pub use cli::{command, main};
