//! A simulated sensor on the bus: frames of a moving tool at the sensor's rate, in real time.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;
use tactus_bus::{Bus, BusConfig, BusError, CommandCall, Endpoint};
use tactus_device::Clock;
use tactus_model::{Indenter, Moment, Pipeline, Trajectory};
use tactus_schema::key::Keys;
use tactus_schema::{DeviceTick, Frame, FrameFlags, MonoTime, pb};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until};

use super::scene::Scene;
use super::series;
use crate::cli::{Common, SimulateArgs};
use crate::connection;
use crate::exit::{Exit, Failure};

/// A sensor that is later than this skips frames and reports them lost in the next frame.
const DELAY_MAX: Duration = Duration::from_millis(250);
/// Period at which stage state and health are published.
const STATE_PERIOD: Duration = Duration::from_millis(100);
/// Length of a device tick.
const TICK_NS: u64 = 1000;

/// Position of the tool over time.
enum ToolPath {
    /// A closed curve over the array with varying depth.
    Circuit { centre_mm: [f64; 2], reach_mm: [f64; 2], depth_mm: f64 },
    /// A path, repeated.
    Repeat(Trajectory),
}

impl ToolPath {
    fn of(scene: &Scene, trajectory: Option<Trajectory>) -> Self {
        let [x, y] = scene.array().extent_mm();
        let depth_mm = scene.contact.depth_mm;
        trajectory.map_or_else(
            || Self::Circuit {
                centre_mm: scene.contact.position_mm,
                reach_mm: [x, y].map(|[least, most]| (most - least) / 4.0),
                depth_mm,
            },
            Self::Repeat,
        )
    }

    fn at(&self, t_s: f64) -> [f64; 3] {
        let turn = std::f64::consts::TAU * t_s;
        match self {
            Self::Circuit { centre_mm: [x, y], reach_mm: [along_x, along_y], depth_mm } => [
                x + along_x * (turn / 7.0).cos(),
                y + along_y * (turn / 5.0).sin(),
                -depth_mm * (0.6 - 0.4 * (turn / 2.0).cos()),
            ],
            Self::Repeat(trajectory) => {
                let [start_s, end_s] = [trajectory.start_s(), trajectory.end_s()];
                let lasts_s = (end_s - start_s).max(f64::MIN_POSITIVE);
                trajectory.at(start_s + t_s.rem_euclid(lasts_s))
            }
        }
    }
}

/// Publishes until Ctrl-C or for the requested time.
pub(super) fn publish(
    common: &Common,
    args: &SimulateArgs,
    scene: &Scene,
    trajectory: Option<&Path>,
) -> anyhow::Result<Exit> {
    let rate_hz = series::rate_hz(args, scene)?;
    let first: Endpoint =
        common.endpoint.parse().map_err(|error: BusError| Failure::new(Exit::Usage, error))?;
    let name = common.rig.as_deref().unwrap_or("simulated");
    if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_') {
        let problem =
            format!("--rig {name:?}: letters, digits, '-' and '_' only: it becomes part of the bus keys");
        return Err(Failure::new(Exit::Usage, problem).into());
    }
    if let Some(seconds) = args.seconds.filter(|seconds| !(seconds.is_finite() && *seconds > 0.0)) {
        return Err(Failure::new(Exit::Usage, format!("--seconds must be positive, not {seconds}")).into());
    }
    connection::runtime()?.block_on(async {
        let clock = Clock::real();
        let mut sensors = Vec::new();
        for copy in 0..args.copies {
            let name = if args.copies == 1 { name.to_owned() } else { format!("{name}-{}", copy + 1) };
            let endpoint = next(&first, copy)?;
            let path = ToolPath::of(scene, trajectory.map(series::read).transpose()?);
            let sensor = SimulatedSensor {
                name: name.clone(),
                scene: scene.clone(),
                path,
                rate_hz,
                rng: ChaCha8Rng::seed_from_u64(args.seed.wrapping_add(u64::from(copy))),
                clock,
            };
            let listen = BusConfig { listen: vec![endpoint.clone()], ..BusConfig::default() };
            let (bus, calls) = Bus::open(&listen, Keys::new(name.clone())).await?;
            let alive = bus.declare_alive().await?;
            if common.json {
                println!("{}", json!({ "rig": name, "endpoint": endpoint.to_string(), "rate_hz": rate_hz, "simulated": true }));
            } else {
                println!("simulated sensor {name:?} at {endpoint}, {rate_hz} frames/s; stop with Ctrl-C");
            }
            let refusing = [tokio::spawn(refuse(calls.stops)), tokio::spawn(refuse(calls.commands))];
            let publisher = bus.publisher();
            let task = tokio::spawn(sensor.run(publisher, args.seconds));
            sensors.push((bus, alive, task, refusing));
        }
        let mut terminate = signal(SignalKind::terminate()).context("cannot wait for SIGTERM")?;
        let ended = async {
            for (_, _, task, _) in &mut sensors {
                task.await.context("a sensor's task broke off")??;
            }
            anyhow::Ok(())
        };
        tokio::select! {
            ended = ended => ended?,
            interrupt = tokio::signal::ctrl_c() => interrupt.context("cannot wait for SIGINT")?,
            _ = terminate.recv() => {}
        }
        for (bus, alive, task, refusing) in sensors {
            task.abort();
            refusing.iter().for_each(tokio::task::JoinHandle::abort);
            drop(alive);
            bus.close().await?;
        }
        Ok(Exit::Done)
    })
}

