//! Many recordings in one place.
//!
//! [`ingest`](ingest()) writes recordings and measurement tables as Parquet, one file per run, at `rig=NAME/date=YYYY-MM-DD/RUN.parquet` on a
//! local disk or in any object store: a fleet. Each file is a measurement table, too, so that every other command of Tactus reads it, and
//! every program that reads Parquet by folders.
//!
//! | module | does |
//! |---|---|
//! | `place` | where a fleet is: a folder or an address, and its object store |
//! | `columns` | the columns of a file, and rows as Arrow batches |
//! | `run_head` | what a file says of its run, in its metadata |
//! | `twice` | frames that a fleet has twice, in two of its runs |
//! | `ingest` | from recordings to files |
//! | `cluster` | a query on several machines, with the feature of that name |
//! | `query` | SQL over all runs |
//! | `survey` | calibration and discovery of every run, by as many workers as there are, and what they say together |
#![expect(clippy::print_stderr, reason = "errors go to standard error, results to standard output")]

mod cli;
#[cfg(feature = "cluster")]
mod cluster;
mod columns;
mod exit;
mod ingest;
mod output;
mod place;
mod query;
mod run_head;
mod survey;
mod twice;

pub use cli::main;
pub use ingest::{FailedFile, IngestError, Ingested, Options as IngestOptions, ingest};
pub use place::{Place, PlaceError};
pub use run_head::RunHead;
pub use tactus_work::Now;
