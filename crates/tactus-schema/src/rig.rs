//! The rig file: one tactile array, one stage, one covering, one indenter; TOML or JSON, `tactus.rig/1`.
//!
//! [`Rig::from_toml`] and [`Rig::from_json`] check everything that can be checked without hardware;
//! unknown keys are refused. The TOML form holds the description that goes with data (the JSON form)
//! and, for the service, links, envelope, motion, policy and simulation.

mod file;
mod registration;
mod service;
mod simulation;
mod stage;
mod transport;

use std::collections::BTreeMap;

use tactus_model::{Array, ArrayError, Covering, Indenter, Psf, Registration};

use crate::description::WrongField;

pub use file::SCHEMA;
pub use stage::{AxisEnd, GrblAxes, GrblAxis, MachineAxis, StageLink, StageProtocol, ZaberAxes, ZaberAxis};
pub use transport::{HidLink, IdentityError, MAX_REPORT_BYTES, SerialPort, Transport, UsbIdentity, UsbLink};

/// A checked rig description.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// Name, one part of a bus key: letters, digits, `-`, `_`.
    pub name: String,
    /// True if it has no physical devices.
    pub simulated: bool,
    /// Geometry, rate and converter range of the array.
    pub array: Array,
    /// Where the sensor lies in the robot's frame.
    pub registration: Registration,
    /// Spread against covering thickness.
    pub psf: Psf,
    /// Counts per mm of indentation of the reference indenter at the element's own centre, one per element.
    pub sensitivity_counts_per_mm: Vec<f64>,
    /// The press that the sensitivities refer to.
    pub sensitivity_reference: SensitivityReference,
    /// Reading at rest, one per element.
    pub baseline_counts: Vec<f64>,
    /// The tools, by id.
    pub indenters: BTreeMap<String, Indenter>,
    /// Id of the tool on the stage.
    pub indenter: String,
    /// The covering in place.
    pub covering: Covering,
    /// Links, limits and motion; `None` in descriptions stored with data.
    pub service: Option<Service>,
    /// The hidden truth of the virtual devices; simulated rigs only.
    pub simulation: Option<Simulation>,
}

/// The press that sensitivities refer to.
#[derive(Debug, Clone, PartialEq)]
pub struct SensitivityReference {
    /// Id of an indenter of the rig.
    pub indenter: String,
    /// The covering in place during that press.
    pub covering: Covering,
}

/// The sections that only the lab service needs.
#[derive(Debug, Clone, PartialEq)]
pub struct Service {
    /// Bounds that no script, client or fault may cross.
    pub envelope: Envelope,
    /// How the stage moves within the bounds.
    pub motion: Motion,
    /// What to do when something is lost.
    pub policy: Policy,
    /// The sensor's protocol and transport.
    pub sensor: SensorLink,
    /// The stage's protocol and transport.
    pub stage: StageLink,
}

/// Bounds of motion and load; positions in the robot frame, z = 0 at the covering's nominal surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Least and greatest x.
    pub x_mm: [f64; 2],
    /// Least and greatest y.
    pub y_mm: [f64; 2],
    /// Greatest z; the depth limit gives the least.
    pub z_max_mm: f64,
    /// Greatest depth as a share of the covering's thickness, in (0, 1).
    pub depth_share_max: f64,
    /// Greatest speed anywhere.
    pub speed_max_mm_per_s: f64,
    /// Greatest speed downwards below the approach height.
    pub load_speed_max_mm_per_s: f64,
    /// Greatest rise of any element above its tare.
    pub element_max_counts: f64,
    /// Greatest sum of the rises of all elements above their tares; elements that fall count as 0.
    pub sum_max_counts: f64,
    /// Greatest depth under any covering: a hard cap. Without the key, the limit under the file's own covering.
    pub depth_max_mm: f64,
    /// Greatest distance of a zero from the element's `baseline_counts`. A quarter of `element_max_counts` without the key.
    pub baseline_band_counts: f64,
    /// Elements that are known to be faulty: they have no limits and no zero. The others must see the load.
    pub unwatched_elements: Vec<usize>,
    /// True if a deep tip over the array must be felt, and a moving one change the frames. Without the key it must.
    pub expects_response: bool,
}

impl Envelope {
    /// Greatest depth under a covering, in mm.
    pub fn depth_max_mm(&self, covering: Covering) -> f64 {
        (self.depth_share_max * covering.thickness_mm).min(self.depth_max_mm)
    }
}

/// How the stage moves; speeds within the envelope's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Height at which the tip travels and to which it retracts.
    pub safe_height_mm: f64,
    /// Height down to which the tip travels fast before a press.
    pub approach_height_mm: f64,
    /// Speed of travel and retraction.
    pub travel_speed_mm_per_s: f64,
    /// Speed of loading and unloading, unless the script says otherwise.
    pub load_speed_mm_per_s: f64,
    /// Rest between the end of a motion and the readings of a dwell.
    pub settle_s: f64,
    /// A move is done when the controller is idle and the position is within this distance of the target.
    pub tolerance_mm: f64,
}

/// What to do when something is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// When frames are lost during a run.
    pub on_gap: OnGap,
    /// How long the service waits for a lost device before the run fails, in milliseconds.
    pub reconnect_ms: u32,
}

