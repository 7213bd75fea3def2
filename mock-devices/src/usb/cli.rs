//! `tactus-mock usb`: the rig's devices as USB devices of this machine.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde_json::json;
use tactus_device::SensorCodec;
use tactus_wire::declared::{Format, RawFormat};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinSet;

use super::behind::{Behind, Tapped};
use super::command::Command;
use super::descriptor::Speed;
use super::function::Function;
use super::function::acm::Acm;
use super::function::bulk::Bulk;
use super::function::ftdi::Ftdi;
use super::function::hid::{Hid, REPORT_BYTES_MAX};
use super::gadget::Gadget;
use super::identity::Identity;
use super::plug::{Order, Plug};
use super::vhci::{Vhci, VhciError};
use crate::cli::{Source, SourceArgs, read, until_terminated};
use crate::control::{RigControl, Taps};
use crate::faults::{Fault, LinkFault, SensorFault};
use crate::rig::Started;
use crate::stage::VirtualStage;

/// Orders that may wait for a plug: one line is answered before the next is read.
const ORDERS_WAITING: usize = 1;

#[derive(Debug, Args)]
pub(crate) struct UsbArgs {
    #[command(flatten)]
    source: SourceArgs,
    /// Plug in the sensor, as one of these.
    #[arg(long, value_name = "KIND")]
    sensor: Option<SensorKind>,
    /// Plug in the stage, as one of these.
    #[arg(long, value_name = "KIND")]
    stage: Option<StageKind>,
    /// Both as one device, on one cable.
    #[arg(long, requires = "sensor", requires = "stage")]
    composite: bool,
    /// The format of the sensor's frames (`config/links`), in the place of what the rig file says; `hid` and `bulk` need
    /// one, for `hid` with `[hid]`.
    #[arg(long, value_name = "FILE")]
    link: Option<PathBuf>,
    /// The sensor's serial number, in the place of SIM-SENSOR; it begins with SIM.
    #[arg(long, value_name = "TEXT", value_parser = simulated_serial)]
    serial: Option<String>,
    /// Print what was plugged in as one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SensorKind {
    /// A serial port by USB's own class.
    CdcAcm,
    /// A serial port by FTDI's chip.
    Ftdi,
    /// A device of reports, each a frame.
    Hid,
    /// A device with a bulk endpoint, each transfer a frame.
    Bulk,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum StageKind {
    /// A serial port by USB's own class; grbl.
    CdcAcm,
    /// A serial port by FTDI's chip; grbl.
    Ftdi,
}

/// What a function is, with all that making it needs.
#[derive(Debug, Clone)]
enum Shape {
    Acm,
    Ftdi,
    Hid { report_bytes: u16, number: Option<u8> },
    Bulk { frame_bytes: usize },
}

/// A device of the rig that is to be plugged in.
struct Unit {
    /// As in commands.
    name: &'static str,
    shape: Shape,
    behind: Behind,
}

/// Where the orders for a device of the rig go.
struct Desk {
    name: &'static str,
    function: usize,
    orders: mpsc::Sender<Order>,
}

impl UsbArgs {
    /// Plugs the devices in and runs until the program is terminated.
    pub(crate) async fn serve(self) -> Result<()> {
        if self.sensor.is_none() && self.stage.is_none() {
            bail!("nothing to plug in: give --sensor, --stage or both");
        }
        let source = self.source_speaking()?;
        let format = match source.codec() {
            SensorCodec::Declared { format } => Some(Arc::clone(format)),
            SensorCodec::WeissDsa { .. } | SensorCodec::SingleTact { .. } | SensorCodec::AnySkin => None,
        };
        let vhci = Vhci::open()?;
        let (Started { sensor, stage, taps, control }, script) = source.start();
        let Taps { sensor: sensor_strikes, stage: stage_strikes } = taps;
        let mut units = Vec::new();
        if let Some(kind) = self.sensor {
            let shape = Shape::of_sensor(kind, format.as_deref())?;
            let behind = Behind::Sensor(Tapped::new(sensor, sensor_strikes));
            units.push(Unit { name: "sensor", shape, behind });
        }
        if let Some(kind) = self.stage {
            units.push(stage_unit(kind, stage, stage_strikes));
        }
        let devices_of_units =
            if self.composite { vec![units] } else { units.into_iter().map(|unit| vec![unit]).collect() };
        let mut running = JoinSet::new();
        let mut desks = Vec::new();
        let mut said = Vec::new();
        for units in devices_of_units {
            let identity = self.identity(&units)?;
            let names: Vec<_> = units.iter().map(|unit| unit.name).collect();
            let (orders, order_box) = mpsc::channel(ORDERS_WAITING);
            let plug = plug_in(&vhci, &identity, units, order_box).await?;
            for (function, name) in names.into_iter().enumerate() {
                said.push((name, identity.clone(), plug.port()));
                desks.push(Desk { name, function, orders: orders.clone() });
            }
            running.spawn(plug.run());
        }
        announce(&said, self.json)?;
        let sends_packets = self.sends_packets();
        let outcome = until_terminated(&mut running, &control, &script, async |line| {
            obey(line, &desks, &control, sends_packets).await
        });
        outcome.await?;
        running.shutdown().await;
        Ok(())
    }

