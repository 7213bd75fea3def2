//! The devices behind a USB device's functions: the virtual sensor and stage, which know nothing of USB.

use std::fmt;

use tokio::sync::mpsc::Receiver;
use tokio::time::Instant;

use crate::cable::{Device, Strike};
use crate::faults::{CableFault, SensorFault, StageFault};

/// A device with its control.
pub(super) enum Behind {
    /// The array.
    Sensor(Tapped<SensorFault>),
    /// The robot.
    Stage(Tapped<StageFault>),
}

pub(super) struct Tapped<F> {
    device: Box<dyn Device<Fault = F>>,
    strikes: Receiver<Strike<F>>,
}

impl<F: Send> Tapped<F> {
    pub(super) fn new(device: impl Device<Fault = F> + 'static, strikes: Receiver<Strike<F>>) -> Self {
        Self { device: Box::new(device), strikes }
    }

    async fn next_cable_fault(&mut self) -> Option<CableFault> {
        match self.strikes.recv().await {
            Some(Strike::Cable(fault)) => Some(fault),
            Some(Strike::Device(fault)) => {
                self.device.fault(fault, Instant::now());
                None
            }
            // Nobody can strike any more.
            None => std::future::pending().await,
        }
    }
}

impl Behind {
    /// Waits for the next fault. One of the device has it at once; one of the cable is returned. Cancel-safe.
    pub(super) async fn struck(&mut self) -> Option<CableFault> {
        match self {
            Self::Sensor(tapped) => tapped.next_cable_fault().await,
            Self::Stage(tapped) => tapped.next_cable_fault().await,
        }
    }

    /// Bytes from the host.
    pub(super) fn receive(&mut self, bytes: &[u8], now: Instant) {
        match self {
            Self::Sensor(tapped) => tapped.device.receive(bytes, now),
            Self::Stage(tapped) => tapped.device.receive(bytes, now),
        }
    }

    /// Time has passed; gives what leaves the device by now.
    pub(super) fn wake(&mut self, now: Instant) -> Vec<u8> {
        fn wake<F: Send>(device: &mut dyn Device<Fault = F>, now: Instant) -> Vec<u8> {
            device.wake(now);
            device.output(now)
        }
        match self {
            Self::Sensor(tapped) => wake(&mut *tapped.device, now),
            Self::Stage(tapped) => wake(&mut *tapped.device, now),
        }
    }

    /// When it wants to be woken.
    pub(super) fn next_wake(&self) -> Option<Instant> {
        match self {
            Self::Sensor(tapped) => tapped.device.next_wake(),
            Self::Stage(tapped) => tapped.device.next_wake(),
        }
    }

    /// The cable has been plugged in again.
    pub(super) fn plugged_in(&mut self, now: Instant) {
        match self {
            Self::Sensor(tapped) => tapped.device.plugged_in(now),
            Self::Stage(tapped) => tapped.device.plugged_in(now),
        }
    }
}

impl fmt::Debug for Behind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sensor(_) => "Sensor",
            Self::Stage(_) => "Stage",
        })
    }
}
