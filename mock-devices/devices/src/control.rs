//! The handle to a virtual rig: its true state, and its faults.

use std::sync::Arc;

use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until};

use crate::cable::CabledFault;
use crate::faults::{FaultError, FaultScript, InjectedFault, RigFault, SensorFault, StageFault};
use crate::truth::Truth;
use crate::world::SharedWorld;

/// Capacity of a device's queue of faults. A device takes them whenever it is awake, so a full queue means that it has ended.
/// A fault for a full queue is refused with [`FaultError::NotTaken`].
const FAULTS_WAITING: usize = 64;

/// Reads and changes the true state of a virtual rig. Clones are handles to the same rig.
///
/// Positions are in the robot frame. Values are those of the present instant.
#[derive(Debug, Clone)]
pub struct RigControl {
    world: SharedWorld,
    started: Instant,
    sensor: mpsc::Sender<CabledFault<SensorFault>>,
    stage: mpsc::Sender<CabledFault<StageFault>>,
}

/// The receiving ends of the injected faults.
#[derive(Debug)]
pub struct FaultReceivers {
    /// For the sensor and its cable.
    pub sensor: mpsc::Receiver<CabledFault<SensorFault>>,
    /// For the stage and its cable.
    pub stage: mpsc::Receiver<CabledFault<StageFault>>,
}

impl RigControl {
    pub(crate) fn new(world: SharedWorld, started: Instant) -> (Self, FaultReceivers) {
        let (sensor, sensor_tap) = mpsc::channel(FAULTS_WAITING);
        let (stage, stage_tap) = mpsc::channel(FAULTS_WAITING);
        (Self { world, started, sensor, stage }, FaultReceivers { sensor: sensor_tap, stage: stage_tap })
    }

    /// Injects a fault now.
    ///
    /// # Errors
    /// [`FaultError::Element`] for an element that the array does not have; [`FaultError::NotTaken`].
    pub fn inject(&self, fault: InjectedFault) -> Result<(), FaultError> {
        match fault {
            InjectedFault::Sensor(fault) => {
                self.check_element(fault)?;
                send(&self.sensor, CabledFault::Device(fault))
            }
            InjectedFault::SensorCable(fault) => send(&self.sensor, CabledFault::Cable(fault)),
            InjectedFault::Stage(fault) => send(&self.stage, CabledFault::Device(fault)),
            InjectedFault::StageCable(fault) => send(&self.stage, CabledFault::Cable(fault)),
            InjectedFault::Rig(RigFault::Covering { thickness_mm }) => {
                self.set_covering_mm(thickness_mm);
                Ok(())
            }
            InjectedFault::Rig(RigFault::Surface { z_mm }) => {
                self.world.lock().set_surface_mm(z_mm, Instant::now());
                Ok(())
            }
            InjectedFault::Rig(RigFault::Stiffness(factor)) => {
                self.world.lock().set_stiffness(factor);
                Ok(())
            }
        }
    }

    /// Injects a script's faults, each at its time since the rig was switched on.
    ///
    /// # Errors
    /// As [`inject`](Self::inject), at the first fault that is refused.
    pub async fn play(&self, script: &FaultScript) -> Result<(), FaultError> {
        for timed in &script.faults {
            sleep_until(self.started + timed.at).await;
            self.inject(timed.fault)?;
        }
        Ok(())
    }

    /// Puts another covering in place; its surface stays at the same height. A negative thickness counts as 0.
    pub fn set_covering_mm(&self, thickness_mm: f64) {
        self.world.lock().set_covering_mm(thickness_mm, Instant::now());
    }

    /// Thickness of the present covering.
    pub fn covering_mm(&self) -> f64 {
        self.world.lock().covering_mm()
    }

    /// True position of the tip.
    pub fn tip_mm(&self) -> [f64; 3] {
        self.world.lock().tip_mm(Instant::now())
    }

    /// True depth of the tip below the covering's true surface; negative above it.
    pub fn depth_mm(&self) -> f64 {
        self.world.lock().depth_mm(Instant::now())
    }

    /// The greatest true depth at any instant since the present covering was put in place; negative if the tip has never
    /// touched it.
    pub fn deepest_mm(&self) -> f64 {
        self.world.lock().deepest_mm(Instant::now())
    }

    /// True position of the tip at an instant that is not before the last change, for tests that keep their own time.
    pub fn tip_at_mm(&self, at: Instant) -> [f64; 3] {
        self.world.lock().tip_mm(at)
    }

    /// The greatest true depth until an instant, for tests that keep their own time. Exact between events, too: on a straight
    /// way the greatest depth is at an end.
    pub fn deepest_by_mm(&self, now: Instant) -> f64 {
        self.world.lock().deepest_mm(now)
    }

    /// True while the tip touches the covering.
    pub fn is_in_contact(&self) -> bool {
        self.depth_mm() > 0.0
    }

    /// True while the tip moves.
    pub fn is_moving(&self) -> bool {
        let mut world = self.world.lock();
        world.settle(Instant::now());
        world.is_moving()
    }

    /// Present reading of every element without noise and quantisation, counts, row-major.
    pub fn image_counts(&self) -> Vec<f64> {
        self.world.lock().image(Instant::now())
    }

    /// Number of readings of the whole array that the sensor has taken since the rig was switched on.
    pub fn samplings(&self) -> u64 {
        self.world.lock().samplings()
    }

    /// What the rig hides from the service.
    pub fn truth(&self) -> Arc<Truth> {
        Arc::clone(self.world.lock().truth())
    }

    fn check_element(&self, fault: SensorFault) -> Result<(), FaultError> {
        let (SensorFault::Stuck(element) | SensorFault::Saturate(element)) = fault else { return Ok(()) };
        let last = self.truth().model.array().elements() - 1;
        if element > last { Err(FaultError::Element { element, last }) } else { Ok(()) }
    }
}

fn send<F>(faults: &mpsc::Sender<CabledFault<F>>, fault: CabledFault<F>) -> Result<(), FaultError> {
    faults.try_send(fault).map_err(|_| FaultError::NotTaken)
}
