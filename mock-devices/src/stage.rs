//! The device's side of `grbl`: a stage controller that moves the virtual world's tip.
//!
//! It does what Grbl 1.1 was seen to do, within what a stage needs: straight moves, jogs, hold and
//! resume, reset, homing, limits, alarms, settings. Each move begins and ends at rest. Machine and work
//! coordinates are the robot's frame. `$I` and a message behind the banner say that it is simulated.

mod controller;
mod gcode;
mod input;
mod report;
mod settings;

use std::time::Duration;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use tokio::time::Instant;

use crate::cable::Device;
use crate::faults::StageFault;
use crate::truth::Draw;
use crate::world::Shared;
use controller::Controller;

/// Garbage behind each echoed line.
const GARBAGE_BYTES: usize = 8;

/// A virtual stage controller and what is wrong with it.
#[derive(Debug)]
pub(crate) struct VirtualStage {
    controller: Controller,
    /// It neither listens nor speaks until then; what arrives waits.
    hung_until: Option<Instant>,
    unheard: Vec<u8>,
    echoes: bool,
    echo: Vec<u8>,
    rng: ChaCha8Rng,
}

impl VirtualStage {
    /// A controller that is switched on now.
    pub(crate) fn new(world: Shared, now: Instant) -> Self {
        let seed = world.lock().truth().seed;
        Self {
            controller: Controller::new(world, now),
            hung_until: None,
            unheard: Vec::new(),
            echoes: false,
            echo: Vec::new(),
            rng: Draw::StageLink.rng(seed),
        }
    }

    fn is_hung(&self, now: Instant) -> bool {
        self.hung_until.is_some_and(|until| now < until)
    }

    /// A line comes back as it went out, with garbage behind it.
    fn echo(&mut self, bytes: &[u8]) {
        for byte in bytes.iter().filter(|byte| **byte != b'?' && byte.is_ascii()) {
            self.echo.push(*byte);
            if *byte == b'\n' {
                let mut garbage = [0; GARBAGE_BYTES];
                self.rng.fill_bytes(&mut garbage);
                self.echo.extend(garbage);
                self.echo.extend(b"\r\n");
            }
        }
    }
}

impl Device for VirtualStage {
    type Fault = StageFault;

    fn receive(&mut self, bytes: &[u8], now: Instant) {
        if self.is_hung(now) {
            self.unheard.extend_from_slice(bytes);
            return;
        }
        if self.echoes {
            self.echo(bytes);
        }
        self.controller.receive(bytes, now);
    }

    fn wake(&mut self, now: Instant) {
        if self.is_hung(now) {
            self.controller.only_move(now);
            return;
        }
        self.controller.wake(now);
        if self.hung_until.take().is_some() {
            let unheard = std::mem::take(&mut self.unheard);
            self.controller.receive(&unheard, now);
        }
    }

    fn next_wake(&self) -> Option<Instant> {
        match self.hung_until {
            Some(until) => [Some(until), self.controller.limit_at()].into_iter().flatten().min(),
            None => self.controller.next_wake(),
        }
    }

    fn output(&mut self, now: Instant) -> Vec<u8> {
        if self.is_hung(now) {
            return Vec::new();
        }
        let mut bytes = std::mem::take(&mut self.echo);
        bytes.extend(self.controller.output(now));
        bytes
    }

    fn fault(&mut self, fault: StageFault, now: Instant) {
        match fault {
            StageFault::Controller(fault) => self.controller.fault(fault, now),
            StageFault::EchoGarbage => self.echoes = true,
            StageFault::Stall(duration) => {
                self.hung_until = Some(now + duration.max(Duration::from_millis(1)));
            }
            StageFault::Clear => {
                self.echoes = false;
                self.controller.mend();
            }
        }
    }

    fn plugged_in(&mut self, _now: Instant) {}
}

#[cfg(test)]
#[path = "stage_tests.rs"]
mod tests;
