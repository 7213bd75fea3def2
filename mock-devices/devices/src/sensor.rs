//! The device side of a sensor: a tactile array in the virtual world, and its electronics.
//!
//! A `weiss-dsa` controller answers queries and the acquisition command, and sends frames on an exact grid of its rate.
//! `declared` and `anyskin` devices send frames from power-up on. `singletact` elements answer polls. If the protocol has
//! a field for it, the device says that it is simulated: the controller's serial numbers spell `SIM`, its matrix's unique
//! id `SIMULA`, the element's register `SIMULATED`. `declared` and `anyskin` have no such field.

mod codec;
mod crystal;
mod link_faults;

use std::collections::BTreeMap;
use std::time::Duration;

use tactus_device::SensorCodec;
use tactus_wire::weiss::{BOOT_MESSAGE, CommandError, ErrorCode, HostCommand, acknowledge, id};
use tokio::time::Instant;

use crate::cable::Device;
use crate::faults::{LinkDirection, SensorFault};
use crate::outbox::Outbox;
use crate::truth::RandomStream;
use crate::wire::Wire;
use crate::world::SharedWorld;
use codec::{DeviceCodec, HostRequest, Register};
use crystal::Crystal;
use link_faults::LinkFaults;

/// From power-up to the boot message. The real controller needs about 8 s; a shorter pause takes the driver through the
/// same states.
const BOOT: Duration = Duration::from_millis(100);

/// The boot message comes this often, as from the real controller.
const BOOT_MESSAGES: usize = 3;

/// The fault `clock-wrap` lets the clock wrap after this.
const WRAPS_AFTER: Duration = Duration::from_secs(1);

/// Samplings that are later than this are skipped: a machine too slow for the rate would otherwise never catch up.
const BACKLOG: Duration = Duration::from_secs(1);

/// A virtual tactile array and its electronics.
#[derive(Debug)]
pub struct VirtualSensor {
    world: SharedWorld,
    powered_up: Instant,
    /// Runs since then; its samplings and its clock follow it.
    crystal: Crystal,
    /// Its drift, which outlasts a power failure.
    drift_ppm: f64,
    clock_offset_ticks: i128,
    is_booting: bool,
    codec: DeviceCodec,
    acquisition: Option<Acquisition>,
    counts: Vec<u16>,
    /// Elements with the faults `stuck` and `saturate`, and their readings.
    overridden: BTreeMap<usize, u16>,
    /// Until then every reading is the last one.
    frozen_until: Option<Instant>,
    /// Added to every reading, and what will be from the next time it is plugged in.
    zeros_counts: u16,
    next_zeros_counts: u16,
    link_faults: LinkFaults,
    outbox: Outbox,
    /// Bytes from and to the host.
    heard: Wire,
    said: Wire,
}

/// An acquisition in progress.
#[derive(Debug, Clone, Copy)]
struct Acquisition {
    run_length: bool,
    rate_hz: f64,
    /// Number of the next sampling on the grid.
    next: u64,
}

impl VirtualSensor {
    /// A device that is switched on now and uses the protocol of `codec`.
    pub(crate) fn new(world: SharedWorld, codec: &SensorCodec, now: Instant) -> Self {
        let seed = world.lock().truth().seed;
        let mut sensor = Self {
            world,
            powered_up: now,
            crystal: Crystal::started(now),
            drift_ppm: 0.0,
            clock_offset_ticks: 0,
            is_booting: true,
            codec: DeviceCodec::of(codec),
            acquisition: None,
            counts: Vec::new(),
            overridden: BTreeMap::new(),
            frozen_until: None,
            zeros_counts: 0,
            next_zeros_counts: 0,
            link_faults: LinkFaults::new(seed),
            outbox: Outbox::default(),
            heard: Wire::new(RandomStream::ToSensor.rng(seed)),
            said: Wire::new(RandomStream::FromSensor.rng(seed)),
        };
        sensor.power_up(now);
        sensor
    }

    fn power_up(&mut self, now: Instant) {
        self.powered_up = now;
        self.crystal = Crystal::started(now);
        self.crystal.drift(self.drift_ppm, now);
        self.clock_offset_ticks = 0;
        self.codec.power_up();
        self.outbox.clear();
        self.is_booting = self.codec.boots();
        if self.is_booting {
            self.outbox.push(now + BOOT, BOOT_MESSAGE.repeat(BOOT_MESSAGES));
        }
        let rate_hz = self.own_rate_hz();
        self.acquisition =
            self.codec.streams().then_some(Acquisition { run_length: false, rate_hz, next: 1 });
    }

