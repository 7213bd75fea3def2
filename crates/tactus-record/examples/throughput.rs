//! Measures how many frames per second this machine records: `cargo run --release -p tactus-record --example throughput`

#![allow(clippy::print_stdout, reason = "a program for people")]

mod synthetic;

use std::{env, error::Error, fs, time::Instant};

use synthetic::Plan;
use tactus_record::Recording;
use tactus_schema::{MonoTime, WallTime};

const FRAMES: u64 = 200_000;

fn main() -> Result<(), Box<dyn Error>> {
    let run = Plan::short(4).make();
    let frames: Vec<_> = run.frames().cloned().collect();
    let path = env::temp_dir().join(format!("tactus-throughput-{}.mcap", std::process::id()));
    let mut recording = run.with_header(|header| Recording::create(&path, header))?;
    let started = Instant::now();
    for (seq, frame) in (0..FRAMES).zip(frames.iter().cycle()) {
        let mut frame = frame.clone();
        let at_ns = i64::try_from(seq)? * 33_333_333;
        frame.seq = seq;
        frame.received.mono = MonoTime::from_ns(at_ns);
        frame.received.wall = WallTime::from_ns(at_ns);
        recording.write(&frame)?;
    }
    let summary = recording.finish()?;
    let elapsed_s = started.elapsed().as_secs_f64();
    println!(
        "{:.0} frames/s, {:.0} bytes/frame",
        FRAMES as f64 / elapsed_s,
        summary.bytes as f64 / FRAMES as f64
    );
    fs::remove_file(path)?;
    Ok(())
}
