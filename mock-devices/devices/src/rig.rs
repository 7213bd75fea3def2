//! A whole virtual rig: both devices, their world, and its handle.

use std::fmt;
use std::sync::Arc;

use futures_util::future::BoxFuture;
use tactus_device::transport::memory::{self, MemoryConnector};
use tactus_device::transport::{ByteStream, Connect};
use tactus_device::{DeviceError, SensorCodec};
use tactus_model::Covering;
use tactus_schema::Rig;
use tokio::time::Instant;

use crate::cable::{self, Port};
use crate::control::{FaultReceivers, RigControl};
use crate::sensor::VirtualSensor;
use crate::stage::VirtualStage;
use crate::truth::Truth;
use crate::world::{SharedWorld, World};

/// Both devices of a simulated rig, in this process.
///
/// They run from [`start`](Self::start) until the runtime ends, whether or not a host is connected.
#[derive(Debug)]
pub struct VirtualRig {
    sensor: Arc<MemoryConnector>,
    stage: Arc<MemoryConnector>,
    control: RigControl,
}

impl VirtualRig {
    /// Switches the rig on, within a tokio runtime. `seed` replaces the rig's own. Equal seeds give equal bytes in virtual
    /// time.
    ///
    /// A rig without a simulation behaves as its description says, without noise; see [`twin_of`](crate::twin_of). The
    /// sensor uses the rig file's protocol. `declared` needs another file, so it is replaced by the default protocol.
    ///
    /// # Panics
    /// Outside of a tokio runtime.
    pub fn start(rig: &Rig, seed: u64) -> Self {
        let codec = rig.service.as_ref().and_then(|service| SensorCodec::of(&service.sensor.protocol));
        Self::of(Truth::of_rig(rig, seed), rig.covering, &codec.unwrap_or_default())
    }

    /// As [`start`](Self::start), with any truth, covering and protocol of the sensor.
    ///
    /// # Panics
    /// Outside of a tokio runtime, and of a truth that was not made by its own constructors.
    pub fn of(truth: Truth, covering: Covering, codec: &SensorCodec) -> Self {
        let (sensor, sensor_port) = memory::pair("sensor");
        let (stage, stage_port) = memory::pair("stage");
        let started = start_devices(truth, covering, codec, Instant::now());
        // A device in memory never fails.
        tokio::spawn(cable::run(started.sensor, Port::Memory(sensor_port), started.faults.sensor));
        tokio::spawn(cable::run(started.stage, Port::Memory(stage_port), started.faults.stage));
        Self { sensor: Arc::new(sensor), stage: Arc::new(stage), control: started.control }
    }

    /// Connects a driver to the sensor.
    pub fn sensor_connector(&mut self) -> Box<dyn Connect> {
        Box::new(Outlet(Arc::clone(&self.sensor)))
    }

    /// Connects a driver to the stage.
    pub fn stage_connector(&mut self) -> Box<dyn Connect> {
        Box::new(Outlet(Arc::clone(&self.stage)))
    }

    /// Handle to the true state and the faults.
    pub fn control(&self) -> RigControl {
        self.control.clone()
    }
}

/// Devices that are switched on, but not yet connected to anything.
#[derive(Debug)]
pub struct Started {
    /// Takes [`faults.sensor`](FaultReceivers::sensor).
    pub sensor: VirtualSensor,
    /// Takes [`faults.stage`](FaultReceivers::stage).
    pub stage: VirtualStage,
    /// Faults that [`control`](Self::control) injects.
    pub faults: FaultReceivers,
    /// Handle to the true state and the faults.
    pub control: RigControl,
}

/// Switches both devices on, connected to nothing. `codec` is the protocol of the sensor.
///
/// # Panics
/// Of a truth that was not made by its own constructors.
pub fn start_devices(truth: Truth, covering: Covering, codec: &SensorCodec, now: Instant) -> Started {
    let world = SharedWorld::new(World::new(Arc::new(truth), covering));
    let (control, faults) = RigControl::new(world.clone(), now);
    let sensor = VirtualSensor::new(world.clone(), codec, now);
    let stage = VirtualStage::new(world, now);
    Started { sensor, stage, faults, control }
}

/// A connector that can be handed out more than once.
struct Outlet(Arc<MemoryConnector>);

impl Connect for Outlet {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        self.0.connect()
    }
}

impl fmt::Display for Outlet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
