//! Devices that speak `zaber-ascii`, all on one serial line; each axis moves by itself.
//!
//! They follow Zaber's protocol description (see [`tactus_wire::zaber`]), as far as a stage needs it: moves, homing, stops,
//! warnings, and the settings that a session reads or writes. Position 0 and travel are the rig's. Homing goes to the
//! least x and y and the greatest z. An info message after the version says that they are simulated.

mod axis;

use std::time::Duration;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tactus_wire::stage::AxisName;
use tactus_wire::zaber::{Config, Flag, Header, HostCommand, HostCommandDecoder, Message, Rejection};
use tokio::time::Instant;

use super::Controller;
use crate::faults::ControllerFault;
use crate::outbox::Outbox;
use crate::truth::RandomStream;
use crate::world::SharedWorld;
use axis::VirtualAxis;

/// Delay from a command to its reply.
const REPLY_LATENCY_MS: std::ops::RangeInclusive<u64> = 1..=3;

/// Answer of all devices to `get version`.
const VERSION: &str = "7.38";

/// The devices of a stage.
#[derive(Debug)]
pub(super) struct ZaberController {
    world: SharedWorld,
    axes: Vec<VirtualAxis>,
    ear: HostCommandDecoder,
    outbox: Outbox,
    /// Devices whose messages carry checksums.
    checksums: Vec<u8>,
    rng: ChaCha8Rng,
    defects: Defects,
}

/// Lasting faults.
#[derive(Debug, Default)]
struct Defects {
    lie_z_mm: f64,
    is_never_idle: bool,
    ignores_moves: bool,
    refuses_next: bool,
}

impl ZaberController {
    pub(super) fn new(world: SharedWorld, config: &Config, now: Instant) -> Self {
        let truth = world.lock().truth().clone();
        let named = AxisName::ALL.into_iter().zip(config.axes);
        let axes = named.filter_map(|(name, axis)| Some(VirtualAxis::new(name, axis?, truth.stage)));
        let mut controller = Self {
            axes: axes.collect(),
            world,
            ear: HostCommandDecoder::default(),
            outbox: Outbox::default(),
            checksums: Vec::new(),
            rng: RandomStream::StageController.rng(truth.seed),
            defects: Defects::default(),
        };
        controller.power_up(now);
        controller
    }

    /// Restarts as after a power failure: every axis believes that it is at its 0. Settings are kept.
    fn power_up(&mut self, now: Instant) {
        self.ear = HostCommandDecoder::default();
        self.outbox.clear();
        let mut world = self.world.lock();
        world.settle(now);
        for axis in &mut self.axes {
            axis.power_up(&mut world, now);
        }
    }

    /// Each addressed device answers a command once.
    fn obey(&mut self, command: &HostCommand, now: Instant) {
        let mut devices: Vec<u8> = self.axes.iter().map(VirtualAxis::device).collect();
        devices.sort_unstable();
        devices.dedup();
        for device in devices.into_iter().filter(|device| command.device == 0 || command.device == *device) {
            self.answer(device, command, now);
        }
    }

    fn answer(&mut self, device: u8, command: &HostCommand, now: Instant) {
        let axis_count =
            self.axes.iter().filter(|axis| axis.device() == device).map(VirtualAxis::number).max();
        let result = match command.text.split_ascii_whitespace().collect::<Vec<_>>()[..] {
            _ if command.axis > axis_count.unwrap_or(0) => Err(Rejection::BadAxis),
            ["get", "version" | "system.axiscount"] | ["set", "comm.checksum", _] if command.axis > 0 => {
                Err(Rejection::DeviceOnly)
            }
            ["get", "version"] => Ok(VERSION.to_owned()),
            ["get", "system.axiscount"] => Ok(axis_count.unwrap_or(0).to_string()),
            ["set", "comm.checksum", value @ ("0" | "1")] => {
                self.checksums.retain(|checked| *checked != device);
                if value == "1" {
                    self.checksums.push(device);
                }
                Ok("0".to_owned())
            }
            ref words => self.obey_axes(device, command.axis, words, now),
        };
        let has_told_version = command.text == "get version" && result.is_ok();
        let accepted = result.is_ok();
        let data = result.unwrap_or_else(|rejection| rejection.word().to_owned());
        let header = Header { device, axis: command.axis, id: command.id };
        let (busy, flag) = self.status(device, command.axis);
        self.say(&Message::Reply { header, accepted, busy, flag, data }, now);
        if has_told_version {
            self.say(&Message::Info { header, data: "Simulated stage".to_owned() }, now);
        }
    }

