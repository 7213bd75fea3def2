//! The parts of the latency benchmark that are in Rust: who hears frames, and who passes them on with zenoh alone.
//!
//! `peers/latency.py` writes frames to a pseudo-terminal, and notes when the last byte of each was written. Here is noted when another
//! process had it, by the same clock. A frame has its number in its first two readings: `readings[0] + 4000 readings[1]`.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use rustix::time::{ClockId, clock_gettime};
use tactus_bus::{Client, Endpoint, History};
use tactus_schema::pb;
use tokio::runtime::Runtime;
use tokio::sync::mpsc;
use zenoh::{Config, Session, Wait};

/// Readings that the first of a frame counts up to.
const FIRST_READINGS: u64 = 4000;
/// Bytes of a frame in the format of `config/links/digitacts.toml`, and where its readings begin.
const FRAME_BYTES: usize = 106;
const READINGS_AT: usize = 8;
/// Bytes of a frame as Tactus publishes it.
const PAYLOAD_BYTES: usize = 240;
/// Key of frames that are passed on without Tactus.
const KEY: &str = "bare/frame";

/// The number of a frame, and when it was heard: `CLOCK_MONOTONIC`, in ns.
pub type Heard = (u64, i64);

/// Hears so many frames of a service in a callback, in the thread that receives them.
///
/// # Errors
/// If the service is not there.
pub fn hear(endpoint: &Endpoint, frames: usize, ready: fn()) -> Result<Vec<Heard>> {
    runtime()?.block_on(async {
        let client = Client::connect(endpoint, None).await?;
        let (send, mut arrived) = mpsc::unbounded_channel();
        let take = move |frame: pb::Frame| {
            let at_ns = now_ns();
            // Nobody takes them any more once there are enough.
            send.send((number_of(&frame), at_ns)).ok();
        };
        let listener = client.listen(take).await?;
        ready();
        let mut heard = Vec::with_capacity(frames);
        while heard.len() < frames {
            heard.push(arrived.recv().await.context("the service has gone")?);
        }
        drop(listener);
        client.close().await?;
        Ok(heard)
    })
}

/// Hears so many frames of a service from a subscription's queue, in another thread than the one that receives them.
///
/// # Errors
/// If the service is not there, or goes.
pub fn hear_queued(endpoint: &Endpoint, frames: usize, ready: fn()) -> Result<Vec<Heard>> {
    runtime()?.block_on(async {
        let client = Client::connect(endpoint, None).await?;
        let mut subscription = client.subscribe::<pb::Frame>(History::None).await?;
        ready();
        let mut heard = Vec::with_capacity(frames);
        while heard.len() < frames {
            let frame = subscription.recv().await.context("the service has gone")?;
            let at_ns = now_ns();
            heard.push((number_of(&frame), at_ns));
        }
        client.close().await?;
        Ok(heard)
    })
}

fn runtime() -> std::io::Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()
}

/// Hears so many frames that [`relay`] passes on.
///
/// # Errors
/// If nothing listens at the endpoint.
pub fn hear_bare(endpoint: &Endpoint, frames: usize, ready: fn()) -> Result<Vec<Heard>> {
    let session = session("connect", endpoint)?;
    let (send, heard) = std::sync::mpsc::channel();
    let subscriber = session.declare_subscriber(KEY).callback(move |sample| {
        let at_ns = now_ns();
        // Nobody takes them any more once there are enough.
        send.send((number_in(&sample.payload().to_bytes()), at_ns)).ok();
    });
    let subscriber = subscriber.wait().map_err(|error| anyhow!(error))?;
    ready();
    let heard = heard.into_iter().take(frames).collect();
    drop(subscriber);
    Ok(heard)
}

/// Reads frames from a terminal and publishes them with zenoh, as many bytes as Tactus does, until the terminal closes.
///
/// # Errors
/// If the terminal cannot be read, or the endpoint not be listened at.
pub fn relay(device: &Path, endpoint: &Endpoint, ready: fn()) -> Result<()> {
    let mut terminal = File::open(device).with_context(|| device.display().to_string())?;
    let session = session("listen", endpoint)?;
    let publisher = session.declare_publisher(KEY).wait().map_err(|error| anyhow!(error))?;
    ready();
    let mut payload = vec![0; PAYLOAD_BYTES];
    loop {
        let (frame, _) = payload.split_at_mut(FRAME_BYTES);
        if terminal.read_exact(frame).is_err() {
            return Ok(());
        }
        publisher.put(payload.clone()).wait().map_err(|error| anyhow!(error))?;
    }
}

/// A zenoh session that listens or connects at one endpoint and finds nothing else.
fn session(how: &str, endpoint: &Endpoint) -> Result<Session> {
    let mut config = Config::default();
    let mode = if how == "listen" { "router" } else { "client" };
    let settings = [
        ("mode", format!("{mode:?}")),
        (&format!("{how}/endpoints"), format!("[{:?}]", endpoint.to_string())),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
    ];
    for (key, value) in settings {
        config.insert_json5(key, &value).map_err(|error| anyhow!(error))?;
    }
    zenoh::open(config).wait().map_err(|error| anyhow!(error))
}

/// The number of a frame that Tactus publishes.
fn number_of(frame: &pb::Frame) -> u64 {
    let number = |index: usize| frame.counts.get(index).map_or(0, |counts| whole(*counts));
    number(0) + FIRST_READINGS * number(1)
}

fn number_in(frame: &[u8]) -> u64 {
    let reading = |index: usize| match frame.get(READINGS_AT + 2 * index..) {
        Some([low, high, ..]) => u64::from(u16::from_le_bytes([*low, *high])),
        Some(_) | None => 0,
    };
    reading(0) + FIRST_READINGS * reading(1)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "readings are 0 to 4095")]
fn whole(counts: f32) -> u64 {
    counts as u64
}

fn now_ns() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}
