//! `tactus-bench rigs`.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::json;
use tactus_bench::{Growth, RigsMeasured, RigsTrial};

#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of the command line")]
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
    /// Frames that the service keeps of each rig for clients that come late: with one, what is left of the memory is a rig's own.
    #[arg(long, value_name = "FRAMES")]
    frames_kept: Option<usize>,
    /// Collect all rigs beside the subscriber, by `tactus collect`: what that takes is a second line.
    #[arg(long)]
    collect: bool,
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
                "{:>6}{:>12}{:>8}{:>12}{:>10}{:>7}{:>13}{:>13}{:>9}{:>9}{:>9}{:>10}",
                "rigs",
                "frames/s",
                "missed",
                "unrecorded",
                "us/frame",
                "cores",
                "memory, KiB",
                "KiB per rig",
                "threads",
                "p50, ms",
                "p99, ms",
                "p99.9, ms"
            );
        }
        let (mut before, mut all) = (None, Vec::new());
        for &rigs in &self.rigs {
            let measured = self.measure(rigs, before)?;
            ensure!(
                !self.check || measured.is_whole(),
                "{rigs} rigs: frames were lost, or came slower than the devices gave them"
            );
            before = Some(measured);
            all.push(measured);
        }
        if !self.json && all.len() > 1 {
            print_growth(&all);
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
        let own = std::env::current_exe()?;
        let beside = |program: &str| own.with_file_name(program);
        let trial = RigsTrial {
            daemon: self.daemon.clone().unwrap_or_else(|| beside("tactusd")),
            rigs,
            time: Duration::try_from_secs_f64(self.seconds)?,
            is_recording: self.record,
            dying: self.dying,
            frames_kept: self.frames_kept,
            collector: self.collect.then(|| beside("tactus")),
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
            latency_ms,
            collector,
        } = *measured;
        let per_rig_kib = before
            .filter(|before| before.rigs < rigs)
            .map(|before| (memory_kib as f64 - before.memory_kib as f64) / (rigs - before.rigs) as f64);
        if self.json {
            let collector = collector.map(|of| {
                json!({
                    "frame_us": of.frame_us, "cores": of.cores, "memory_kib": of.memory_kib, "open_files": of.open_files,
                    "bytes_per_s": of.bytes_per_s, "frames_lost": of.frames_lost,
                })
            });
            let line = json!({
                "rigs": rigs, "whole_rigs": whole_rigs, "frames_per_s": frames_per_s, "missed": missed, "unrecorded": unrecorded,
                "frame_us": frame_us, "cores": cores, "memory_kib": memory_kib, "kib_per_rig": per_rig_kib,
                "threads": threads, "latency_ms": latency_ms, "collector": collector, "version": env!("CARGO_PKG_VERSION"),
            });
            println!("{line}");
            return;
        }
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let unrecorded = or_dash(unrecorded.map(|frames| frames.to_string()));
        let per_rig_kib = or_dash(per_rig_kib.map(|kib| format!("{kib:.0}")));
        let [half, most, nearly_all] = latency_ms.map(|ms| format!("{ms:.3}"));
        println!(
            "{rigs:>6}{frames_per_s:>12.0}{missed:>8}{unrecorded:>12}{frame_us:>10.1}{cores:>7.2}{memory_kib:>13}{per_rig_kib:>13}{threads:>9}{half:>9}{most:>9}{nearly_all:>10}"
        );
        if let Some(of) = collector {
            println!(
                "   its collector: {:.1} us/frame, {:.2} cores, {} KiB ({:.0} a rig), {} open files, {:.0} bytes/s of a rig, {} frames lost",
                of.frame_us,
                of.cores,
                of.memory_kib,
                of.memory_kib as f64 / rigs as f64,
                of.open_files,
                of.bytes_per_s,
                of.frames_lost
            );
        }
    }
}

/// Prints with which power of the number of rigs each cost grows.
fn print_growth(all: &[RigsMeasured]) {
    type Cost = fn(&RigsMeasured) -> f64;
    let costs: [(&str, Cost); 3] = [
        ("memory", |one| one.memory_kib as f64),
        ("processor time a second", |one| one.cores),
        ("latency at the median", |one| one.latency_ms[0]),
    ];
    for (what, cost) in costs {
        let points = all.iter().map(|one| [one.rigs as f64, cost(one)]).collect();
        let growth = Growth { what: what.to_owned(), size_of: "rigs", points };
        println!("{what} ~ rigs^{:.2}", growth.exponent());
    }
}