    /// Executes a command on an axis of a device, or on all its axes (axis 0).
    fn obey_axes(
        &mut self,
        device: u8,
        number: u8,
        words: &[&str],
        now: Instant,
    ) -> Result<String, Rejection> {
        let defects = &mut self.defects;
        let mut world = self.world.lock();
        let mut answers = Vec::new();
        let is_meant =
            |axis: &&mut VirtualAxis| axis.device() == device && (number == 0 || axis.number() == number);
        for axis in self.axes.iter_mut().filter(is_meant) {
            let moves = matches!(words, ["move", ..]);
            if moves && std::mem::take(&mut defects.refuses_next) {
                return Err(Rejection::BadData);
            }
            let lie_mm = if axis.name() == AxisName::Z { defects.lie_z_mm } else { 0.0 };
            let stays = moves && defects.ignores_moves;
            answers.push(axis.obey(&mut world, words, lie_mm, stays, now)?);
        }
        match answers.first() {
            None => Err(Rejection::BadAxis),
            // Equal answers are sent once, different ones side by side.
            Some(first) if answers.iter().all(|answer| answer == first) => Ok(first.clone()),
            Some(_) => Ok(answers.join(" ")),
        }
    }

    /// Whether an axis of a device moves (any of them with axis 0), and the most serious flag.
    fn status(&self, device: u8, number: u8) -> (bool, Flag) {
        let mut world = self.world.lock();
        let meant = self
            .axes
            .iter()
            .filter(|axis| axis.device() == device && (number == 0 || axis.number() == number));
        meant.fold((false, Flag::NONE), |(busy, flag), axis| {
            let moves = self.defects.is_never_idle || axis.is_busy(&mut world);
            (busy || moves, axis::graver(flag, axis.flag()))
        })
    }

    /// The next homing of z finds no sensor.
    fn fail_homing(&mut self, fails: bool) {
        for z in self.axes.iter_mut().filter(|axis| axis.name() == AxisName::Z) {
            z.fail_homing(fails);
        }
    }

    fn say(&mut self, message: &Message, now: Instant) {
        let due = now + Duration::from_millis(self.rng.random_range(REPLY_LATENCY_MS));
        let bytes = message.encode(self.checksums.contains(&message.header().device));
        self.outbox.push(due, bytes);
    }
}

impl Controller for ZaberController {
    fn receive(&mut self, bytes: &[u8], now: Instant) {
        self.wake(now);
        let mut commands = Vec::new();
        self.ear.push(bytes, |command| commands.push(command));
        for command in commands {
            self.obey(&command, now);
            self.only_move(now);
        }
    }

    fn wake(&mut self, now: Instant) {
        self.only_move(now);
    }

    fn only_move(&mut self, now: Instant) {
        let mut world = self.world.lock();
        for axis in &mut self.axes {
            axis.run_into_limit(&mut world, now);
        }
        world.settle(now);
        for axis in &mut self.axes {
            axis.settle(&mut world, now);
        }
    }

    fn next_wake(&self) -> Option<Instant> {
        let mut world = self.world.lock();
        let axes = self.axes.iter().filter_map(|axis| axis.next_wake(&mut world)).min();
        [self.outbox.next_due(), axes].into_iter().flatten().min()
    }

    fn limit_at(&self) -> Option<Instant> {
        self.axes.iter().filter_map(VirtualAxis::limit_at).min()
    }

    fn output(&mut self, now: Instant) -> Vec<u8> {
        self.outbox.take_due(now)
    }

    fn fault(&mut self, fault: ControllerFault, now: Instant) {
        self.only_move(now);
        match fault {
            // Zaber's faults have no numbers: z stalls.
            ControllerFault::Alarm(_) => {
                let mut world = self.world.lock();
                if let Some(z) = self.axes.iter_mut().find(|axis| axis.name() == AxisName::Z) {
                    z.stall(&mut world, now);
                }
            }
            ControllerFault::Lie { z_mm } => self.defects.lie_z_mm = z_mm,
            ControllerFault::NeverIdle => self.defects.is_never_idle = true,
            ControllerFault::Refuse(_) => self.defects.refuses_next = true,
            ControllerFault::IgnoreMoves => self.defects.ignores_moves = true,
            ControllerFault::LostSteps { lost_mm } => {
                let mut world = self.world.lock();
                for axis in &self.axes {
                    axis.lose_steps(&mut world, lost_mm);
                }
            }
            ControllerFault::WorkOffset { .. } => {}
            ControllerFault::HomingFails => self.fail_homing(true),
            ControllerFault::Reset => self.power_up(now),
        }
    }

    fn mend(&mut self) {
        self.defects = Defects::default();
        self.fail_homing(false);
    }
}

#[cfg(test)]
#[path = "zaber_tests.rs"]
mod tests;
