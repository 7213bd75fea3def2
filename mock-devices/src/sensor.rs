//! The device's side of `weiss-dsa`: a tactile controller whose elements feel the virtual world.
//!
//! It answers the queries and the acquisition command and pushes frames on an exact grid of its rate.
//! Where the protocol has room for it, it says that it is simulated: serial numbers spell `SIM`, the
//! matrix's unique id `SIMULA`.

mod tamper;

use std::collections::BTreeMap;
use std::time::Duration;

use tactus_wire::weiss::{
    BOOT_MESSAGE, Command, CommandError, ControllerInfo, Decoder, ErrorCode, MatrixInfo, SensorInfo,
    acknowledge, id,
};
use tokio::time::Instant;

use crate::cable::Device;
use crate::faults::SensorFault;
use crate::outbox::Outbox;
use crate::world::Shared;
use tamper::Tamper;

/// From power-up to the boot message. The real controller needs about 8 s; a simulated rig would make
/// everybody wait for nothing, and a shorter pause takes the driver through the same states.
const BOOT: Duration = Duration::from_millis(100);

/// The boot message comes this often, as from the real controller.
const BOOT_MESSAGES: usize = 3;

/// A clock that is about to wrap does so after this.
const WRAPS_AFTER_MS: i64 = 1000;

/// Samplings that are later than this are passed over: a machine too slow for the rate would otherwise never catch up.
const BACKLOG: Duration = Duration::from_secs(1);

const SERIAL_NUMBER: u32 = u32::from_le_bytes(*b"SIM\0");

const MATRIX_UID: [u8; 6] = *b"SIMULA";

/// A virtual tactile controller.
#[derive(Debug)]
pub(crate) struct VirtualSensor {
    world: Shared,
    /// The clock's zero.
    powered_up: Instant,
    clock_offset_ms: i64,
    is_booting: bool,
    decoder: Decoder,
    acquisition: Option<Acquisition>,
    counts: Vec<u16>,
    /// Elements that do not read what they feel, with what they read instead.
    overridden: BTreeMap<usize, u16>,
    tamper: Tamper,
    outbox: Outbox,
}

/// Frames are being pushed.
#[derive(Debug, Clone, Copy)]
struct Acquisition {
    run_length: bool,
    rate_hz: f64,
    /// Number of the next sampling on the grid.
    next: u64,
}

impl VirtualSensor {
    /// A controller that is switched on now.
    pub(crate) fn new(world: Shared, now: Instant) -> Self {
        let truth = world.lock().truth().clone();
        let mut sensor = Self {
            world,
            powered_up: now,
            clock_offset_ms: 0,
            is_booting: true,
            decoder: Decoder::new(),
            acquisition: None,
            counts: Vec::new(),
            overridden: BTreeMap::new(),
            tamper: Tamper::new(truth.seed),
            outbox: Outbox::default(),
        };
        sensor.power_up(now);
        sensor
    }

    /// The world that its elements feel.
    pub(crate) fn world(&self) -> &Shared {
        &self.world
    }

    fn power_up(&mut self, now: Instant) {
        self.powered_up = now;
        self.clock_offset_ms = 0;
        self.is_booting = true;
        self.decoder = Decoder::new();
        self.acquisition = None;
        self.outbox.clear();
        self.outbox.push(now + BOOT, BOOT_MESSAGE.repeat(BOOT_MESSAGES));
    }