    fn answer(&mut self, asked: HostRequest, now: Instant) -> Vec<u8> {
        match asked {
            HostRequest::Weiss(command) => {
                let answer = self.execute(command, now);
                self.codec.close(answer)
            }
            HostRequest::SingleTact { address, id, asked } => {
                let element = self.codec.element_at(address);
                if element.is_some() && asked == Register::Reading {
                    self.sample(now);
                }
                let counts = element.and_then(|element| self.counts.get(element).copied().or(Some(0)));
                let (tick, rate_hz) = (self.tick(now), self.own_rate_hz());
                let running = self.crystal.running(now);
                self.link_faults
                    .frame(now, |_| codec::reply((address, id, asked), tick, running, rate_hz, counts))
            }
        }
    }

    fn execute(&mut self, command: Result<HostCommand, CommandError>, now: Instant) -> Vec<u8> {
        match command {
            Ok(HostCommand::QueryController) => codec::controller(),
            Ok(HostCommand::QuerySensor) => codec::sensor(),
            Ok(HostCommand::QueryMatrix { matrix }) => codec::matrix(matrix, self.world.lock().truth()),
            Ok(HostCommand::Acquire { run, run_length, fps }) => {
                let rate_hz = rate(f64::from(fps), self.own_rate_hz());
                self.acquisition =
                    run.then(|| Acquisition { run_length, rate_hz, next: self.after(now, rate_hz) });
                acknowledge(id::ACQUIRE, ErrorCode::SUCCESS)
            }
            Err(CommandError::Unknown { id }) => acknowledge(id, ErrorCode::UNKNOWN_COMMAND),
            Err(CommandError::Length { id, .. }) => acknowledge(id, ErrorCode::FORMAT),
        }
    }

    fn own_rate_hz(&self) -> f64 {
        self.world.lock().truth().model.array().rate_hz()
    }

    /// Number of the first sampling after `now`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count from 0 on")]
    fn after(&self, now: Instant, rate_hz: f64) -> u64 {
        (self.crystal.running(now).as_secs_f64() * rate_hz).floor() as u64 + 1
    }

    /// Time of the next sampling, computed from the start of the grid, so that no rounding accumulates.
    fn instant(&self, acquisition: Acquisition) -> Instant {
        self.crystal.instant(Duration::from_secs_f64(acquisition.next as f64 / acquisition.rate_hz))
    }

    fn take_frame(&mut self, at: Instant, run_length: bool, period: Duration) {
        self.sample(at);
        let tick = self.tick(at);
        let Self { codec, link_faults, counts, .. } = self;
        let bytes = link_faults.frame(at, |elements| codec.frame(tick, counts, run_length, elements));
        if self.link_faults.is_dripping(at) {
            self.outbox.drip(at, period, &bytes);
        } else {
            self.outbox.push(at, bytes);
        }
    }

    fn sample(&mut self, at: Instant) {
        if self.frozen_until.is_some_and(|until| at < until) && !self.counts.is_empty() {
            return;
        }
        self.world.lock().sample(at, &mut self.counts);
        for count in &mut self.counts {
            *count = count.saturating_add(self.zeros_counts);
        }
        for (element, reading) in &self.overridden {
            if let Some(count) = self.counts.get_mut(*element) {
                *count = *reading;
            }
        }
    }

    /// Answers what has arrived from the host.
    fn hear(&mut self, now: Instant) {
        let bytes = self.heard.take_due(now);
        if self.is_booting || bytes.is_empty() {
            return;
        }
        for asked in self.codec.decode(&bytes) {
            let answer = self.answer(asked, now);
            if !self.link_faults.is_stalled(now) {
                self.outbox.push(now, answer);
            }
        }
    }

    /// Takes the samplings that are due.
    fn sample_due(&mut self, now: Instant) {
        if now >= self.powered_up + BOOT {
            self.is_booting = false;
        }
        while let Some(acquisition) = self.acquisition {
            let at = self.instant(acquisition);
            if at > now {
                break;
            }
            self.acquisition = Some(Acquisition { next: acquisition.next + 1, ..acquisition });
            if at + BACKLOG < now {
                self.codec.skip_frame();
                continue;
            }
            self.take_frame(at, acquisition.run_length, Duration::from_secs_f64(1.0 / acquisition.rate_hz));
        }
    }

