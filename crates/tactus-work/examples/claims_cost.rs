//! What a claim costs: the time of a piece that only writes its number into a file, on one thread, as work and without anything around it.
//!
//! `cargo run --profile dist --package tactus-work --example claims_cost -- FOLDER 10000`
#![expect(clippy::print_stdout, reason = "standard output is this program's interface")]

use std::{
    env,
    error::Error,
    io,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use tactus_work::{ClaimError, Claims, LEASE_S, Stop, Work, Worker, work, write_whole};

/// Writes numbers into files.
struct Numbers<'a> {
    folder: &'a Path,
}

#[derive(Debug, thiserror::Error)]
#[error(transparent)]
enum Failed {
    Claim(#[from] ClaimError),
    File(#[from] io::Error),
}

impl Numbers<'_> {
    fn path(&self, number: usize) -> PathBuf {
        self.folder.join(number.to_string())
    }
}

impl Work for Numbers<'_> {
    type Piece = usize;
    type Made = usize;
    type Error = Failed;

    fn name(&self, number: &usize) -> String {
        number.to_string()
    }

    fn is_done(&self, number: &usize) -> Result<bool, Failed> {
        Ok(self.path(*number).exists())
    }

    fn make(&self, number: &usize, _: &Stop) -> Result<Option<usize>, Failed> {
        Ok(Some(*number))
    }

    fn keep(&self, number: &usize, made: usize) -> Result<(), Failed> {
        Ok(write_whole(&self.path(*number), made.to_string().as_bytes())?)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("which folder?")?);
    let numbers: Vec<usize> = (0..arguments.next().ok_or("how many pieces?")?.parse()?).collect();
    let worker = Worker {
        claims: Claims::new(folder.join("claims"), Duration::from_secs(LEASE_S)),
        threads: NonZeroUsize::MIN,
        stop: Stop::default(),
    };
    let [as_work, alone] = ["as-work", "alone"].map(|part| folder.join(part));
    let started = Instant::now();
    let worked = work(&Numbers { folder: &as_work }, &numbers, &worker, &|_, _| ())?;
    let as_work_s = started.elapsed().as_secs_f64();
    let started = Instant::now();
    for number in &numbers {
        Numbers { folder: &alone }.keep(number, *number)?;
    }
    let alone_s = started.elapsed().as_secs_f64();
    let [as_work_us, alone_us] = [as_work_s, alone_s].map(|time_s| 1e6 * time_s / numbers.len() as f64);
    println!("{} pieces: {as_work_us:.0} us each as work, {alone_us:.0} us alone", worked.done);
    Ok(())
}
