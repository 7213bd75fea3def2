//! `tactus-bench truth`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tactus_bench::truth::{Coverages, Measurements, measure};

use crate::worker_args::WorkerArgs;

#[derive(Debug, Args)]
pub(crate) struct TruthArgs {
    /// Number of rigs.
    #[arg(long, default_value_t = 200)]
    rigs: u64,
    /// Points along a side of the sweep.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u64).range(2..))]
    points: u64,
    /// The program that measures and calibrates.
    #[arg(long, default_value = "target/dist/tactus")]
    tactus: PathBuf,
    /// Folder of the results.
    #[arg(long, default_value = "target/truth")]
    work: PathBuf,
    #[command(flatten)]
    worker: WorkerArgs,
}

impl TruthArgs {
    pub(crate) fn run(self) -> Result<()> {
        let Self { rigs, points, tactus, work, worker } = self;
        let claims = work.join("claims");
        let measurements = Measurements { tactus, points, work };
        worker.work("rigs", claims, |worker, progress| measure(rigs, &measurements, worker, progress))?;
        let coverages = Coverages::of(&measurements.read(rigs)?);
        println!("{rigs} rigs, sweep of {points} x {points} points, 4 coverings, 3 depths");
        println!("{coverages}");
        coverages.check()
    }
}
