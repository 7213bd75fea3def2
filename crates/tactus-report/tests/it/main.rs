//! Pages of reports, through the public interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod calibration;
mod discovery;
mod made_up;
mod run_report;
#[path = "../../../tactus-record/examples/synthetic/mod.rs"]
mod synthetic;
