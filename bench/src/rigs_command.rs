//! `tactus-bench rigs`.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::json;
use tactus_bench::{RigsMeasured, RigsTrial};

#[derive(Debug, Args)]
pub(crate) struct RigsArgs {
    /// Numbers of rigs, rising.
    #[arg(value_delimiter = ',', default_value = "1,20,40")]
    rigs: Vec<usize>,
    /// Then double the number until a frame is lost, and halve the distance this often.
    #[arg(long, value_name = "TIMES")]
    search: Option<u32>,
    /// Start a run on every rig: each has a recording then, and a process for its script beside the service.
    #[arg(long)]
    record: bool,
    /// Let the devices of this many rigs die in the middle: what is counted is the others'.
    #[arg(long, value_name = "RIGS", default_value_t = 0)]
    dying: usize,
    /// Fail if a frame is lost: for nights, in which nobody reads the table.
    #[arg(long, conflicts_with = "search")]
    check: bool,
    /// Length of each measurement in s.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Processors of the service, as `taskset` writes them.
    #[arg(long)]
    cores: Option<String>,
    /// The service's program, if not the one beside this one.
    #[arg(long, value_name = "FILE")]
    daemon: Option<PathBuf>,
    /// Print a JSON object for each measurement instead of a table.
    #[arg(long)]
    json: bool,
}

impl RigsArgs {
    pub(crate) fn run(&self) -> Result<()> {
        ensure!(self.rigs.iter().all(|rigs| *rigs > self.dying), "at least one rig has to live");
        if !self.json {
            println!(
                "{:>6}{:>12}{:>8}{:>12}{:>10}{:>7}{:>13}{:>13}{:>9}",
                "rigs",
                "frames/s",
                "missed",
                "unrecorded",
                "us/frame",
                "cores",
                "memory, KiB",
                "KiB per rig",
                "threads"
            );
        }
        let mut before = None;
        for &rigs in &self.rigs {
            let measured = self.measure(rigs, before)?;
            ensure!(
                !self.check || measured.is_whole(),
                "{rigs} rigs: frames were lost, or came slower than the devices gave them"
            );
            before = Some(measured);
        }
        let (Some(times), Some(last)) = (self.search, before) else { return Ok(()) };
        let (mut whole, mut broken) = (last.rigs, None);
        while broken.is_none() {
            let rigs = whole * 2;
            if self.carries(rigs, before) {
                whole = rigs;
            } else {
                broken = Some(rigs);
            }
        }
        let mut broken = broken.context("the search has ended")?;
        for _ in 0..times {
            let rigs = usize::midpoint(whole, broken);
            if self.carries(rigs, before) {
                whole = rigs;
            } else {
                broken = rigs;
            }
        }
        println!("{whole} rigs without a loss, {broken} with");
        Ok(())
    }

    /// True if so many rigs lose nothing; says what else went wrong.
    fn carries(&self, rigs: usize, before: Option<RigsMeasured>) -> bool {
        match self.measure(rigs, before) {
            Ok(measured) => measured.is_whole(),
            Err(error) => {
                println!("{rigs} rigs: {error:#}");
                false
            }
        }
    }

    fn measure(&self, rigs: usize, before: Option<RigsMeasured>) -> Result<RigsMeasured> {
        let beside = || Ok::<_, anyhow::Error>(std::env::current_exe()?.with_file_name("tactusd"));
        let trial = RigsTrial {
            daemon: self.daemon.clone().map_or_else(beside, Ok)?,
            rigs,
            time: Duration::try_from_secs_f64(self.seconds)?,
            is_recording: self.record,
            dying: self.dying,
            cores: self.cores.clone(),
        };
        let measured = trial.measure()?;
        self.print(&measured, before);
        Ok(measured)
    }

    fn print(&self, measured: &RigsMeasured, before: Option<RigsMeasured>) {
        let RigsMeasured {
            rigs,
            whole_rigs,
            frames_per_s,
            missed,
            unrecorded,
            frame_us,
            cores,
            memory_kib,
            threads,
        } = *measured;
        let per_rig_kib = before
            .filter(|before| before.rigs < rigs)
            .map(|before| (memory_kib as f64 - before.memory_kib as f64) / (rigs - before.rigs) as f64);
        if self.json {
            let line = json!({
                "rigs": rigs, "whole_rigs": whole_rigs, "frames_per_s": frames_per_s, "missed": missed, "unrecorded": unrecorded,
                "frame_us": frame_us, "cores": cores, "memory_kib": memory_kib, "kib_per_rig": per_rig_kib,
                "threads": threads, "version": env!("CARGO_PKG_VERSION"),
            });
            println!("{line}");
            return;
        }
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let unrecorded = or_dash(unrecorded.map(|frames| frames.to_string()));
        let per_rig_kib = or_dash(per_rig_kib.map(|kib| format!("{kib:.0}")));
        println!(
            "{rigs:>6}{frames_per_s:>12.0}{missed:>8}{unrecorded:>12}{frame_us:>10.1}{cores:>7.2}{memory_kib:>13}{per_rig_kib:>13}{threads:>9}"
        );
    }
}
