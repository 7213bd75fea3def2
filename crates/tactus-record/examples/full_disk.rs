//! Records until a small disk is full, and shows what is told and what is kept:
//! `mount -t tmpfs -o size=4m tmpfs DIR && cargo run -p tactus-record --example full_disk -- DIR`

#![allow(clippy::print_stdout, reason = "a program for people")]

mod synthetic;

use std::{env, error::Error, path::PathBuf};

use synthetic::Plan;
use tactus_record::{Recording, info};
use tactus_schema::{MonoTime, WallTime};

/// Frames that arrive after the disk is full, until the run has ended: two seconds.
const FRAMES_AFTER: u64 = 60;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or("name a folder on a small disk")?);
    let path = folder.join("recording.mcap");
    let run = Plan { exit_status: None, ..Plan::short(4) }.make();
    let frames: Vec<_> = run.frames().cloned().collect();
    let mut recording = run.with_header(|header| Recording::create(&path, header))?;
    let mut failed_at = None;
    for (seq, frame) in (0..).zip(frames.iter().cycle()) {
        let mut frame = frame.clone();
        let at_ns = i64::try_from(seq)? * 33_333_333;
        (frame.seq, frame.lost_before) = (seq, 0);
        (frame.received.mono, frame.received.wall) = (MonoTime::from_ns(at_ns), WallTime::from_ns(at_ns));
        if let Err(error) = recording.write(&frame)
            && failed_at.is_none()
        {
            println!("at frame {seq}: {error}");
            failed_at = Some(seq);
        }
        if failed_at.is_some_and(|failed_at| seq == failed_at + FRAMES_AFTER) {
            println!("{} frames were given", seq + 1);
            break;
        }
    }
    match recording.finish() {
        Ok(_) => println!("the disk was not full"),
        Err(error) => println!("at the end: {error}"),
    }
    println!("{}", info(&path)?);
    Ok(())
}
