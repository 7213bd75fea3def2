//! Pages of reports, through the public interface.

mod calibration;
mod discovery;
mod made_up;
mod run_report;
#[path = "../../../tactus-record/examples/synthetic/mod.rs"]
mod synthetic;
