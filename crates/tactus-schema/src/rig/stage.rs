//! The stage's link: protocol, transport, and its axes in the robot's frame.

use serde::Deserialize;

use super::Transport;
use super::transport::RawTransport;
use crate::description::{WrongField, finite, positive, wrong};

/// The stage's link.
#[derive(Debug, Clone, PartialEq)]
pub struct StageLink {
    /// The protocol, with the axes.
    pub protocol: StageProtocol,
    /// How bytes get to the controller: serial, TCP or embedded. The driver's guard needs a second way to write the stop, which
    /// USB packets do not have.
    pub transport: Transport,
}

/// Protocols of stages, each with its description of the axes.
#[derive(Debug, Clone, PartialEq)]
pub enum StageProtocol {
    /// `grbl`: Grbl 1.1 and grblHAL.
    Grbl(GrblAxes),
    /// `zaber-ascii`: Zaber's ASCII protocol.
    Zaber(ZaberAxes),
}

impl StageProtocol {
    /// True if the controller moves this axis of the robot's frame: 0 is x, 1 is y, 2 is z.
    pub fn has_axis(&self, axis: usize) -> bool {
        match self {
            Self::Grbl(_) => axis < 3,
            Self::Zaber(zaber) => zaber.axes.get(axis).is_some_and(Option::is_some),
        }
    }
}

/// The axes of a Grbl controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrblAxes {
    /// x, y and z of the robot's frame, each on an axis of its own.
    pub axes: [GrblAxis; 3],
    /// True if the controller must have its soft limits on.
    pub soft_limits: bool,
}

/// An axis of the robot's frame on a Grbl controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrblAxis {
    /// The controller's axis that moves it.
    pub machine_axis: MachineAxis,
    /// False if the controller counts the other way.
    pub is_forward: bool,
    /// The controller's coordinate that is 0 in the robot's frame.
    pub origin_mm: f64,
    /// Steps per mm that the controller must be set to; `None` if the rig file does not say.
    pub steps_per_mm: Option<f64>,
    /// End of the axis where its home switch is; `None` if the rig file does not say. z's is always the high end.
    pub home: Option<AxisEnd>,
}

/// One of a controller's three axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MachineAxis {
    /// The controller's X.
    X,
    /// The controller's Y.
    Y,
    /// The controller's Z.
    Z,
}

/// An end of an axis, in the robot's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisEnd {
    /// Its smallest coordinate.
    Low,
    /// Its greatest coordinate.
    High,
}

/// The axes of Zaber devices on one port.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZaberAxes {
    /// x, y and z of the robot's frame, each on an axis of its own; x and y may be missing, and are then 0.
    pub axes: [Option<ZaberAxis>; 3],
    /// Acceleration along the path; `None` keeps the axes' settings.
    pub accel_mm_per_s2: Option<f64>,
    /// Speed of each axis during homing; `None` keeps that of the last move.
    pub homing_speed_mm_per_s: Option<f64>,
    /// True if both sides send checksums: the devices' setting `comm.checksum` is switched on. True unless the rig file says
    /// otherwise.
    pub checksums: bool,
    /// True if a stage that reports a valid reference counts as homed when it is connected.
    pub trusts_reference: bool,
}

