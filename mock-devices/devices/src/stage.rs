//! The device side of a stage: a controller that moves the virtual world's tip, and the serial line to it.
//!
//! The rig file selects its protocol: [`grbl`] or [`zaber`]. Kinematics and faults are the same.

mod grbl;
mod zaber;

use std::time::Duration;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use tactus_device::{grbl_config, zaber_config};
use tactus_schema::rig::StageProtocol;
use tokio::time::Instant;

use crate::cable::Device;
use crate::faults::{ControllerFault, LinkDirection, StageFault};
use crate::truth::RandomStream;
use crate::wire::Wire;
use crate::world::SharedWorld;
use grbl::GrblController;
use zaber::ZaberController;

/// A placeholder: only the driver's side of a protocol uses the tolerance of the configuration.
const NO_MATTER_MM: f64 = 1.0;

/// Bytes of garbage after each echoed line.
const GARBAGE_BYTES: usize = 8;

/// A virtual stage controller with its faults.
#[derive(Debug)]
pub struct VirtualStage {
    controller: Box<dyn Controller>,
    /// Bytes from and to the host.
    heard: Wire,
    said: Wire,
    /// Until then it neither receives nor sends; received bytes wait.
    hung_until: Option<Instant>,
    unheard: Vec<u8>,
    echoes: bool,
    echo: Vec<u8>,
    rng: ChaCha8Rng,
}

/// A controller as a state machine of bytes and times. Times never go back.
trait Controller: std::fmt::Debug + Send {
    /// Takes bytes from the host.
    fn receive(&mut self, bytes: &[u8], now: Instant);

    /// Does what is due.
    fn wake(&mut self, now: Instant);

    /// Advances the motion to `now`, with its consequences.
    fn only_move(&mut self, now: Instant);

    /// When something is due.
    fn next_wake(&self) -> Option<Instant>;

    /// When the tip hits a limit, whether or not the controller receives.
    fn limit_at(&self) -> Option<Instant>;

    /// Takes the bytes that leave it by `now`.
    fn output(&mut self, now: Instant) -> Vec<u8>;

    /// Injects a fault.
    fn fault(&mut self, fault: ControllerFault, now: Instant);

    /// Ends all lasting faults.
    fn mend(&mut self);
}

impl VirtualStage {
    /// A controller that is switched on now.
    pub(crate) fn new(world: SharedWorld, now: Instant) -> Self {
        let (seed, protocol) = {
            let world = world.lock();
            (world.truth().seed, world.truth().stage_protocol.clone())
        };
        let controller: Box<dyn Controller> = match protocol {
            StageProtocol::Grbl(axes) => {
                Box::new(GrblController::new(world, grbl_config(&axes, NO_MATTER_MM), now))
            }
            StageProtocol::Zaber(axes) => {
                Box::new(ZaberController::new(world, &zaber_config(&axes, NO_MATTER_MM), now))
            }
        };
        Self {
            controller,
            heard: Wire::new(RandomStream::ToStage.rng(seed)),
            said: Wire::new(RandomStream::FromStage.rng(seed)),
            hung_until: None,
            unheard: Vec::new(),
            echoes: false,
            echo: Vec::new(),
            rng: RandomStream::StageLink.rng(seed),
        }
    }

    fn is_hung(&self, now: Instant) -> bool {
        self.hung_until.is_some_and(|until| now < until)
    }

    /// Takes the bytes that have arrived from the host.
    fn hear(&mut self, now: Instant) {
        let bytes = self.heard.take_due(now);
        if bytes.is_empty() {
            return;
        }
        if self.is_hung(now) {
            self.unheard.extend_from_slice(&bytes);
            return;
        }
        if self.echoes {
            self.echo(&bytes);
        }
        self.controller.receive(&bytes, now);
    }

    fn wake_controller(&mut self, now: Instant) {
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

    /// Sends a received line back, followed by garbage.
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
        self.heard.push(bytes, now);
        self.hear(now);
    }

    fn wake(&mut self, now: Instant) {
        self.wake_controller(now);
        self.hear(now);
    }

    fn next_wake(&self) -> Option<Instant> {
        let controller = match self.hung_until {
            Some(until) => [Some(until), self.controller.limit_at()].into_iter().flatten().min(),
            None => self.controller.next_wake(),
        };
        [controller, self.heard.next_due(), self.said.next_due()].into_iter().flatten().min()
    }

    fn output(&mut self, now: Instant) -> Vec<u8> {
        if !self.is_hung(now) {
            let mut bytes = std::mem::take(&mut self.echo);
            bytes.extend(self.controller.output(now));
            self.said.push(&bytes, now);
        }
        self.said.take_due(now)
    }

    fn fault(&mut self, fault: StageFault, now: Instant) {
        match fault {
            StageFault::Controller(fault) => self.controller.fault(fault, now),
            StageFault::Wire(LinkDirection::FromHost, fault) => self.heard.arm(fault, now),
            StageFault::Wire(LinkDirection::FromDevice, fault) => self.said.arm(fault, now),
            StageFault::EchoGarbage => self.echoes = true,
            StageFault::Stall(duration) => {
                self.hung_until = Some(now + duration.max(Duration::from_millis(1)));
            }
            StageFault::Clear => {
                self.echoes = false;
                self.heard.clear();
                self.said.clear();
                self.controller.mend();
            }
        }
    }

    fn plugged_in(&mut self, _now: Instant) {}
}
