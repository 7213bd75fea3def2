//! How workers of one folder share work, and what they say.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::Args;
use tactus_work::{Bar, Claims, LEASE_S, Now, Stop, Worked, Worker, cores};

#[derive(Debug, Args)]
pub(crate) struct WorkerArgs {
    /// How many are worked on at the same time; by default the number of cores. More workers, here and on other machines, may have the same
    /// folder.
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
    /// Another worker takes over from one that is silent for so long: a process or a machine that died.
    #[arg(long, value_name = "SECONDS", default_value_t = LEASE_S, value_parser = clap::value_parser!(u64).range(1..))]
    lease_s: u64,
}

impl WorkerArgs {
    /// Works with others whose claims are in the same folder, and tells how far all are. `pieces` says what is worked on.
    pub(crate) fn work(
        &self,
        pieces: &'static str,
        claims: PathBuf,
        work: impl FnOnce(&Worker, &(dyn Fn(Option<&str>, Now) + Sync)) -> Result<Worked>,
    ) -> Result<()> {
        let worker = Worker {
            claims: Claims::new(claims, Duration::from_secs(self.lease_s)),
            threads: self.jobs.unwrap_or_else(cores),
            stop: Stop::on_signals().context("signals cannot be received")?,
        };
        let bar = Bar::new(pieces, false);
        let progress = |piece: Option<&str>, now: Now| {
            bar.show(now);
            if let Some(piece) = piece.filter(|_| bar.is_hidden()) {
                let left_min = bar.left(now).unwrap_or_default().as_secs_f64() / 60.0;
                println!("{}/{} {piece}, {left_min:.0} min left", now.pieces, now.pieces_all);
            }
        };
        let worked = work(&worker, &progress);
        bar.clear();
        let Worked { done, kept, by_others, lost, left } = worked?;
        for piece in lost {
            println!("{piece} was taken over by another worker: this one had been silent for its lease");
        }
        println!("{pieces}: {done} done, {by_others} by other workers, {kept} before");
        ensure!(left == 0, "stopped; {left} {pieces} are not done: the same command goes on");
        Ok(())
    }
}
