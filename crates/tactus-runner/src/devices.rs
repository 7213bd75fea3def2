//! From a rig description to started devices: the one place that knows every protocol and transport.

use std::sync::Arc;

use tactus_device::transport::Connect;
use tactus_device::transport::hid::HidConnector;
use tactus_device::transport::serial::SerialConnector;
use tactus_device::transport::tcp::TcpConnector;
use tactus_device::{ArrayExpectation, Clock, DrivenStage, SensorCodec, SensorDriver, StageOptions};
use tactus_engine::Devices;
use tactus_schema::Rig;
use tactus_schema::pb::StageState;
use tactus_schema::rig::{Service, Transport, UsbLink};
use tactus_virtual::{RigControl, Truth, VirtualRig};
use tokio::sync::mpsc;

/// Started devices, and the handle to the virtual ones among them.
#[derive(Debug)]
pub struct OpenedRig {
    /// Drivers for the engine.
    pub devices: Devices,
    /// Handle to the embedded virtual devices, if there are any.
    pub control: Option<RigControl>,
}

/// Starts the drivers of a rig, and virtual devices for transports that are `embedded`. `truth` makes the truth of those;
/// `codec` is the sensor's protocol, at both ends of the link.
///
/// Devices need not be connected yet: drivers wait for them.
pub fn open(
    rig: &Rig,
    service: &Service,
    codec: SensorCodec,
    truth: impl FnOnce() -> Truth,
    clock: Clock,
) -> OpenedRig {
    let embedded = [&service.sensor.transport, &service.stage.transport].contains(&&Transport::Embedded);
    let mut virtual_rig = embedded.then(|| VirtualRig::of(truth(), rig.covering, &codec));
    let sensor_link =
        connector(&service.sensor.transport, || virtual_rig.as_mut().map(VirtualRig::sensor_connector));
    let sensor = Box::new(SensorDriver::start(codec, sensor_link, ArrayExpectation::of(rig), clock));
    let embedded_stage = || virtual_rig.as_mut().map(VirtualRig::stage_connector);
    let (stage, stage_reports) = open_stage(rig, service, embedded_stage, clock);
    let control = virtual_rig.map(|rig| rig.control());
    let own_stage = service.stage.transport == Transport::Embedded;
    let change_covering = control.clone().filter(|_| own_stage).map(|control| {
        let change: Arc<dyn Fn(f64) + Send + Sync> =
            Arc::new(move |thickness_mm| control.set_covering_mm(thickness_mm));
        change
    });
    OpenedRig {
        devices: Devices { sensor, stage, stage_reports, change_covering, covering_memory: None },
        control,
    }
}

/// Starts the driver of a rig's stage alone; `embedded` connects to a virtual stage.
pub(crate) fn open_stage(
    rig: &Rig,
    service: &Service,
    embedded: impl FnOnce() -> Option<Box<dyn Connect>>,
    clock: Clock,
) -> (Arc<DrivenStage>, mpsc::Receiver<StageState>) {
    let options = StageOptions { tolerance_mm: service.motion.tolerance_mm, simulated: rig.simulated };
    let link = connector(&service.stage.transport, embedded);
    DrivenStage::start(link, &service.stage.protocol, options, clock)
}

fn connector(transport: &Transport, embedded: impl FnOnce() -> Option<Box<dyn Connect>>) -> Box<dyn Connect> {
    match physical(transport).or_else(embedded) {
        Some(connector) => connector,
        None => unreachable!("a virtual rig was started for every embedded transport"),
    }
}

/// The connector of a physical device; `None` for an embedded one.
pub fn physical(transport: &Transport) -> Option<Box<dyn Connect>> {
    Some(match transport {
        Transport::Serial { port, baud } => Box::new(SerialConnector::of(port.clone(), *baud)),
        Transport::Usb(link) => usb(link.clone()),
        Transport::Hid(link) => Box::new(HidConnector::new(link.clone())),
        Transport::Tcp { address } => Box::new(TcpConnector::new(address)),
        Transport::Embedded => return None,
    })
}

#[cfg(feature = "usb")]
fn usb(link: UsbLink) -> Box<dyn Connect> {
    Box::new(tactus_device::transport::usb::UsbConnector::new(link))
}

#[cfg(not(feature = "usb"))]
fn usb(link: UsbLink) -> Box<dyn Connect> {
    Box::new(tactus_device::transport::unbuilt::UnbuiltConnector::new(link))
}
