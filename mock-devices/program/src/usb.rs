//! `tactus-mock usb`: the rig's devices as USB devices of this machine.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde_json::json;
use tactus_device::SensorCodec;
use tactus_usbip::{BackingDevice, FunctionKind, Identity, Order, Plug, PlugCommand, REPORT_BYTES_MAX, Vhci};
use tactus_virtual::faults::{FaultError, InjectedFault, LinkFault, SensorFault};
use tactus_virtual::{RigControl, Started};
use tactus_wire::declared::{Format, RawFormat};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinSet;

use crate::cli::{Source, SourceArgs, Termination, read, until_terminated};

/// Capacity of a plug's queue of orders. One is enough: each line is answered before the next is read.
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
    /// Plug in both as one composite device, on one cable.
    #[arg(long, requires = "sensor", requires = "stage")]
    composite: bool,
    /// The format of the sensor's frames (`config/links`), instead of the rig file's. `hid` and `bulk` need one; for
    /// `hid` it needs `[hid]`.
    #[arg(long, value_name = "FILE")]
    link: Option<PathBuf>,
    /// The sensor's serial number. Default: SIM-SENSOR. It must begin with SIM.
    #[arg(long, value_name = "TEXT", value_parser = simulated_serial)]
    serial: Option<String>,
    /// Print the plugged-in devices as one JSON object.
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

/// A device of the rig that is to be plugged in.
struct RigDevice {
    /// As in commands: `sensor` or `stage`.
    name: &'static str,
    kind: FunctionKind,
    backing: BackingDevice,
}

/// A device of the rig that is plugged in, and where its orders go.
struct PluggedDevice {
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
        let format = if let SensorCodec::Declared { format } = source.codec() {
            Some(Arc::clone(format))
        } else {
            None
        };
        let vhci = Vhci::open()?;
        let termination = Termination::listen()?;
        let (Started { sensor, stage, faults, control }, script) = source.start();
        let mut devices = Vec::new();
        if let Some(kind) = self.sensor {
            let kind = sensor_function(kind, format.as_deref())?;
            let backing = BackingDevice::sensor(sensor, faults.sensor);
            devices.push(RigDevice { name: "sensor", kind, backing });
        }
        if let Some(kind) = self.stage {
            let kind = match kind {
                StageKind::CdcAcm => FunctionKind::Acm,
                StageKind::Ftdi => FunctionKind::Ftdi,
            };
            let backing = BackingDevice::stage(stage, faults.stage);
            devices.push(RigDevice { name: "stage", kind, backing });
        }
        let usb_devices =
            if self.composite { vec![devices] } else { devices.into_iter().map(|one| vec![one]).collect() };
        let mut running = JoinSet::new();
        let mut plugged = Vec::new();
        let mut said = Vec::new();
        for devices in usb_devices {
            let identity = self.identity(&devices)?;
            let names: Vec<_> = devices.iter().map(|device| device.name).collect();
            let (orders, order_box) = mpsc::channel(ORDERS_WAITING);
            let functions = devices.into_iter().map(|device| (device.kind, device.backing)).collect();
            let plug = Plug::new(vhci.clone(), identity.clone(), functions, order_box).await?;
            for (function, name) in names.into_iter().enumerate() {
                said.push((name, identity.clone(), plug.port()));
                plugged.push(PluggedDevice { name, function, orders: orders.clone() });
            }
            running.spawn(plug.run());
        }
        announce(&said, self.json)?;
        let sends_packets = self.sends_packets();
        let outcome = until_terminated(termination, &mut running, &control, &script, async |line| {
            execute(line, &plugged, &control, sends_packets).await
        });
        outcome.await?;
        running.shutdown().await;
        Ok(())
    }

    /// The files of the arguments. `--link` replaces the sensor's format.
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

    /// True if each frame of the sensor is one USB packet.
    fn sends_packets(&self) -> bool {
        matches!(self.sensor, Some(SensorKind::Hid | SensorKind::Bulk))
    }

    fn identity(&self, devices: &[RigDevice]) -> Result<Identity> {
        let sensor_serial = self.serial.as_deref().unwrap_or("SIM-SENSOR");
        Ok(match devices {
            [RigDevice { name: "stage", kind: FunctionKind::Ftdi, .. }] => {
                Identity::ftdi("virtual stage", "SIM-STAGE")
            }
            [RigDevice { name: "stage", .. }] => Identity::own(2, "virtual stage", "SIM-STAGE"),
            [RigDevice { kind: FunctionKind::Ftdi, .. }] => Identity::ftdi("virtual sensor", sensor_serial),
            [RigDevice { kind: FunctionKind::Acm, .. }] => Identity::own(1, "virtual sensor", sensor_serial),
            [RigDevice { kind: FunctionKind::Hid { .. }, .. }] => {
                Identity::own(3, "virtual sensor", sensor_serial)
            }
            [RigDevice { kind: FunctionKind::Bulk { .. }, .. }] => {
                Identity::own(4, "virtual sensor", sensor_serial)
            }
            several => {
                if several.iter().any(|device| matches!(device.kind, FunctionKind::Ftdi)) {
                    bail!(
                        "an FTDI chip cannot be part of a composite device: \
                         choose another kind, or leave out --composite"
                    );
                }
                Identity::own(5, "virtual rig", self.serial.as_deref().unwrap_or("SIM-RIG"))
            }
        })
    }
}

