//! A synthetic rig that publishes frames, marked simulated, and answers commands.
//!
//! It lets clients be tried without a daemon and without devices:
//!
//! ```text
//! cargo run -p tactus-bus --example pulse -- [tcp/HOST:PORT [RATE_HZ [LOSE_EVERY]]]
//! ```
//!
//! Each frame shows a smooth peak that moves over 6 x 8 elements. With `LOSE_EVERY` n, each n-th frame is lost as at a
//! device. One line of JSON on standard output shows that it is ready.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::{error::Error, future::pending, pin::pin, time::Duration};

use tactus_bus::{Bus, BusConfig, CommandCall, Endpoint, Publisher, Request};
use tactus_schema::{
    Frame, FrameFlags, MonoTime, TimeStamp, WallTime,
    key::{Command, Keys},
    pb::{self, run_event::Event},
};
use tokio::time::{Instant, MissedTickBehavior};

const RIG: &str = "pulse";
const ROWS: u32 = 6;
const COLS: u32 = 8;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let endpoint: Endpoint = arguments.next().map_or_else(|| Ok(Endpoint::default()), |text| text.parse())?;
    let rate_hz: f64 = arguments.next().map_or(Ok(30.0), |text| text.parse())?;
    let lose_every: u64 = arguments.next().map_or(Ok(u64::MAX), |text| text.parse())?;

    let config = BusConfig { listen: vec![endpoint.clone()], ..BusConfig::default() };
    let (bus, mut calls) = Bus::open(&config, Keys::new(RIG)).await?;
    let mut pulse = Pulse { out: bus.publisher(), start: Instant::now(), run: None, events: 0, rate_hz };
    pulse.introduce();
    let alive = bus.declare_alive().await?;
    println!(r#"{{"ready": true, "endpoint": "{endpoint}", "rig": "{RIG}", "rate_hz": {rate_hz}}}"#);

    let mut beat = tokio::time::interval(Duration::from_secs_f64(1.0 / rate_hz));
    beat.set_missed_tick_behavior(MissedTickBehavior::Burst);
    let mut interrupted = pin!(interrupted());
    let mut seq = 0;
    let mut lost_before = 0;
    loop {
        tokio::select! {
            biased;
            Some(call) = calls.stops.recv() => pulse.answer(*call),
            Some(call) = calls.commands.recv() => pulse.answer(*call),
            () = &mut interrupted => break,
            _ = beat.tick() => {
                if seq % lose_every == lose_every - 1 {
                    lost_before += 1;
                } else {
                    pulse.beat(seq, lost_before);
                    lost_before = 0;
                }
                seq += 1;
            }
        }
    }
    drop(alive);
    bus.close().await?;
    Ok(())
}

/// Completes at Ctrl-C; never if signals are not available.
async fn interrupted() {
    if tokio::signal::ctrl_c().await.is_err() {
        pending::<()>().await;
    }
}

struct Pulse {
    out: Publisher,
    start: Instant,
    /// The pretended run.
    run: Option<pb::RunState>,
    /// Number of events of that run so far.
    events: u64,
    rate_hz: f64,
}

impl Pulse {
    fn introduce(&self) {
        self.out.publish(&pb::SensorInfo {
            rig: RIG.to_owned(),
            array: RIG.to_owned(),
            rows: ROWS,
            cols: COLS,
            rate_hz: self.rate_hz,
            full_scale_counts: 4095.0,
            tick_ns: 0,
            link: "none".to_owned(),
            transport: "none".to_owned(),
            simulated: true,
        });
    }

    fn beat(&self, seq: u64, lost_before: u32) {
        let received = self.now();
        let phase = received.mono.seconds();
        let (spot_row, spot_col) = (2.5 + 2.0 * (0.7 * phase).sin(), 3.5 + 3.0 * (0.4 * phase).cos());
        let counts = (0..ROWS)
            .flat_map(|row| (0..COLS).map(move |col| (f64::from(row), f64::from(col))))
            .map(|(row, col)| {
                let squared = (row - spot_row).powi(2) + (col - spot_col).powi(2);
                (100.0 + 900.0 * (-squared / 2.0).exp()).round()
            })
            .map(as_counts)
            .collect();
        let gap = if lost_before > 0 { FrameFlags::GAP_BEFORE } else { FrameFlags::default() };
        self.out.publish_frame(&Frame {
            seq,
            epoch: 1,
            device_tick: None,
            received,
            counts,
            flags: gap,
            lost_before,
            simulated: true,
            bad_elements: [].into(),
            temperature_c: None,
        });
    }

    fn answer(&mut self, CommandCall { command, request, reply, .. }: CommandCall) {
        let refusal = match (command, request, &mut self.run) {
            (
                Command::Status | Command::Experiments | Command::Plan | Command::Reset | Command::Lease,
                ..,
            ) => None,
            (Command::Run, Request::Run(request), run) => {
                *run = Some(pb::RunState {
                    run_id: format!("{RIG}-1"),
                    experiment: request.experiment.clone(),
                    simulated: true,
                    ..Default::default()
                });
                self.events = 0;
                self.tell(Event::Started(pb::RunStarted {
                    experiment: request.experiment,
                    rig: RIG.to_owned(),
                    who: request.who,
                    simulated: true,
                    seed: request.seed.unwrap_or_default(),
                    parameters_json: request.parameters_json,
                    ..Default::default()
                }));
                self.enter(pb::RunPhase::Running);
                None
            }
            (_, _, None) => Some("no run is going on"),
            (Command::Pause, Request::Control(pb::CommandRequest { who, .. }), _) => {
                self.tell(Event::Paused(pb::Paused { by: who }));
                self.enter(pb::RunPhase::Paused);
                None
            }
            (Command::Resume, Request::Control(pb::CommandRequest { who, .. }), _) => {
                self.tell(Event::Resumed(pb::Resumed { by: who }));
                self.enter(pb::RunPhase::Running);
                None
            }
            (Command::Stop, ..) => {
                let exit_status = pb::ExitStatus::Stopped.into();
                self.tell(Event::Finished(pb::RunFinished { exit_status, ..Default::default() }));
                self.enter(pb::RunPhase::Finished);
                None
            }
            (Command::Run | Command::Pause | Command::Resume, ..) => Some("the request is another command's"),
        };
        reply.reply(pb::CommandReply {
            ok: refusal.is_none(),
            error: refusal.unwrap_or_default().to_owned(),
            exit_code: u32::from(refusal.is_some()),
            state: self.run.clone(),
            // Everybody gets it: nothing moves here.
            lease: Some(pb::Lease { holder: "everybody".to_owned(), expires_in_s: 5.0, lease: vec![1] }),
            rig: RIG.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            ..Default::default()
        });
    }

    fn enter(&mut self, phase: pb::RunPhase) {
        if let Some(run) = &mut self.run {
            run.set_phase(phase);
            self.out.publish(run);
        }
    }

    fn tell(&mut self, event: Event) {
        let now = self.now();
        self.out.publish(&pb::RunEvent {
            seq: self.events,
            run_id: self.run.as_ref().map(|run| run.run_id.clone()).unwrap_or_default(),
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            event: Some(event),
        });
        self.events += 1;
    }

    /// All times count from the start of the program; there is no wall clock.
    fn now(&self) -> TimeStamp {
        let mono = MonoTime::default().after(self.start.elapsed());
        TimeStamp { mono, wall: WallTime::from_ns(mono.ns()) }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "100 to 1000, rounded: exact in an f32")]
fn as_counts(value: f64) -> f32 {
    value as f32
}
