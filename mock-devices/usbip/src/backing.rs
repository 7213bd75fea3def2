//! The devices behind USB functions: the virtual sensor and stage, which know nothing of USB.

use std::fmt;

use tactus_virtual::cable::{CabledFault, Device};
use tactus_virtual::faults::{CableFault, SensorFault, StageFault};
use tokio::sync::mpsc::Receiver;
use tokio::time::Instant;

/// The virtual device behind one function, with the faults that are injected into it.
#[derive(Debug)]
pub struct BackingDevice(Backing);

#[derive(Debug)]
enum Backing {
    Sensor(WithFaults<SensorFault>),
    Stage(WithFaults<StageFault>),
}

struct WithFaults<F> {
    device: Box<dyn Device<Fault = F>>,
    faults: Receiver<CabledFault<F>>,
}

impl<F: Send> WithFaults<F> {
    fn new(device: impl Device<Fault = F> + 'static, faults: Receiver<CabledFault<F>>) -> Self {
        Self { device: Box::new(device), faults }
    }

    async fn next_cable_fault(&mut self) -> Option<CableFault> {
        match self.faults.recv().await {
            Some(CabledFault::Cable(fault)) => Some(fault),
            Some(CabledFault::Device(fault)) => {
                self.device.fault(fault, Instant::now());
                None
            }
            // Nobody can inject faults any more.
            None => std::future::pending().await,
        }
    }
}

impl BackingDevice {
    /// The tactile array.
    pub fn sensor(
        device: impl Device<Fault = SensorFault> + 'static,
        faults: Receiver<CabledFault<SensorFault>>,
    ) -> Self {
        Self(Backing::Sensor(WithFaults::new(device, faults)))
    }

    /// The stage's controller.
    pub fn stage(
        device: impl Device<Fault = StageFault> + 'static,
        faults: Receiver<CabledFault<StageFault>>,
    ) -> Self {
        Self(Backing::Stage(WithFaults::new(device, faults)))
    }

    /// Waits for the next injected fault. The device takes its own at once (`None`); one of the cable is returned. Cancel-safe.
    pub(crate) async fn next_cable_fault(&mut self) -> Option<CableFault> {
        match &mut self.0 {
            Backing::Sensor(backing) => backing.next_cable_fault().await,
            Backing::Stage(backing) => backing.next_cable_fault().await,
        }
    }

    /// Takes bytes from the host.
    pub(crate) fn receive(&mut self, bytes: &[u8], now: Instant) {
        match &mut self.0 {
            Backing::Sensor(backing) => backing.device.receive(bytes, now),
            Backing::Stage(backing) => backing.device.receive(bytes, now),
        }
    }

    /// Does everything that is due. Returns the bytes that leave the device by `now`.
    pub(crate) fn wake(&mut self, now: Instant) -> Vec<u8> {
        fn wake<F: Send>(device: &mut dyn Device<Fault = F>, now: Instant) -> Vec<u8> {
            device.wake(now);
            device.output(now)
        }
        match &mut self.0 {
            Backing::Sensor(backing) => wake(&mut *backing.device, now),
            Backing::Stage(backing) => wake(&mut *backing.device, now),
        }
    }

    /// When something is due next.
    pub(crate) fn next_wake(&self) -> Option<Instant> {
        match &self.0 {
            Backing::Sensor(backing) => backing.device.next_wake(),
            Backing::Stage(backing) => backing.device.next_wake(),
        }
    }

    /// The cable is plugged in again.
    pub(crate) fn plugged_in(&mut self, now: Instant) {
        match &mut self.0 {
            Backing::Sensor(backing) => backing.device.plugged_in(now),
            Backing::Stage(backing) => backing.device.plugged_in(now),
        }
    }
}

impl<F> fmt::Debug for WithFaults<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WithFaults").finish_non_exhaustive()
    }
}
