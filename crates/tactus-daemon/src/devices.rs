//! From a rig description to started devices: the one place that knows every protocol and transport.

use std::sync::Arc;

use tactus_device::transport::{Connect, serial::SerialConnector, tcp::TcpConnector};
use tactus_device::{ArrayExpectation, Clock, DrivenStage, StageOptions, WeissSensor};
use tactus_engine::Devices;
use tactus_mock::{RigControl, Truth, VirtualRig};
use tactus_schema::Rig;
use tactus_schema::rig::{SensorProtocol, Service, Transport};

/// Started devices, and the truth behind the virtual ones among them.
#[derive(Debug)]
pub struct Opened {
    /// For the engine.
    pub devices: Devices,
    /// Of the embedded virtual devices, if there are any.
    pub control: Option<RigControl>,
}

/// Starts the drivers of a rig, and its virtual devices where the rig says `embedded`; `truth` is what those hide.
///
/// Devices need not be there yet: drivers wait for them.
pub fn open(rig: &Rig, service: &Service, truth: impl FnOnce() -> Truth, clock: Clock) -> Opened {
    let embedded = [&service.sensor.transport, &service.stage.transport].contains(&&Transport::Embedded);
    let mut virtual_rig = embedded.then(|| VirtualRig::of(truth(), rig.covering));
    let sensor_link =
        connector(&service.sensor.transport, || virtual_rig.as_mut().map(VirtualRig::sensor_connector));
    let stage_link =
        connector(&service.stage.transport, || virtual_rig.as_mut().map(VirtualRig::stage_connector));
    let sensor = match service.sensor.protocol {
        SensorProtocol::WeissDsa => {
            Box::new(WeissSensor::start(sensor_link, ArrayExpectation::of(rig), clock))
        }
    };
    let (stage, stage_reports) =
        DrivenStage::start(stage_link, &service.stage.protocol, stage_options(rig, service), clock);
    let control = virtual_rig.map(|rig| rig.control());
    let own_stage = service.stage.transport == Transport::Embedded;
    let change_covering = control.clone().filter(|_| own_stage).map(|control| {
        let change: Arc<dyn Fn(f64) + Send + Sync> =
            Arc::new(move |thickness_mm| control.set_covering_mm(thickness_mm));
        change
    });
    Opened { devices: Devices { sensor, stage, stage_reports, change_covering }, control }
}

fn stage_options(rig: &Rig, service: &Service) -> StageOptions {
    StageOptions { tolerance_mm: service.motion.tolerance_mm, simulated: rig.simulated }
}

fn connector(transport: &Transport, embedded: impl FnOnce() -> Option<Box<dyn Connect>>) -> Box<dyn Connect> {
    match transport {
        Transport::Serial { path, baud } => Box::new(SerialConnector::new(path, *baud)),
        Transport::Tcp { address } => Box::new(TcpConnector::new(address)),
        Transport::Embedded => match embedded() {
            Some(connector) => connector,
            None => unreachable!("a virtual rig was started for every embedded transport"),
        },
    }
}