/// An axis of the robot's frame on a Zaber device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZaberAxis {
    /// Address of the device, 1 to 99.
    pub device: u8,
    /// Number of the axis in the device, 1 to 9.
    pub axis: u8,
    /// Length of a microstep, in um.
    pub um_per_microstep: f64,
    /// False if the device counts the other way.
    pub is_forward: bool,
    /// The device's position that is 0 in the robot's frame.
    pub origin_microsteps: i32,
    /// `resolution` that the device must be set to, in microsteps per full step; `None` if the rig file does not say.
    pub resolution: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "protocol", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum RawStageLink {
    /// Grbl 1.1 and grblHAL.
    Grbl {
        /// How bytes get to the controller.
        transport: RawTransport,
        /// The axes of the robot's frame that differ from the controller's.
        #[serde(default)]
        axes: RawAxes<RawGrblAxis>,
        /// True if the controller must have its soft limits on, as without the key.
        soft_limits: Option<bool>,
    },
    /// Zaber devices with firmware 6 and 7.
    ZaberAscii {
        /// How bytes get to the controller.
        transport: RawTransport,
        /// The axes of the robot's frame: z, and x and y where the stage has them.
        axes: RawAxes<RawZaberAxis>,
        /// Acceleration along the path; without the key the axes keep their settings.
        accel_mm_per_s2: Option<f64>,
        /// Speed of each axis during homing; without the key that of the last move.
        homing_speed_mm_per_s: Option<f64>,
        /// True if both sides send checksums, as without the key.
        checksums: Option<bool>,
        /// True if a stage that reports a valid reference counts as homed when it is connected.
        #[serde(default)]
        trusts_reference: bool,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAxes<A> {
    x: Option<A>,
    y: Option<A>,
    z: Option<A>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawGrblAxis {
    /// The controller's axis that moves it; without the key the one of the same name.
    machine_axis: Option<MachineAxis>,
    /// -1 if the controller counts the other way, else 1.
    direction: Option<i64>,
    origin_mm: Option<f64>,
    /// Steps per mm that the controller must be set to; without the key they are not checked.
    steps_per_mm: Option<f64>,
    /// `"low"` or `"high"`: the end of the axis where its home switch must be. That of z is always the high
    /// end.
    home: Option<AxisEnd>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawZaberAxis {
    device: i64,
    axis: i64,
    um_per_microstep: f64,
    /// -1 if the device counts the other way, else 1.
    direction: Option<i64>,
    origin_microsteps: Option<i32>,
    /// `resolution` that the device must be set to, in microsteps per full step; without the key it is not
    /// checked.
    resolution: Option<i64>,
}

/// Names of the axes of the robot's frame.
const NAMES: [&str; 3] = ["x", "y", "z"];

impl StageProtocol {
    /// Its name in the rig file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Grbl(_) => "grbl",
            Self::Zaber(_) => "zaber-ascii",
        }
    }
}

impl Default for GrblAxes {
    /// A controller whose axes coincide with the robot's, with soft limits.
    fn default() -> Self {
        let axes = [MachineAxis::X, MachineAxis::Y, MachineAxis::Z].map(|machine_axis| GrblAxis {
            machine_axis,
            is_forward: true,
            origin_mm: 0.0,
            steps_per_mm: None,
            home: (machine_axis == MachineAxis::Z).then_some(AxisEnd::High),
        });
        Self { axes, soft_limits: true }
    }
}

impl RawStageLink {
    pub(super) fn check(self) -> Result<StageLink, WrongField> {
        let (protocol, transport) = match self {
            Self::Grbl { transport, axes, soft_limits } => {
                let soft_limits = soft_limits.unwrap_or(true);
                (StageProtocol::Grbl(GrblAxes { axes: axes.check()?, soft_limits }), transport)
            }
            Self::ZaberAscii {
                transport,
                axes,
                accel_mm_per_s2,
                homing_speed_mm_per_s,
                checksums,
                trusts_reference,
            } => {
                let more_than_0 = |name: &str, value: Option<f64>| {
                    value.map(|value| positive(format!("stage.{name}"), value)).transpose()
                };
                let zaber = ZaberAxes {
                    axes: axes.check()?,
                    accel_mm_per_s2: more_than_0("accel_mm_per_s2", accel_mm_per_s2)?,
                    homing_speed_mm_per_s: more_than_0("homing_speed_mm_per_s", homing_speed_mm_per_s)?,
                    checksums: checksums.unwrap_or(true),
                    trusts_reference,
                };
                (StageProtocol::Zaber(zaber), transport)
            }
        };
        let transport = transport.check("stage.transport")?;
        if let Transport::Usb(_) | Transport::Hid(_) = transport {
            return Err(wrong(
                "stage.transport.kind",
                "serial or tcp: over usb and hid nobody but the service could write the stop, if it hangs; a controller on \
                 a USB cable has a serial port, kind = \"serial\" with path or usb, which `tactus devices` shows",
            ));
        }
        Ok(StageLink { protocol, transport })
    }
}

impl<A> Default for RawAxes<A> {
    fn default() -> Self {
        Self { x: None, y: None, z: None }
    }
}

impl RawAxes<RawGrblAxis> {
    fn check(self) -> Result<[GrblAxis; 3], WrongField> {
        let plain = GrblAxes::default().axes;
        let mut axes = plain;
        for (at, raw) in [self.x, self.y, self.z].into_iter().enumerate() {
            let field = |name: &str| format!("stage.axes.{}.{name}", NAMES[at]);
            let raw = raw.unwrap_or_default();
            axes[at] = GrblAxis {
                machine_axis: raw.machine_axis.unwrap_or(plain[at].machine_axis),
                is_forward: is_forward(field("direction"), raw.direction)?,
                origin_mm: finite(field("origin_mm"), raw.origin_mm.unwrap_or(0.0))?,
                steps_per_mm: match raw.steps_per_mm {
                    Some(steps_per_mm) => Some(positive(field("steps_per_mm"), steps_per_mm)?),
                    None => None,
                },
                home: raw.home.or(plain[at].home),
            };
            if axes[at].home == Some(AxisEnd::Low) && NAMES[at] == "z" {
                let problem = "z must home upwards, to its high end: the other way is into the sensor";
                return Err(wrong(field("home"), problem));
            }
        }
        if let Some([first, second]) = twins(|at| Some(axes[at].machine_axis)) {
            let problem = format!(
                "serves {first} already; if axes are exchanged, say `machine_axis` of each that is concerned"
            );
            return Err(wrong(format!("stage.axes.{second}.machine_axis"), problem));
        }
        Ok(axes)
    }
}

impl RawAxes<RawZaberAxis> {
    fn check(self) -> Result<[Option<ZaberAxis>; 3], WrongField> {
        let mut axes = [None; 3];
        for (at, raw) in [self.x, self.y, self.z].into_iter().enumerate() {
            axes[at] = raw.map(|raw| raw.check(NAMES[at])).transpose()?;
        }
        if axes[2].is_none() {
            return Err(wrong("stage.axes.z", "missing; it is the axis that presses"));
        }
        if let Some([first, second]) = twins(|at| axes[at].map(|axis| (axis.device, axis.axis))) {
            let problem = format!("the same axis of the same device as {first}");
            return Err(wrong(format!("stage.axes.{second}.axis"), problem));
        }
        Ok(axes)
    }
}

impl RawZaberAxis {
    fn check(self, axis: &str) -> Result<ZaberAxis, WrongField> {
        let field = |name: &str| format!("stage.axes.{axis}.{name}");
        Ok(ZaberAxis {
            device: number(field("device"), self.device, 99)?,
            axis: number(field("axis"), self.axis, 9)?,
            um_per_microstep: positive(field("um_per_microstep"), self.um_per_microstep)?,
            is_forward: is_forward(field("direction"), self.direction)?,
            origin_microsteps: self.origin_microsteps.unwrap_or(0),
            resolution: match self.resolution.map(u32::try_from) {
                None => None,
                Some(Ok(resolution)) if resolution > 0 => Some(resolution),
                Some(_) => return Err(wrong(field("resolution"), "microsteps a full step, more than 0")),
            },
        })
    }
}

/// The first pair of equal axes.
fn twins<T: PartialEq>(axis: impl Fn(usize) -> Option<T>) -> Option<[&'static str; 2]> {
    let pairs = [[0, 1], [0, 2], [1, 2]];
    let same = pairs.into_iter().find(|[a, b]| axis(*a).is_some() && axis(*a) == axis(*b));
    same.map(|pair| pair.map(|at| NAMES[at]))
}

fn is_forward(field: String, direction: Option<i64>) -> Result<bool, WrongField> {
    match direction {
        None | Some(1) => Ok(true),
        Some(-1) => Ok(false),
        Some(other) => {
            Err(wrong(field, format!("1, or -1 if the controller counts the other way; not {other}")))
        }
    }
}

fn number(field: String, value: i64, max: u8) -> Result<u8, WrongField> {
    match u8::try_from(value) {
        Ok(number) if (1..=max).contains(&number) => Ok(number),
        _ => Err(wrong(field, format!("1 to {max}, not {value}"))),
    }
}

#[cfg(test)]
#[path = "stage_tests.rs"]
mod tests;
