//! A device on the test bench: driven by hand, with its own time.

use std::sync::Arc;
use std::time::Duration;

use tactus_schema::Rig;
use tokio::time::Instant;

use crate::cable::Device;
use crate::truth::Truth;
use crate::world::{SharedWorld, World};

pub(crate) const SIM_RIG: &str = include_str!("../../../config/rigs/sim.toml");

pub(crate) fn sim_rig() -> Rig {
    Rig::from_toml(SIM_RIG).unwrap()
}

pub(crate) fn world_of(rig: &Rig, seed: u64) -> SharedWorld {
    SharedWorld::new(World::new(Arc::new(Truth::of_rig(rig, seed)), rig.covering))
}

/// A device, the world around it, and the present instant.
pub(crate) struct DeviceBench<D> {
    pub(crate) device: D,
    pub(crate) world: SharedWorld,
    pub(crate) now: Instant,
}

impl<D: Device> DeviceBench<D> {
    pub(crate) fn new(rig: &Rig, seed: u64, device: impl FnOnce(SharedWorld, Instant) -> D) -> Self {
        let (world, now) = (world_of(rig, seed), Instant::now());
        Self { device: device(world.clone(), now), world, now }
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.device.receive(bytes, self.now);
    }

    pub(crate) fn fault(&mut self, fault: D::Fault) {
        self.device.fault(fault, self.now);
    }

    /// Lets time pass. Returns the chunks that the device sends, each with its time.
    pub(crate) fn chunks(&mut self, duration: Duration) -> Vec<(Instant, Vec<u8>)> {
        let end = self.now + duration;
        let mut chunks = Vec::new();
        loop {
            self.device.wake(self.now);
            let bytes = self.device.output(self.now);
            if !bytes.is_empty() {
                chunks.push((self.now, bytes));
            }
            match self.device.next_wake().filter(|wake| *wake <= end) {
                Some(wake) => self.now = self.now.max(wake),
                None => break,
            }
            assert!(chunks.len() < 100_000, "the device never rests");
        }
        self.now = end;
        chunks
    }

    /// Lets time pass. Returns all bytes that the device sends.
    pub(crate) fn bytes(&mut self, ms: u64) -> Vec<u8> {
        self.chunks(Duration::from_millis(ms)).into_iter().flat_map(|(_, bytes)| bytes).collect()
    }
}