/// The endpoint of a copy: each copy has the next port.
fn next(first: &Endpoint, copy: u32) -> anyhow::Result<Endpoint> {
    if copy == 0 {
        return Ok(first.clone());
    }
    let text = first.to_string();
    let (host, port) = text.rsplit_once(':').context("an endpoint ends with its port")?;
    let port: u32 = port.parse().with_context(|| format!("{port:?} is not a port number"))?;
    Ok(format!("{host}:{}", port + copy).parse()?)
}

/// Refuses all commands: there is only a sensor.
async fn refuse(mut calls: mpsc::Receiver<Box<CommandCall>>) {
    while let Some(call) = calls.recv().await {
        call.reply.reply(pb::CommandReply {
            ok: false,
            error: "this is `tactus simulate --live`, a sensor only: commands need the service, tactusd"
                .into(),
            exit_code: Exit::Failed as u32,
            ..Default::default()
        });
    }
}

/// One simulated sensor.
struct SimulatedSensor {
    name: String,
    scene: Scene,
    path: ToolPath,
    rate_hz: f64,
    rng: ChaCha8Rng,
    clock: Clock,
}

impl SimulatedSensor {
    async fn run(mut self, publisher: tactus_bus::Publisher, seconds: Option<f64>) -> anyhow::Result<()> {
        let mut pipeline = Pipeline::new(&self.scene.simulator)?;
        // Pressing a mesh exactly takes milliseconds. That remains where the blur is too fine for a press table.
        if let Indenter::Mesh(_) = &self.scene.simulator.indenter
            && let Err(error) = pipeline.use_press_table(self.scene.simulator.covering.thickness_mm)
        {
            tracing::warn!("{error}; images are computed one by one, and may come late");
        }
        publisher.publish(&self.info());
        let start = Instant::now();
        let frames = seconds.map_or(u64::MAX, |seconds| whole(seconds * self.rate_hz));
        let (mut seq, mut lost, mut lost_before) = (0_u64, 0_u64, 0_u32);
        let mut news = start;
        while seq < frames {
            let t_s = seq as f64 / self.rate_hz;
            let due = start + Duration::from_secs_f64(t_s);
            sleep_until(due).await;
            let behind = due.elapsed();
            if behind > DELAY_MAX {
                let missed = whole(behind.as_secs_f64() * self.rate_hz);
                (seq, lost) = (seq + missed, lost + missed);
                lost_before = lost_before.saturating_add(u32::try_from(missed).unwrap_or(u32::MAX));
                continue;
            }
            let frame = self.frame(&mut pipeline, seq, t_s, std::mem::take(&mut lost_before));
            publisher.publish_frame(&frame);
            if frame.received.mono.ns() > 0 && due >= news {
                news = due + STATE_PERIOD;
                publisher.publish(&self.stage(seq, t_s));
                publisher.publish(&self.health(seq + 1 - lost, lost, publisher.dropped_frames()));
            }
            seq += 1;
        }
        Ok(())
    }

    fn frame(&mut self, pipeline: &mut Pipeline, seq: u64, t_s: f64, lost_before: u32) -> Frame {
        let path = &self.path;
        let clean_counts = pipeline.step(Moment::at(t_s), &|t_s: f64| path.at(t_s)).to_vec();
        let array = self.scene.array();
        let (least_counts, full_scale_counts) = (array.least_counts(), array.full_scale_counts());
        let mut flags = if seq == 0 { FrameFlags::NEW_EPOCH } else { FrameFlags::default() };
        if lost_before > 0 {
            flags = flags.with(FrameFlags::GAP_BEFORE);
        }
        let mut counts = Vec::with_capacity(clean_counts.len());
        for clean in clean_counts {
            let deviate: f64 = StandardNormal.sample(&mut self.rng);
            let read = pipeline.read(clean, self.scene.simulator.noise_rms_counts * deviate);
            if read <= least_counts || read >= full_scale_counts {
                flags = flags.with(FrameFlags::SATURATED);
            }
            #[expect(clippy::cast_possible_truncation, reason = "frames carry single precision")]
            counts.push(read as f32);
        }
        Frame {
            seq,
            epoch: 1,
            device_tick: Some(DeviceTick(whole(t_s * 1e9) / TICK_NS)),
            received: self.clock.now(),
            counts: counts.into(),
            flags,
            lost_before,
            simulated: true,
            bad_elements: [].into(),
            temperature_c: None,
        }
    }

    fn info(&self) -> pb::SensorInfo {
        let array = self.scene.array();
        let size = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        pb::SensorInfo {
            rig: self.name.clone(),
            array: array.name().into(),
            rows: size(array.rows()),
            cols: size(array.cols()),
            rate_hz: self.rate_hz,
            full_scale_counts: array.full_scale_counts(),
            tick_ns: TICK_NS,
            link: "simulated".into(),
            transport: "none".into(),
            simulated: true,
        }
    }

    fn stage(&self, seq: u64, t_s: f64) -> pb::StageState {
        let [x_mm, y_mm, z_mm] = self.path.at(t_s);
        let now = self.clock.now();
        pb::StageState {
            seq,
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            x_mm,
            y_mm,
            z_mm,
            status: pb::StageStatus::Moving as i32,
            ..Default::default()
        }
    }

    fn health(&self, frames: u64, frames_lost: u64, frames_dropped_on_bus: u64) -> pb::Health {
        let now = self.clock.now();
        pb::Health {
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            version: env!("CARGO_PKG_VERSION").into(),
            uptime_s: now.mono.since(MonoTime::from_ns(0)).as_secs_f64(),
            sensor_connected: true,
            stage_connected: true,
            frames,
            frames_lost,
            frames_dropped_on_bus,
            frame_rate_hz: self.rate_hz,
            simulated: true,
            ..Default::default()
        }
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "times and counts, not negative")]
fn whole(number: f64) -> u64 {
    number.round() as u64
}
