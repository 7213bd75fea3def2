//! Bytes per second through each sensor's decoder, clean and with a bit flipped in one byte of a hundred, beside copying the
//! bytes. They are pushed in reads of 4 kB, as a driver does, and every reading is taken out.

use std::hint::black_box;
use std::sync::Arc;

use anyhow::Result;
use criterion::{BenchmarkId, Criterion, Throughput};
use tactus_wire::declared::{Encoder, RawFormat};
use tactus_wire::singletact::{ElementReading, Reply, Via};
use tactus_wire::weiss::Checksum;
use tactus_wire::{anyskin, declared, singletact, weiss};

const ELEMENTS: usize = 48;
const STREAM_BYTES: usize = 1 << 20;
const READ_BYTES: usize = 4096;

fn main() -> Result<()> {
    let mut criterion = Criterion::default().configure_from_args();
    let full = |frame| weiss::encode_frame(time_ms(frame), &counts(frame), false);
    let run_length = |frame| weiss::encode_frame(time_ms(frame), &counts(frame), true);
    bench(&mut criterion, "weiss-dsa", &stream(full), weiss_dsa(Checksum::Crc));
    let packed = stream(run_length);
    bench(&mut criterion, "weiss-dsa, run lengths", &packed, weiss_dsa(Checksum::Crc));
    let summed = stream(|frame| Checksum::Sum8.close(full(frame)));
    bench(&mut criterion, "weiss-dsa, sum8", &summed, weiss_dsa(Checksum::Sum8));
    bench(&mut criterion, "singletact", &stream(single_reply), take_replies);
    bench(&mut criterion, "anyskin", &stream(magnetic_frame), take_magnetic);
    let format = toml::from_str::<RawFormat>(include_str!("../../config/links/digitacts.toml"))?;
    let format = Arc::new(format.check()?);
    let mut encoder = Encoder::new(format.clone());
    let mut declared = Vec::new();
    for frame in 0..10_000 {
        declared.extend_from_slice(encoder.encode(time_ms(frame).into(), &counts(frame).map(f32::from))?);
    }
    bench(&mut criterion, "declared", &declared, |bytes| take_declared(&format, bytes));
    criterion.final_summary();
    Ok(())
}

/// The three figures of one codec. `take` returns the number of frames, so that a decoder that finds none fails.
fn bench(criterion: &mut Criterion, name: &str, clean: &[u8], take: impl Fn(&[u8]) -> usize) {
    let corrupt = corrupted(clean);
    let frames = take(clean);
    assert!(frames > 1000 && take(&corrupt) < frames, "{name}: {frames} frames of {} bytes", clean.len());
    let mut group = criterion.benchmark_group(format!("decode/{name}"));
    group.throughput(Throughput::Bytes(clean.len() as u64));
    let copied = |bytes: &[u8]| {
        let mut to = Vec::with_capacity(READ_BYTES);
        for read in bytes.chunks(READ_BYTES) {
            to.clear();
            to.extend_from_slice(read);
            black_box(&to);
        }
    };
    group.bench_function(BenchmarkId::from_parameter("copied"), |bencher| bencher.iter(|| copied(clean)));
    group.bench_function(BenchmarkId::from_parameter("clean"), |bencher| bencher.iter(|| take(clean)));
    group.bench_function(BenchmarkId::from_parameter("corrupt"), |bencher| bencher.iter(|| take(&corrupt)));
    group.finish();
}

/// A mebibyte of frames, numbered from 0.
fn stream(frame: impl Fn(u16) -> Vec<u8>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(STREAM_BYTES);
    let mut number = 0;
    while bytes.len() < STREAM_BYTES {
        bytes.extend(frame(number));
        number += 1;
    }
    bytes
}

fn time_ms(frame: u16) -> u32 {
    33 * u32::from(frame)
}

/// The bytes with a bit flipped in every 101st, a step that no frame's length divides.
fn corrupted(bytes: &[u8]) -> Vec<u8> {
    let flip = |(index, byte): (usize, &u8)| if index % 101 == 100 { byte ^ 0x10 } else { *byte };
    bytes.iter().enumerate().map(flip).collect()
}

/// Readings of an array under one press.
fn counts(frame: u16) -> [u16; ELEMENTS] {
    std::array::from_fn(|element| {
        let far = element.abs_diff(20);
        let noise = (frame.wrapping_mul(40_503) >> (element % 12)) % 5;
        98 + noise + if far < 4 { 400 >> far } else { 0 }
    })
}

/// Pushes the bytes through a decoder in reads of 4 kB; returns the number of readings. `next` takes the next item out, if there
/// is one, and says whether it is a reading.
fn readings<D>(
    bytes: &[u8],
    mut decoder: D,
    push: impl Fn(&mut D, &[u8]),
    next: impl Fn(&mut D) -> Option<bool>,
) -> usize {
    let mut readings = 0;
    for read in bytes.chunks(READ_BYTES) {
        push(&mut decoder, read);
        while let Some(is_reading) = next(&mut decoder) {
            readings += usize::from(is_reading);
        }
    }
    readings
}

fn weiss_dsa(checksum: Checksum) -> impl Fn(&[u8]) -> usize {
    let is_frame =
        |packet: weiss::Packet<'_>| weiss::DecodedFrame::parse(&packet, ELEMENTS).map(black_box).is_ok();
    move |bytes| {
        let decoder = weiss::Decoder::new().with_checksum(checksum);
        readings(bytes, decoder, weiss::Decoder::push, |decoder| {
            Some(decoder.next_packet()?.is_ok_and(is_frame))
        })
    }
}

fn single_reply(frame: u16) -> Vec<u8> {
    let [_, id] = frame.to_be_bytes();
    let data = ElementReading { counter: frame, counts: 255 + frame % 64 }.encode();
    let timestamp_ticks = time_ms(frame);
    Reply { via: Via::Usb, address: 4, timed_out: false, id, timestamp_ticks, data: &data }.encode()
}

fn take_replies(bytes: &[u8]) -> usize {
    let decoder = singletact::Decoder::new();
    readings(bytes, decoder, singletact::Decoder::push, |decoder| {
        Some(decoder.next_reply()?.reading().map(black_box).is_ok())
    })
}

fn magnetic_frame(frame: u16) -> Vec<u8> {
    let mut numbers = counts(frame).into_iter().map(|count| 0.1 * f32::from(count)).cycle();
    let mut made = anyskin::DecodedFrame::default();
    for magnetometer in &mut made.magnetometers {
        magnetometer.temperature_c = 21.5;
        magnetometer.field_ut = std::array::from_fn(|_| numbers.next().unwrap_or_default());
    }
    made.encode()
}

fn take_magnetic(bytes: &[u8]) -> usize {
    let decoder = anyskin::Decoder::new();
    readings(bytes, decoder, anyskin::Decoder::push, |decoder| {
        decoder.next_frame().map(black_box).map(|_| true)
    })
}

fn take_declared(format: &Arc<declared::Format>, bytes: &[u8]) -> usize {
    let decoder = declared::Decoder::new(format.clone());
    readings(bytes, decoder, declared::Decoder::push, |decoder| {
        decoder.next_frame().map(black_box).map(|_| true)
    })
}