    fn answer(&mut self, command: Command, now: Instant) -> Vec<u8> {
        let truth = self.world.lock().truth().clone();
        let array = truth.model.array();
        match command {
            Command::QueryController => {
                ControllerInfo { serial_number: SERIAL_NUMBER, ..ControllerInfo::default() }.encode()
            }
            Command::QuerySensor => {
                SensorInfo { matrices: 1, serial_number: SERIAL_NUMBER, ..SensorInfo::default() }.encode()
            }
            #[expect(
                clippy::cast_possible_truncation,
                reason = "the protocol has single precision and 16 bits"
            )]
            Command::QueryMatrix { matrix: 0 } => MatrixInfo {
                element_mm: array.element_mm().map(|side| side as f32),
                cells_x: array.cols() as u16,
                cells_y: array.rows() as u16,
                uid: MATRIX_UID,
                full_scale: array.full_scale_counts() as f32,
                ..MatrixInfo::default()
            }
            .encode(),
            Command::QueryMatrix { .. } => acknowledge(id::MATRIX, ErrorCode::INDEX_OUT_OF_BOUNDS),
            Command::Acquire { run, run_length, fps } => {
                let rate_hz = rate(f64::from(fps), array.rate_hz());
                self.acquisition =
                    run.then(|| Acquisition { run_length, rate_hz, next: self.after(now, rate_hz) });
                acknowledge(id::ACQUIRE, ErrorCode::SUCCESS)
            }
        }
    }

    /// Number of the first sampling after `now`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count from 0 on")]
    fn after(&self, now: Instant, rate_hz: f64) -> u64 {
        (now.duration_since(self.powered_up).as_secs_f64() * rate_hz).floor() as u64 + 1
    }

    /// When a sampling takes place: computed from the grid's beginning, so that nothing adds up.
    fn instant(&self, acquisition: Acquisition) -> Instant {
        self.powered_up + Duration::from_secs_f64(acquisition.next as f64 / acquisition.rate_hz)
    }

    fn take_frame(&mut self, at: Instant, run_length: bool, period: Duration) {
        self.world.lock().sample(at, &mut self.counts);
        for (element, reading) in &self.overridden {
            if let Some(count) = self.counts.get_mut(*element) {
                *count = *reading;
            }
        }
        let timestamp_ms = self.timestamp_ms(at);
        let bytes = self.tamper.frame(timestamp_ms, &self.counts, run_length, at);
        if self.tamper.is_dripping(at) {
            self.outbox.drip(at, period, &bytes);
        } else {
            self.outbox.push(at, bytes);
        }
    }

    /// The controller's clock, which wraps.
    fn timestamp_ms(&self, at: Instant) -> u32 {
        let elapsed_ms = i64::try_from(at.duration_since(self.powered_up).as_millis()).unwrap_or(i64::MAX);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it wraps")]
        let timestamp_ms = elapsed_ms.wrapping_add(self.clock_offset_ms) as u32;
        timestamp_ms
    }

    /// What an element reads at present.
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
        if self.is_booting {
            return;
        }
        self.decoder.push(bytes);
        let mut decoder = std::mem::take(&mut self.decoder);
        while let Some(packet) = decoder.next_packet() {
            // Real firmware does not answer what it cannot read.
            let Ok(packet) = packet else { continue };
            let answer = match Command::parse(&packet) {
                Ok(command) => self.answer(command, now),
                Err(CommandError::Unknown { id }) => acknowledge(id, ErrorCode::UNKNOWN_COMMAND),
                Err(CommandError::Length { id, .. }) => acknowledge(id, ErrorCode::FORMAT),
            };
            if !self.tamper.is_stalled(now) {
                self.outbox.push(now, answer);
            }
        }
        self.decoder = decoder;
    }

    fn wake(&mut self, now: Instant) {
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
                continue;
            }
            self.take_frame(at, acquisition.run_length, Duration::from_secs_f64(1.0 / acquisition.rate_hz));
        }
    }

    fn next_wake(&self) -> Option<Instant> {
        let sampling = self.acquisition.map(|acquisition| self.instant(acquisition));
        let booted = self.is_booting.then_some(self.powered_up + BOOT);
        [sampling, booted, self.outbox.next_due()].into_iter().flatten().min()
    }

    fn output(&mut self, now: Instant) -> Vec<u8> {
        let bytes = self.outbox.take_due(now);
        self.tamper.pass(bytes)
    }

    fn fault(&mut self, fault: SensorFault, now: Instant) {
        match fault {
            SensorFault::Link(fault) => self.tamper.arm(fault, now),
            SensorFault::ClockJump { ms } => self.clock_offset_ms = self.clock_offset_ms.wrapping_add(ms),
            SensorFault::ClockWrap => {
                let to_go_ms = i64::from(u32::MAX - self.timestamp_ms(now));
                self.clock_offset_ms = self.clock_offset_ms.wrapping_add(to_go_ms - WRAPS_AFTER_MS);
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
            SensorFault::Clear => {
                self.overridden.clear();
                self.tamper.clear();
            }
        }
    }

    fn plugged_in(&mut self, now: Instant) {
        self.power_up(now);
    }
}

/// The rate that the controller keeps when asked for one: its own, but for slower ones.
fn rate(asked_hz: f64, own_hz: f64) -> f64 {
    // A whole number of frames per second that stands for the own rate is taken as it.
    let kept_hz = if asked_hz > own_hz - 1.0 || asked_hz == 0.0 { own_hz } else { asked_hz };
    // What the link could carry, and what a person could wait for.
    kept_hz.clamp(0.001, 10_000.0)
}

#[cfg(test)]
#[path = "sensor_tests.rs"]
mod tests;
