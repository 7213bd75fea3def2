//! The rig file as it is written: raw serde types, checked into [`Rig`].

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tactus_model::{Array, Covering, ForwardModel, Indenter, Mesh, Psf, Registration, Response};

use super::one_or_each::OneOrEach;
use super::{
    Envelope, Miswired, Motion, OnGap, Policy, RegistrationError, Rig, RigError, SensitivityReference,
    SensorLink, SensorProtocol, Service, SimulatedStage, Simulation, StageLink, StageProtocol, Transport,
};

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.rig/1";

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRig {
    schema: String,
    name: String,
    simulated: bool,
    array: RawArray,
    registration: RawRegistration,
    psf: RawPsf,
    sensitivity_counts_per_mm: OneOrEach,
    sensitivity_reference: RawReference,
    baseline_counts: OneOrEach,
    indenters: BTreeMap<String, RawIndenter>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    indenter: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    covering: Option<RawCovering>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    envelope: Option<RawEnvelope>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    motion: Option<RawMotion>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    policy: Option<RawPolicy>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sensor: Option<RawSensorLink>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stage: Option<RawStageLink>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    simulation: Option<RawSimulation>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawArray {
    name: String,
    rows: usize,
    cols: usize,
    element_mm: [f64; 2],
    col_centres_mm: Vec<f64>,
    row_centres_mm: Vec<f64>,
    rate_hz: f64,
    full_scale_counts: f64,
    step_counts: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRegistration {
    origin_mm: [f64; 2],
    rotation_deg: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPsf {
    sigma_intercept_mm: f64,
    sigma_per_mm: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawReference {
    indenter: String,
    covering_mm: f64,
}

/// A tool: its shape, and the size that goes with it. Not a tagged enum, for the reason told at [`OneOrEach`].
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawIndenter {
    shape: Shape,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    diameter_mm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    apex_deg: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size_mm: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    vertices_mm: Option<Vec<[f64; 3]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    triangles: Option<Vec<[u32; 3]>>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Shape {
    Cylinder,
    Sphere,
    Cone,
    Box,
    Mesh,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCovering {
    thickness_mm: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEnvelope {
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_max_mm: f64,
    depth_share_max: f64,
    speed_max_mm_per_s: f64,
    load_speed_max_mm_per_s: f64,
    element_max_counts: f64,
    sum_max_counts: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMotion {
    safe_height_mm: f64,
    approach_height_mm: f64,
    travel_speed_mm_per_s: f64,
    load_speed_mm_per_s: f64,
    settle_s: f64,
    tolerance_mm: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPolicy {
    on_gap: RawOnGap,
    reconnect_s: f64,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawOnGap {
    Repeat,
    Fail,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSensorLink {
    protocol: RawSensorProtocol,
    transport: RawTransport,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawSensorProtocol {
    WeissDsa,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawStageLink {
    protocol: RawStageProtocol,
    transport: RawTransport,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawStageProtocol {
    Grbl,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum RawTransport {
    Embedded,
    Serial { path: String, baud: u32 },
    Tcp { address: String },
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSimulation {
    seed: u64,
    noise_rms_counts: f64,
    gain_spread: f64,
    quadratic_per_mm: f64,
    surface_mm: f64,
    registration_error: RawRegistration,
    #[serde(default)]
    miswired: Vec<RawMiswired>,
    stage: RawSimulatedStage,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMiswired {
    element: usize,
    answers_for: usize,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSimulatedStage {
    lateral_step_mm: f64,
    vertical_step_mm: f64,
    acceleration_mm_per_s2: f64,
    speed_max_mm_per_s: f64,
    travel_mm: [[f64; 2]; 3],
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`] names the line and key, or the field, that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        check(toml::from_str(text)?)
    }

    /// Reads the JSON that goes with data; the parts a service needs may be absent.
    ///
    /// # Errors
    /// As [`Rig::from_toml`].
    pub fn from_json(text: &str) -> Result<Self, RigError> {
        check(serde_json::from_str(text)?)
    }

    /// The description that goes with data: everything but links, limits and what a simulation hides.
    pub fn to_json(&self) -> String {
        serde_json::json!({
            "schema": SCHEMA,
            "name": self.name,
            "simulated": self.simulated,
            "array": {
                "name": self.array.name(),
                "rows": self.array.rows(),
                "cols": self.array.cols(),
                "element_mm": self.array.element_mm(),
                "col_centres_mm": self.array.col_centres_mm(),
                "row_centres_mm": self.array.row_centres_mm(),
                "rate_hz": self.array.rate_hz(),
                "full_scale_counts": self.array.full_scale_counts(),
                "step_counts": self.array.step_counts(),
            },
            "registration": {
                "origin_mm": self.registration.origin_mm,
                "rotation_deg": self.registration.rotation_deg,
            },
            "psf": {
                "sigma_intercept_mm": self.psf.sigma_intercept_mm,
                "sigma_per_mm": self.psf.sigma_per_mm,
            },
            "sensitivity_counts_per_mm": one_or_each(&self.sensitivity_counts_per_mm),
            "sensitivity_reference": {
                "indenter": self.sensitivity_reference.indenter,
                "covering_mm": self.sensitivity_reference.covering.thickness_mm,
            },
            "baseline_counts": one_or_each(&self.baseline_counts),
            "indenters": self.indenters.iter().map(|(id, tool)| (id.clone(), raw_indenter(tool))).collect::<BTreeMap<_, _>>(),
            "indenter": self.indenter,
            "covering": { "thickness_mm": self.covering.thickness_mm },
        })
        .to_string()
    }
}

fn one_or_each(values: &[f64]) -> OneOrEach {
    match values {
        [first, rest @ ..] if rest.iter().all(|value| value.to_bits() == first.to_bits()) => {
            OneOrEach::One(*first)
        }
        _ => OneOrEach::Each(values.to_vec()),
    }
}

fn raw_indenter(tool: &Indenter) -> RawIndenter {
    let raw = |shape| RawIndenter {
        shape,
        diameter_mm: None,
        apex_deg: None,
        size_mm: None,
        vertices_mm: None,
        triangles: None,
    };
    match tool {
        Indenter::Cylinder { diameter_mm } => {
            RawIndenter { diameter_mm: Some(*diameter_mm), ..raw(Shape::Cylinder) }
        }
        Indenter::Sphere { diameter_mm } => {
            RawIndenter { diameter_mm: Some(*diameter_mm), ..raw(Shape::Sphere) }
        }
        Indenter::Cone { diameter_mm, apex_deg } => {
            RawIndenter { diameter_mm: Some(*diameter_mm), apex_deg: Some(*apex_deg), ..raw(Shape::Cone) }
        }
        Indenter::Box { size_mm } => RawIndenter { size_mm: Some(*size_mm), ..raw(Shape::Box) },
        Indenter::Mesh(mesh) => RawIndenter {
            vertices_mm: Some(mesh.vertices_mm().to_vec()),
            triangles: Some(mesh.triangles().to_vec()),
            ..raw(Shape::Mesh)
        },
    }
}

fn check(raw: RawRig) -> Result<Rig, RigError> {
    if raw.schema != SCHEMA {
        return Err(wrong("schema", format!("this program reads {SCHEMA:?}, not {:?}", raw.schema)));
    }
    // A rig that is served has its name in the bus keys; a description that came with data may be named freely.
    let name_fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if raw.name.is_empty() || (raw.sensor.is_some() && !raw.name.chars().all(name_fits)) {
        return Err(wrong("name", "letters, digits, '-' and '_' only: it becomes part of the bus keys"));
    }
    let array = check_array(raw.array)?;
    let elements = array.elements();
    positive("psf.sigma_intercept_mm", raw.psf.sigma_intercept_mm)?;
    not_negative("psf.sigma_per_mm", raw.psf.sigma_per_mm)?;
    let indenters = raw
        .indenters
        .into_iter()
        .map(|(id, tool)| Ok((id.clone(), check_indenter(&id, &tool)?)))
        .collect::<Result<BTreeMap<_, _>, RigError>>()?;
    let known = |field: &str, id: String| {
        if indenters.contains_key(&id) {
            Ok(id)
        } else {
            let ids: Vec<_> = indenters.keys().map(String::as_str).collect();
            Err(wrong(field, format!("no indenter {id:?}; there is: {}", ids.join(", "))))
        }
    };
    let reference = SensitivityReference {
        covering: Covering {
            thickness_mm: positive(
                "sensitivity_reference.covering_mm",
                raw.sensitivity_reference.covering_mm,
            )?,
        },
        indenter: known("sensitivity_reference.indenter", raw.sensitivity_reference.indenter)?,
    };
    let indenter = known("indenter", raw.indenter.unwrap_or_else(|| reference.indenter.clone()))?;
    let covering = match raw.covering {
        Some(covering) => {
            Covering { thickness_mm: positive("covering.thickness_mm", covering.thickness_mm)? }
        }
        None => reference.covering,
    };
    let service = match (raw.envelope, raw.motion, raw.policy, raw.sensor, raw.stage) {
        (None, None, None, None, None) => None,
        (Some(envelope), Some(motion), Some(policy), Some(sensor), Some(stage)) => {
            Some(check_service(&envelope, &motion, &policy, sensor, stage)?)
        }
        (envelope, motion, policy, sensor, stage) => {
            let parts = [
                ("envelope", envelope.is_none()),
                ("motion", motion.is_none()),
                ("policy", policy.is_none()),
                ("sensor", sensor.is_none()),
                ("stage", stage.is_none()),
            ];
            let missing: Vec<_> = parts.iter().filter(|(_, absent)| *absent).map(|(name, _)| *name).collect();
            return Err(wrong(
                missing.join(", "),
                "missing; a service needs all of envelope, motion, policy, sensor, stage",
            ));
        }
    };
    let simulation = raw.simulation.map(|simulation| check_simulation(simulation, elements)).transpose()?;
    if raw.simulated && service.is_some() && simulation.is_none() {
        return Err(wrong("simulation", "missing; a simulated rig needs it"));
    }
    let rig = Rig {
        name: raw.name,
        simulated: raw.simulated,
        registration: check_registration("registration", &raw.registration)?,
        psf: Psf { sigma_intercept_mm: raw.psf.sigma_intercept_mm, sigma_per_mm: raw.psf.sigma_per_mm },
        sensitivity_counts_per_mm: each(
            "sensitivity_counts_per_mm",
            raw.sensitivity_counts_per_mm,
            elements,
        )?,
        sensitivity_reference: reference,
        baseline_counts: each("baseline_counts", raw.baseline_counts, elements)?,
        array,
        indenters,
        indenter,
        covering,
        service,
        simulation,
    };
    check_model(&rig)?;
    Ok(rig)
}

/// A description that makes no forward model is none of a sensor.
fn check_model(rig: &Rig) -> Result<(), RigError> {
    let reference = &rig.sensitivity_reference;
    let Some(reference_indenter) = rig.indenters.get(&reference.indenter).cloned() else { return Ok(()) };
    let response = Response {
        sensitivity_counts_per_mm: rig.sensitivity_counts_per_mm.clone(),
        baseline_counts: rig.baseline_counts.clone(),
        quadratic_per_mm: vec![0.0; rig.array.elements()],
        reference_indenter,
        reference_covering: reference.covering,
    };
    match ForwardModel::new(rig.array.clone(), rig.psf, response) {
        Ok(_) => Ok(()),
        Err(error) => Err(wrong("sensitivity_reference", error.to_string())),
    }
}

fn check_array(raw: RawArray) -> Result<Array, RigError> {
    for (field, stated, listed) in [
        ("array.rows", raw.rows, raw.row_centres_mm.len()),
        ("array.cols", raw.cols, raw.col_centres_mm.len()),
    ] {
        if stated != listed {
            return Err(wrong(field, format!("says {stated}, but {listed} centres are listed")));
        }
    }
    Ok(Array::new(
        raw.name,
        raw.element_mm,
        raw.col_centres_mm,
        raw.row_centres_mm,
        raw.rate_hz,
        raw.full_scale_counts,
        raw.step_counts,
    )?)
}

fn check_registration(field: &str, raw: &RawRegistration) -> Result<Registration, RigError> {
    for (part, value) in [
        ("origin_mm[0]", raw.origin_mm[0]),
        ("origin_mm[1]", raw.origin_mm[1]),
        ("rotation_deg", raw.rotation_deg),
    ] {
        finite(format!("{field}.{part}"), value)?;
    }
    Ok(Registration { origin_mm: raw.origin_mm, rotation_deg: raw.rotation_deg })
}

fn check_indenter(id: &str, raw: &RawIndenter) -> Result<Indenter, RigError> {
    let field = |name: &str| format!("indenters.{id}.{name}");
    let RawIndenter { shape, diameter_mm, apex_deg, size_mm, vertices_mm, triangles } = raw;
    match (shape, *diameter_mm, *apex_deg, *size_mm, vertices_mm, triangles) {
        (Shape::Cylinder, Some(diameter_mm), None, None, None, None) => {
            Ok(Indenter::Cylinder { diameter_mm: positive(field("diameter_mm"), diameter_mm)? })
        }
        (Shape::Sphere, Some(diameter_mm), None, None, None, None) => {
            Ok(Indenter::Sphere { diameter_mm: positive(field("diameter_mm"), diameter_mm)? })
        }
        (Shape::Cone, Some(diameter_mm), Some(apex_deg), None, None, None) => {
            if !(apex_deg > 0.0 && apex_deg < 180.0) {
                return Err(wrong(field("apex_deg"), "the full angle at the tip lies between 0 and 180"));
            }
            Ok(Indenter::Cone { diameter_mm: positive(field("diameter_mm"), diameter_mm)?, apex_deg })
        }
        (Shape::Box, None, None, Some([x, y]), None, None) => Ok(Indenter::Box {
            size_mm: [positive(field("size_mm[0]"), x)?, positive(field("size_mm[1]"), y)?],
        }),
        (Shape::Mesh, None, None, None, Some(vertices_mm), Some(triangles)) => {
            let mesh = Mesh::new(vertices_mm, triangles);
            Ok(Indenter::Mesh(Arc::new(mesh.map_err(|error| wrong(field("triangles"), error.to_string()))?)))
        }
        (shape, ..) => Err(wrong(
            field("shape"),
            match shape {
                Shape::Cylinder | Shape::Sphere => "this shape has a diameter_mm and nothing else",
                Shape::Cone => "this shape has a diameter_mm and an apex_deg and nothing else",
                Shape::Box => "this shape has a size_mm = [x, y] and nothing else",
                Shape::Mesh => "this shape has vertices_mm and triangles and nothing else",
            },
        )),
    }
}

/// A move that ends further away than this has not arrived.
const TOLERANCE_MAX_MM: f64 = 0.05;

fn check_service(
    envelope: &RawEnvelope,
    motion: &RawMotion,
    policy: &RawPolicy,
    sensor: RawSensorLink,
    stage: RawStageLink,
) -> Result<Service, RigError> {
    range("envelope.x_mm", envelope.x_mm)?;
    range("envelope.y_mm", envelope.y_mm)?;
    if !(envelope.depth_share_max > 0.0 && envelope.depth_share_max < 1.0) {
        return Err(wrong("envelope.depth_share_max", "a share of the covering's thickness between 0 and 1"));
    }
    let envelope = Envelope {
        x_mm: envelope.x_mm,
        y_mm: envelope.y_mm,
        z_max_mm: positive("envelope.z_max_mm", envelope.z_max_mm)?,
        depth_share_max: envelope.depth_share_max,
        speed_max_mm_per_s: positive("envelope.speed_max_mm_per_s", envelope.speed_max_mm_per_s)?,
        load_speed_max_mm_per_s: positive(
            "envelope.load_speed_max_mm_per_s",
            envelope.load_speed_max_mm_per_s,
        )?,
        element_max_counts: positive("envelope.element_max_counts", envelope.element_max_counts)?,
        sum_max_counts: positive("envelope.sum_max_counts", envelope.sum_max_counts)?,
    };
    let motion = Motion {
        safe_height_mm: positive("motion.safe_height_mm", motion.safe_height_mm)?,
        approach_height_mm: positive("motion.approach_height_mm", motion.approach_height_mm)?,
        travel_speed_mm_per_s: positive("motion.travel_speed_mm_per_s", motion.travel_speed_mm_per_s)?,
        load_speed_mm_per_s: positive("motion.load_speed_mm_per_s", motion.load_speed_mm_per_s)?,
        settle_s: not_negative("motion.settle_s", motion.settle_s)?,
        tolerance_mm: positive("motion.tolerance_mm", motion.tolerance_mm)?,
    };
    // It is also the supervisor's slack at the depth limit.
    if motion.tolerance_mm > TOLERANCE_MAX_MM {
        return Err(wrong("motion.tolerance_mm", format!("at most {TOLERANCE_MAX_MM}")));
    }
    for (field, value, bound_field, bound) in [
        ("motion.safe_height_mm", motion.safe_height_mm, "envelope.z_max_mm", envelope.z_max_mm),
        (
            "motion.approach_height_mm",
            motion.approach_height_mm,
            "motion.safe_height_mm",
            motion.safe_height_mm,
        ),
        (
            "motion.travel_speed_mm_per_s",
            motion.travel_speed_mm_per_s,
            "envelope.speed_max_mm_per_s",
            envelope.speed_max_mm_per_s,
        ),
        (
            "motion.load_speed_mm_per_s",
            motion.load_speed_mm_per_s,
            "envelope.load_speed_max_mm_per_s",
            envelope.load_speed_max_mm_per_s,
        ),
    ] {
        if value > bound {
            return Err(wrong(field, format!("{value} exceeds {bound_field} = {bound}")));
        }
    }
    let reconnect_s = not_negative("policy.reconnect_s", policy.reconnect_s)?;
    if reconnect_s > 3600.0 {
        return Err(wrong("policy.reconnect_s", "at most 3600"));
    }
    Ok(Service {
        envelope,
        motion,
        policy: Policy {
            on_gap: match policy.on_gap {
                RawOnGap::Repeat => OnGap::Repeat,
                RawOnGap::Fail => OnGap::Fail,
            },
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to 3600 s, checked above"
            )]
            reconnect_ms: (reconnect_s * 1000.0) as u32,
        },
        sensor: SensorLink {
            protocol: match sensor.protocol {
                RawSensorProtocol::WeissDsa => SensorProtocol::WeissDsa,
            },
            transport: check_transport("sensor.transport", sensor.transport)?,
        },
        stage: StageLink {
            protocol: match stage.protocol {
                RawStageProtocol::Grbl => StageProtocol::Grbl,
            },
            transport: check_transport("stage.transport", stage.transport)?,
        },
    })
}

fn check_transport(field: &str, raw: RawTransport) -> Result<Transport, RigError> {
    match raw {
        RawTransport::Embedded => Ok(Transport::Embedded),
        RawTransport::Serial { path, baud } if !path.is_empty() && baud > 0 => {
            Ok(Transport::Serial { path, baud })
        }
        RawTransport::Serial { .. } => {
            Err(wrong(field, "a serial transport needs a path and a baud rate above 0"))
        }
        RawTransport::Tcp { address }
            if address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok()) =>
        {
            Ok(Transport::Tcp { address })
        }
        RawTransport::Tcp { address } => Err(wrong(field, format!("address {address:?} is not host:port"))),
    }
}

fn check_simulation(raw: RawSimulation, elements: usize) -> Result<Simulation, RigError> {
    let error = check_registration("simulation.registration_error", &raw.registration_error)?;
    let miswired = raw
        .miswired
        .into_iter()
        .map(|RawMiswired { element, answers_for }| {
            if element < elements && answers_for < elements {
                Ok(Miswired { element, answers_for })
            } else {
                Err(wrong("simulation.miswired", format!("elements are 0 to {}", elements - 1)))
            }
        })
        .collect::<Result<_, _>>()?;
    let stage = &raw.stage;
    for (axis, travel) in
        ["simulation.stage.travel_mm[0]", "simulation.stage.travel_mm[1]", "simulation.stage.travel_mm[2]"]
            .into_iter()
            .zip(stage.travel_mm)
    {
        range(axis, travel)?;
    }
    Ok(Simulation {
        seed: raw.seed,
        noise_rms_counts: not_negative("simulation.noise_rms_counts", raw.noise_rms_counts)?,
        gain_spread: not_negative("simulation.gain_spread", raw.gain_spread)?,
        quadratic_per_mm: finite("simulation.quadratic_per_mm", raw.quadratic_per_mm)?,
        surface_mm: finite("simulation.surface_mm", raw.surface_mm)?,
        registration_error: RegistrationError {
            origin_mm: error.origin_mm,
            rotation_deg: error.rotation_deg,
        },
        miswired,
        stage: SimulatedStage {
            lateral_step_mm: positive("simulation.stage.lateral_step_mm", stage.lateral_step_mm)?,
            vertical_step_mm: positive("simulation.stage.vertical_step_mm", stage.vertical_step_mm)?,
            acceleration_mm_per_s2: positive(
                "simulation.stage.acceleration_mm_per_s2",
                stage.acceleration_mm_per_s2,
            )?,
            speed_max_mm_per_s: positive("simulation.stage.speed_max_mm_per_s", stage.speed_max_mm_per_s)?,
            travel_mm: stage.travel_mm,
        },
    })
}

fn each(field: &str, raw: OneOrEach, elements: usize) -> Result<Vec<f64>, RigError> {
    let values = match raw {
        OneOrEach::One(value) => vec![value; elements],
        OneOrEach::Each(values) => values,
    };
    if values.len() != elements {
        return Err(wrong(field, format!("{} values for {elements} elements", values.len())));
    }
    for (index, value) in values.iter().enumerate() {
        finite(format!("{field}[{index}]"), *value)?;
    }
    Ok(values)
}

/// Nothing in a lab is larger, in any unit used here; sums and products of a few such numbers stay finite.
const LARGEST: f64 = 1e12;

fn range(field: &str, [low, high]: [f64; 2]) -> Result<(), RigError> {
    if low < high && low >= -LARGEST && high <= LARGEST {
        Ok(())
    } else {
        Err(wrong(field, format!("[least, greatest] with least < greatest, not [{low}, {high}]")))
    }
}

fn positive(field: impl Into<String>, value: f64) -> Result<f64, RigError> {
    if value > 0.0 && value <= LARGEST {
        Ok(value)
    } else {
        Err(wrong(field, format!("positive and finite, not {value}")))
    }
}

fn not_negative(field: impl Into<String>, value: f64) -> Result<f64, RigError> {
    if (0.0..=LARGEST).contains(&value) {
        Ok(value)
    } else {
        Err(wrong(field, format!("not negative and finite, not {value}")))
    }
}

fn finite(field: impl Into<String>, value: f64) -> Result<f64, RigError> {
    if value.abs() <= LARGEST {
        Ok(value)
    } else {
        Err(wrong(field, format!("finite and sane, not {value}")))
    }
}

fn wrong(field: impl Into<String>, problem: impl Into<String>) -> RigError {
    RigError::Field { field: field.into(), problem: problem.into() }
}