    /// What the devices are made from; the sensor speaks as `--link` says, if it is given.
    fn source_speaking(&self) -> Result<Source> {
        let source = self.source.read()?;
        let Some(path) = &self.link else { return Ok(source) };
        let format = read_format(path).with_context(|| path.display().to_string())?;
        let (described, there) = (format.samples().elements(), source.array().elements());
        if described != there {
            bail!("{}: samples.elements is {described}, but the rig's array has {there}", path.display());
        }
        Ok(source.speaking(SensorCodec::Declared { format }))
    }

    /// A frame is a packet.
    fn sends_packets(&self) -> bool {
        matches!(self.sensor, Some(SensorKind::Hid | SensorKind::Bulk))
    }

    fn identity(&self, units: &[Unit]) -> Result<Identity> {
        let sensor_serial = self.serial.as_deref().unwrap_or("SIM-SENSOR");
        Ok(match units {
            [Unit { name: "stage", shape: Shape::Ftdi, .. }] => Identity::ftdi("virtual stage", "SIM-STAGE"),
            [Unit { name: "stage", .. }] => Identity::own(2, "virtual stage", "SIM-STAGE"),
            [Unit { shape: Shape::Ftdi, .. }] => Identity::ftdi("virtual sensor", sensor_serial),
            [Unit { shape: Shape::Acm, .. }] => Identity::own(1, "virtual sensor", sensor_serial),
            [Unit { shape: Shape::Hid { .. }, .. }] => Identity::own(3, "virtual sensor", sensor_serial),
            [Unit { shape: Shape::Bulk { .. }, .. }] => Identity::own(4, "virtual sensor", sensor_serial),
            several => {
                if several.iter().any(|unit| matches!(unit.shape, Shape::Ftdi)) {
                    bail!(
                        "FTDI's chip is a device of its own, which no composite holds: \
                         choose another kind, or leave --composite out"
                    );
                }
                Identity::own(5, "virtual rig", self.serial.as_deref().unwrap_or("SIM-RIG"))
            }
        })
    }
}

impl Shape {
    fn of_sensor(kind: SensorKind, format: Option<&Format>) -> Result<Self> {
        Ok(match (kind, format) {
            (SensorKind::CdcAcm, _) => Self::Acm,
            (SensorKind::Ftdi, _) => Self::Ftdi,
            (SensorKind::Bulk, Some(format)) => Self::Bulk { frame_bytes: format.frame_bytes() },
            (SensorKind::Hid, Some(format)) => {
                let Some(number) = format.hid_report_id() else {
                    bail!(
                        "the link file {:?} has no [hid] report_id (0 for reports without a number)",
                        format.name()
                    );
                };
                let report_bytes =
                    u16::try_from(format.frame_bytes()).ok().filter(|bytes| *bytes <= REPORT_BYTES_MAX);
                let Some(report_bytes) = report_bytes else {
                    bail!(
                        "a frame of {:?} has more than the {REPORT_BYTES_MAX} bytes of a report",
                        format.name()
                    );
                };
                Self::Hid { report_bytes, number: (number > 0).then_some(number) }
            }
            (SensorKind::Hid | SensorKind::Bulk, None) => bail!(
                "a sensor that is hid or bulk sends frames of a described format: give --link, or a rig file whose \
                 sensor.protocol is \"declared\""
            ),
        })
    }

    fn speed(&self) -> Speed {
        match self {
            Self::Ftdi => Ftdi::SPEED,
            Self::Acm | Self::Hid { .. } | Self::Bulk { .. } => Speed::High,
        }
    }