    /// Reading of the device's clock, ticks; 0 if it has none.
    fn tick(&self, at: Instant) -> u64 {
        let running = self.crystal.running(at);
        self.codec.clock().map_or(0, |clock| clock.shows(running, self.clock_offset_ticks))
    }

    /// Present reading of an element, counts.
    fn reading(&mut self, element: usize, now: Instant) -> u16 {
        if self.counts.is_empty() {
            self.world.lock().sample(now, &mut self.counts);
        }
        self.counts.get(element).copied().unwrap_or(0)
    }
}

impl Device for VirtualSensor {
    type Fault = SensorFault;

    fn receive(&mut self, bytes: &[u8], now: Instant) {
        self.heard.push(bytes, now);
        self.hear(now);
    }

    fn wake(&mut self, now: Instant) {
        self.sample_due(now);
        self.hear(now);
    }

    fn next_wake(&self) -> Option<Instant> {
        let sampling = self.acquisition.map(|acquisition| self.instant(acquisition));
        let booted = self.is_booting.then_some(self.powered_up + BOOT);
        let wires = [self.heard.next_due(), self.said.next_due()];
        [sampling, booted, self.outbox.next_due()].into_iter().chain(wires).flatten().min()
    }

    fn output(&mut self, now: Instant) -> Vec<u8> {
        let bytes = self.outbox.take_due(now);
        let bytes = self.link_faults.pass(bytes);
        self.said.push(&bytes, now);
        self.said.take_due(now)
    }

    fn fault(&mut self, fault: SensorFault, now: Instant) {
        match fault {
            SensorFault::Link(fault) => self.link_faults.arm(fault, now),
            SensorFault::ClockJump { ms } => {
                let by = Duration::from_millis(ms.unsigned_abs());
                let ticks = self.codec.clock().map_or(0, |clock| clock.ticks(by));
                self.clock_offset_ticks += if ms < 0 { -ticks } else { ticks };
            }
            SensorFault::ClockWrap => {
                let shown = self.tick(now);
                if let Some(clock) = self.codec.clock() {
                    self.clock_offset_ticks += clock.until_wrap(shown, WRAPS_AFTER);
                }
            }
            SensorFault::ClockDrift { ppm } => {
                self.drift_ppm = f64::from(ppm);
                self.crystal.drift(self.drift_ppm, now);
            }
            SensorFault::Stuck(element) => {
                let reading = self.reading(element, now);
                self.overridden.insert(element, reading);
            }
            SensorFault::Saturate(element) => {
                let full_scale_counts = self.world.lock().truth().readout.read(f64::INFINITY, 0.0);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "whole and positive"
                )]
                self.overridden.insert(element, full_scale_counts.min(f64::from(u16::MAX)) as u16);
            }
            SensorFault::Freeze(duration) => self.frozen_until = Some(now + duration),
            SensorFault::Zeros(counts) => self.next_zeros_counts = counts,
            SensorFault::Wire(LinkDirection::FromHost, fault) => self.heard.arm(fault, now),
            SensorFault::Wire(LinkDirection::FromDevice, fault) => self.said.arm(fault, now),
            SensorFault::Clear => {
                self.overridden.clear();
                self.frozen_until = None;
                self.heard.clear();
                self.said.clear();
                self.link_faults.clear();
            }
        }
    }

    fn plugged_in(&mut self, now: Instant) {
        self.zeros_counts = self.next_zeros_counts;
        self.power_up(now);
    }
}

/// The rate at which the controller acquires when another is requested: the request if it is slower, else its own.
fn rate(asked_hz: f64, own_hz: f64) -> f64 {
    // The request has whole frames per second: one that rounds the own rate means the own rate.
    let kept_hz = if asked_hz > own_hz - 1.0 || asked_hz == 0.0 { own_hz } else { asked_hz };
    // Limits: the link's throughput, and a person's patience.
    kept_hz.clamp(0.001, 10_000.0)
}

#[cfg(test)]
#[path = "sensor_tests.rs"]
mod tests;