/// The USB function of a sensor. `format` is the declared format of its frames, if it has one.
fn sensor_function(kind: SensorKind, format: Option<&Format>) -> Result<FunctionKind> {
    Ok(match (kind, format) {
        (SensorKind::CdcAcm, _) => FunctionKind::Acm,
        (SensorKind::Ftdi, _) => FunctionKind::Ftdi,
        (SensorKind::Bulk, Some(format)) => FunctionKind::Bulk { frame_bytes: format.frame_bytes() },
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
            FunctionKind::Hid { report_bytes, number: (number > 0).then_some(number) }
        }
        (SensorKind::Hid | SensorKind::Bulk, None) => bail!(
            "a sensor that is hid or bulk sends frames of a described format: give --link, or a rig file whose \
                 sensor.protocol is \"declared\""
        ),
    })
}

async fn execute(
    line: &str,
    plugged: &[PluggedDevice],
    control: &RigControl,
    sends_packets: bool,
) -> Result<(), String> {
    if let Some((device, command)) = PlugCommand::parse(line) {
        let command = command.map_err(|error| error.to_string())?;
        let Some(target) = plugged.iter().find(|target| target.name == device) else {
            return Err(format!("{device:?} is not plugged in: there is {}", names(plugged)));
        };
        let (done, outcome) = oneshot::channel();
        let order = Order { function: target.function, command, done };
        // A plug takes orders until it ends; the program ends with it.
        let ended = |_| "the device has ended".to_owned();
        target.orders.send(order).await.map_err(|_| "the device has ended".to_owned())?;
        return outcome.await.map_err(ended)?.map_err(|error| format!("{device}: {error}"));
    }
    let fault: InjectedFault = line.parse().map_err(|error: FaultError| error.to_string())?;
    if let InjectedFault::Sensor(fault) = fault
        && sends_packets
        && !keeps_packets_whole(fault)
    {
        return Err("a sensor whose frames are packets has no such fault".to_owned());
    }
    control.inject(fault).map_err(|error| error.to_string())
}

/// True for faults that keep a frame as long as its packet.
fn keeps_packets_whole(fault: SensorFault) -> bool {
    match fault {
        SensorFault::Link(LinkFault::Stall(_) | LinkFault::DropFrames(_))
        | SensorFault::ClockJump { .. }
        | SensorFault::ClockWrap
        | SensorFault::ClockDrift { .. }
        | SensorFault::Stuck(_)
        | SensorFault::Saturate(_)
        | SensorFault::Freeze(_)
        | SensorFault::Zeros(_)
        | SensorFault::Clear => true,
        SensorFault::Link(_) | SensorFault::Wire(..) => false,
    }
}

fn names(plugged: &[PluggedDevice]) -> String {
    plugged.iter().map(|target| target.name).collect::<Vec<_>>().join(", ")
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
        Err("the serial number of a simulated device is SIM, then letters, digits and hyphens".to_owned())
    }
}