/// What a run does when frames are lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnGap {
    /// Retract, wait for the sensor, repeat the press; the run ends as degraded.
    Repeat,
    /// Retract and fail.
    Fail,
}

/// The sensor's link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SensorLink {
    /// Which bytes the sensor sends and takes.
    pub protocol: SensorProtocol,
    /// How bytes get to the sensor.
    pub transport: Transport,
}

/// Protocols of sensors. The unit of a frame's counts depends on the protocol.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SensorProtocol {
    /// `weiss-dsa`: the `DSACON32m` and relatives, push mode; 12-bit counts.
    WeissDsa {
        /// `checksum`: how the controller's firmware closes its packets; `crc` unless the file says otherwise.
        checksum: WeissChecksum,
    },
    /// `singletact`: single elements behind one interface board, polled; the elements' counts, about 255 without load.
    SingleTact {
        /// `addresses`: of the elements on the board's I2C bus, in the order of the array's elements.
        addresses: Vec<u8>,
    },
    /// `anyskin`: the boards of `ReSkin` and `AnySkin`. The array has [`ANYSKIN_SHAPE`]: a row for each magnetometer in
    /// the order of the wire, a column for each of its axes x, y, z. "Counts" are then microteslas with a sign, as the
    /// firmware converts them, and no covering's depth follows from one of them by the forward model.
    AnySkin,
    /// `declared`: frames as another file (`tactus.link/1`) describes them.
    Declared {
        /// `format`: path of that file, relative to the rig file. Whoever reads the rig file reads it too.
        format: String,
    },
}

impl SensorProtocol {
    /// True for sensors whose readings are components of a field, not pressures of places: a press may take any of them
    /// either way.
    pub fn is_signed(&self) -> bool {
        match self {
            Self::AnySkin => true,
            Self::WeissDsa { .. } | Self::SingleTact { .. } | Self::Declared { .. } => false,
        }
    }
}

/// How older and newer firmware of `weiss-dsa` closes packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WeissChecksum {
    /// `crc`: two bytes.
    #[default]
    Crc,
    /// `sum8`: older firmware's sum of all bytes.
    Sum8,
}

/// Rows and columns of an array that speaks `anyskin`: magnetometers and axes.
pub const ANYSKIN_SHAPE: [usize; 2] = [5, 3];

/// The truth of a simulated rig, which the service does not see.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Standard deviation of an element's noise.
    pub noise_rms_counts: f64,
    /// Relative standard deviation of the gains.
    pub gain_spread: f64,
    /// `k` of the response `R(u) = u + k u^2`, in 1/mm; `u` is the equivalent indentation of the forward model.
    pub quadratic_per_mm: f64,
    /// True registration minus the declared one.
    pub registration_error: RegistrationError,
    /// True height of the covering's surface, which the service takes to be 0.
    pub surface_mm: f64,
    /// Faults of elements, by index: in the file, the lists `miswired`, `dead`, `stuck` and `noisy`.
    pub faults: BTreeMap<usize, ElementFault>,
    /// The stage's true kinematics.
    pub stage: SimulatedStage,
}

/// By how much the true registration differs from the declared one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RegistrationError {
    /// Of the origin, robot frame.
    pub origin_mm: [f64; 2],
    /// Of the rotation.
    pub rotation_deg: f64,
}

/// A fault of a simulated element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementFault {
    /// It gives another element's signal with its own gain, as the paper's two faulty elements do.
    Miswired {
        /// Index of the other element.
        answers_for: usize,
    },
    /// It responds to no press and reads baseline and noise.
    Dead,
    /// It always reads the same, without noise.
    Stuck {
        /// The constant reading; within full scale.
        counts: u16,
    },
    /// It has more noise than the others.
    Noisy {
        /// Standard deviation of its noise.
        noise_rms_counts: f64,
    },
}

/// The virtual platen-forcer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulatedStage {
    /// Step of x and y (paper: 3 um).
    pub lateral_step_mm: f64,
    /// Step of z (paper: 1 um).
    pub vertical_step_mm: f64,
    /// Acceleration along a move.
    pub acceleration_mm_per_s2: f64,
    /// Greatest speed along a move.
    pub speed_max_mm_per_s: f64,
    /// Travel of x, y and z: least and greatest, robot frame.
    pub travel_mm: [[f64; 2]; 3],
}

/// Why a file is not a rig.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// The TOML is malformed; the text names line and key.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// The JSON is malformed.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// The array's description is contradictory.
    #[error("array: {0}")]
    Array(#[from] ArrayError),
    /// One field is wrong.
    #[error("{field}: {problem}")]
    Field {
        /// Path of the field, such as `envelope.x_mm`.
        field: String,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
}

impl From<WrongField> for RigError {
    fn from(WrongField { field, problem }: WrongField) -> Self {
        Self::Field { field, problem }
    }
}

impl Rig {
    /// Greatest depth that the envelope allows under the covering in place, in mm; `None` without a service part.
    pub fn depth_max_mm(&self) -> Option<f64> {
        self.service.as_ref().map(|service| service.envelope.depth_max_mm(self.covering))
    }

    /// The tool on the stage.
    pub fn mounted(&self) -> Option<Indenter> {
        self.indenters.get(&self.indenter).cloned()
    }
}

#[cfg(test)]
#[path = "rig_tests.rs"]
mod tests;