    fn function(&self) -> Box<dyn Function> {
        match *self {
            Self::Acm => Box::new(Acm::new(self.speed())),
            Self::Ftdi => Box::new(Ftdi::new()),
            Self::Hid { report_bytes, number } => Box::new(Hid::new(report_bytes, number)),
            Self::Bulk { frame_bytes } => Box::new(Bulk::new(self.speed(), frame_bytes)),
        }
    }
}

fn stage_unit(
    kind: StageKind,
    stage: VirtualStage,
    strikes: mpsc::Receiver<crate::cable::Strike<crate::faults::StageFault>>,
) -> Unit {
    let shape = match kind {
        StageKind::CdcAcm => Shape::Acm,
        StageKind::Ftdi => Shape::Ftdi,
    };
    Unit { name: "stage", shape, behind: Behind::Stage(Tapped::new(stage, strikes)) }
}

async fn plug_in(
    vhci: &Vhci,
    identity: &Identity,
    units: Vec<Unit>,
    orders: mpsc::Receiver<Order>,
) -> Result<Plug, VhciError> {
    let (shapes, behind): (Vec<_>, Vec<_>) = units.into_iter().map(|unit| (unit.shape, unit.behind)).unzip();
    let speed =
        if shapes.iter().any(|shape| shape.speed() == Speed::Full) { Speed::Full } else { Speed::High };
    let identity = identity.clone();
    let make = move || Gadget::new(identity.clone(), speed, shapes.iter().map(Shape::function).collect());
    Plug::new(vhci.clone(), Box::new(make), behind, orders).await
}

async fn obey(line: &str, desks: &[Desk], control: &RigControl, sends_packets: bool) -> Result<(), String> {
    if let Some((device, command)) = Command::parse(line) {
        let command = command.map_err(|error| error.to_string())?;
        let Some(desk) = desks.iter().find(|desk| desk.name == device) else {
            return Err(format!("{device:?} is not plugged in: there is {}", names(desks)));
        };
        let (done, outcome) = oneshot::channel();
        let order = Order { function: desk.function, command, done };
        // A plug takes orders until it ends, and then the program does.
        let ended = |_| "the device has ended".to_owned();
        desk.orders.send(order).await.map_err(|_| "the device has ended".to_owned())?;
        return outcome.await.map_err(ended)?.map_err(|error| format!("{device}: {error}"));
    }
    let fault: Fault = line.parse().map_err(|error: crate::faults::FaultError| error.to_string())?;
    if let Fault::Sensor(fault) = fault
        && sends_packets
        && !keeps_packets_whole(fault)
    {
        return Err("a sensor whose frames are packets has no such fault".to_owned());
    }
    control.inject(fault).map_err(|error| error.to_string())
}

/// True for faults that leave a frame as long as its packet.
fn keeps_packets_whole(fault: SensorFault) -> bool {
    match fault {
        SensorFault::Link(LinkFault::Stall(_) | LinkFault::DropFrames(_))
        | SensorFault::ClockJump { .. }
        | SensorFault::ClockWrap
        | SensorFault::Stuck(_)
        | SensorFault::Saturate(_)
        | SensorFault::Clear => true,
        SensorFault::Link(_) => false,
    }
}

fn names(desks: &[Desk]) -> String {
    desks.iter().map(|desk| desk.name).collect::<Vec<_>>().join(", ")
}

fn announce(said: &[(&str, Identity, u32)], as_json: bool) -> Result<()> {
    let mut out = io::stdout().lock();
    if as_json {
        let all: serde_json::Map<_, _> = said
            .iter()
            .map(|(name, identity, port)| {
                let [_, _, serial] = &identity.strings;
                let id = format!("{:04x}:{:04x}", identity.vendor, identity.product);
                ((*name).to_owned(), json!({ "id": id, "serial": serial, "port": port }))
            })
            .collect();
        writeln!(out, "{}", serde_json::Value::Object(all))?;
    } else {
        for (name, identity, port) in said {
            let [_, _, serial] = &identity.strings;
            writeln!(out, "{name} {:04x}:{:04x} {serial} port {port}", identity.vendor, identity.product)?;
        }
    }
    Ok(out.flush()?)
}

fn read_format(path: &Path) -> Result<Arc<Format>> {
    let raw: RawFormat = toml::from_str(&read(path)?)?;
    Ok(Arc::new(raw.check()?))
}

fn simulated_serial(text: &str) -> Result<String, String> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
    if text.starts_with("SIM") && is_plain {
        Ok(text.to_owned())
    } else {
        Err("a simulated device says so: SIM, then letters, digits and hyphens".to_owned())
    }
}
