//! How many frames per second this machine records, beside the bare `mcap` crate with the same messages, chunks and compression:
//! `cargo run --profile dist -p tactus-record --example throughput [FRAMES [FOLDER]]`. Prints one JSON object.
//!
//! Both hand each chunk of half a second to the system. `_synced` is with one `fdatasync` for every second of frames, twice as often as the service's.

#![allow(clippy::print_stdout, reason = "a program for people")]

mod synthetic;

use std::collections::BTreeMap;
use std::env;
use std::error::Error;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Instant;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use serde_json::json;
use synthetic::{Plan, Run};
use tactus_record::Recording;
use tactus_schema::{Frame, MonoTime, WallTime};

/// A little more than 1/30 s: 15 of them fill a chunk of Tactus, as they do one of the peer.
const INTERVAL_NS: i64 = 33_333_334;
const CHUNK_FRAMES: usize = 15;
const SYNC_FRAMES: usize = 30;
const ROUNDS: usize = 5;

/// Frames per second, and bytes of each.
type Measured = Result<[f64; 2], Box<dyn Error>>;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let count: usize = arguments.next().map_or(Ok(100_000), |text| text.parse())?;
    let folder = arguments.next().map_or_else(env::temp_dir, PathBuf::from);
    let path = folder.join(format!("tactus-throughput-{}.mcap", std::process::id()));
    let run = Plan::short(4).make();
    let frames = frames(&run, count)?;
    let ways: [(&str, &dyn Fn(bool) -> Measured); 2] = [
        ("tactus", &|sync| recorded(&run, &frames, &path, sync)),
        ("mcap", &|sync| bare(&frames, &path, sync)),
    ];
    let mut measured: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    // In turns, so that what else the machine does meets both.
    for _ in 0..ROUNDS {
        for (name, way) in ways {
            for (suffix, sync) in [("", false), ("_synced", true)] {
                measured.entry(format!("{name}{suffix}")).or_default().push(way(sync)?);
                fs::remove_file(&path)?;
            }
        }
    }
    let median = |values: &[[f64; 2]], which: usize| {
        let mut values: Vec<f64> = values.iter().map(|one| one[which]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let ways = measured.iter().map(|(name, values)| {
        (name.clone(), json!({ "frames_per_s": median(values, 0), "bytes_per_frame": median(values, 1) }))
    });
    println!(
        "{}",
        json!({ "frames": count, "rounds": ROUNDS, "ways": ways.collect::<serde_json::Map<_, _>>() })
    );
    Ok(())
}

/// So many frames in a row, from a run that repeats.
fn frames(run: &Run, count: usize) -> Result<Vec<Frame>, Box<dyn Error>> {
    let of_run: Vec<&Frame> = run.frames().collect();
    let frame = |(seq, frame): (usize, &&Frame)| -> Result<Frame, Box<dyn Error>> {
        let at_ns = i64::try_from(seq)? * INTERVAL_NS;
        let mut frame = (*frame).clone();
        frame.seq = u64::try_from(seq)?;
        (frame.received.mono, frame.received.wall) = (MonoTime::from_ns(at_ns), WallTime::from_ns(at_ns));
        Ok(frame)
    };
    (0..count).zip(of_run.iter().cycle()).map(frame).collect()
}

fn recorded(run: &Run, frames: &[Frame], path: &Path, sync: bool) -> Measured {
    let mut recording = run.with_header(|header| Recording::create(path, header))?;
    let mut synced = recording.sync_handle()?;
    let started = Instant::now();
    for (number, frame) in frames.iter().enumerate() {
        recording.write(frame)?;
        if sync && number % SYNC_FRAMES == SYNC_FRAMES - 1 {
            synced.sync()?;
        }
    }
    let summary = recording.finish()?;
    let count = frames.len() as f64;
    Ok([count / started.elapsed().as_secs_f64(), summary.bytes as f64 / count])
}

/// The same messages by the crate alone.
fn bare(frames: &[Frame], path: &Path, sync: bool) -> Measured {
    let file = File::create(path)?;
    let synced = file.try_clone()?;
    let options = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        .compression_threads(0)
        .chunk_size(None);
    let mut writer = options.create(BufWriter::with_capacity(1 << 18, file))?;
    let schema = writer.add_schema("tactus.v1.Frame", "protobuf", tactus_schema::DESCRIPTOR_SET)?;
    let channel = writer.add_channel(schema, "tactus/bench/sensor/frame", "protobuf", &BTreeMap::new())?;
    let started = Instant::now();
    let mut encoded = Vec::new();
    for (number, frame) in frames.iter().enumerate() {
        encoded.clear();
        frame.encode(&mut encoded);
        let at_ns = u64::try_from(frame.received.wall.ns())?;
        let sequence = u32::try_from(number)?;
        let header = MessageHeader { channel_id: channel, sequence, log_time: at_ns, publish_time: at_ns };
        writer.write_to_known_channel(&header, &encoded)?;
        if number % CHUNK_FRAMES == CHUNK_FRAMES - 1 {
            writer.flush()?;
        }
        if sync && number % SYNC_FRAMES == SYNC_FRAMES - 1 {
            synced.sync_data()?;
        }
    }
    writer.finish()?;
    let count = frames.len() as f64;
    Ok([count / started.elapsed().as_secs_f64(), fs::metadata(path)?.len() as f64 / count])
}
