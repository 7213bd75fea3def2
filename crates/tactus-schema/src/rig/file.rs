//! The form of the rig file: raw serde types, checked into [`Rig`].

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tactus_model::{Covering, Psf};

use super::registration::RawRegistration;
use super::service::{self, RawEnvelope, RawMotion, RawPolicy, RawSensorLink};
use super::simulation::RawSimulation;
use super::stage::RawStageLink;
use super::{Rig, RigError, SensitivityReference};
use crate::Model;
use crate::description::{
    OneOrEach, RawArray, RawIndenter, WrongField, check_kind, check_schema, not_negative, positive, wrong,
};

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.rig/1";

/// Links, limits and the simulation's hidden truth are read, but never stored with data.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRig {
    /// `"tactus.rig/1"`.
    schema: String,
    /// Name of the rig, a part of the keys on the bus: letters, digits, `-` and `_`.
    name: String,
    /// True if no physical device is behind it; its data then say so.
    simulated: bool,
    /// The array.
    array: RawArray,
    /// Where the array lies in the robot's frame.
    registration: RawRegistration,
    /// How the covering spreads a press.
    psf: RawPsf,
    /// Counts per mm when the reference indenter presses the element's own centre: one number, or one for
    /// each element. Negative for elements that fall.
    sensitivity_counts_per_mm: OneOrEach,
    /// With which tool and covering that sensitivity is.
    sensitivity_reference: RawReference,
    /// Counts without load: one number, or one for each element.
    baseline_counts: OneOrEach,
    /// The tools by their names.
    indenters: BTreeMap<String, RawIndenter>,
    /// Name of the tool on the stage; without the key, that of the reference.
    indenter: Option<String>,
    /// The covering in place; without the table, that of the reference.
    covering: Option<RawCovering>,
    /// Bounds that no script, client or fault may cross. A service needs this table and the next four.
    #[serde(skip_serializing)]
    envelope: Option<RawEnvelope>,
    /// How the stage moves; speeds within the envelope's.
    #[serde(skip_serializing)]
    motion: Option<RawMotion>,
    /// What to do when something is lost.
    #[serde(skip_serializing)]
    policy: Option<RawPolicy>,
    /// The link to the sensor.
    #[serde(skip_serializing)]
    sensor: Option<RawSensorLink>,
    /// The link to the stage.
    #[serde(skip_serializing)]
    stage: Option<RawStageLink>,
    /// What the virtual devices of a simulated rig hide. The service does not read it.
    #[serde(skip_serializing)]
    simulation: Option<RawSimulation>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPsf {
    /// Spread without a covering: Eq. 4, in mm.
    sigma_intercept_mm: f64,
    /// By how much it grows with each mm of covering.
    sigma_per_mm: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawReference {
    /// Name of the tool.
    indenter: String,
    /// Thickness of the covering.
    covering_mm: f64,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCovering {
    /// Thickness of the covering.
    thickness_mm: f64,
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`] names the line and key, or the field, that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        check_kind(SCHEMA, text)?;
        toml::from_str::<RawRig>(text)?.check()
    }

    /// Reads the JSON that is stored with data; the parts that only a service needs may be absent.
    ///
    /// # Errors
    /// As [`Rig::from_toml`].
    pub fn from_json(text: &str) -> Result<Self, RigError> {
        serde_json::from_str::<RawRig>(text)?.check()
    }

    /// The description that is stored with data: everything except links, limits and the simulation's hidden truth.
    pub fn to_json(&self) -> String {
        serde_json::json!(RawRig::of(self)).to_string()
    }
}

impl RawRig {
    fn of(rig: &Rig) -> Self {
        Self {
            schema: SCHEMA.into(),
            name: rig.name.clone(),
            simulated: rig.simulated,
            array: RawArray::of(&rig.array),
            registration: RawRegistration::of(&rig.registration),
            psf: RawPsf {
                sigma_intercept_mm: rig.psf.sigma_intercept_mm,
                sigma_per_mm: rig.psf.sigma_per_mm,
            },
            sensitivity_counts_per_mm: OneOrEach::of(&rig.sensitivity_counts_per_mm),
            sensitivity_reference: RawReference {
                indenter: rig.sensitivity_reference.indenter.clone(),
                covering_mm: rig.sensitivity_reference.covering.thickness_mm,
            },
            baseline_counts: OneOrEach::of(&rig.baseline_counts),
            indenters: rig.indenters.iter().map(|(id, tool)| (id.clone(), RawIndenter::of(tool))).collect(),
            indenter: Some(rig.indenter.clone()),
            covering: Some(RawCovering { thickness_mm: rig.covering.thickness_mm }),
            envelope: None,
            motion: None,
            policy: None,
            sensor: None,
            stage: None,
            simulation: None,
        }
    }

    fn check(self) -> Result<Rig, RigError> {
        check_schema(SCHEMA, &self.schema)?;
        // The name of a rig in service is part of the bus keys; descriptions stored with data may have any name.
        let name_fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.name.is_empty() || (self.sensor.is_some() && !self.name.chars().all(name_fits)) {
            let problem = "letters, digits, '-' and '_' only: it becomes part of the bus keys";
            return Err(wrong("name", problem).into());
        }
        let array = self.array.check::<RigError>("array")?;
        let elements = array.elements();
        let indenters = self
            .indenters
            .into_iter()
            .map(|(id, tool)| tool.check(&format!("indenters.{id}")).map(|tool| (id, tool)))
            .collect::<Result<BTreeMap<_, _>, _>>()?;
        let known = |field: &str, id: String| {
            if indenters.contains_key(&id) {
                Ok(id)
            } else {
                let ids: Vec<_> = indenters.keys().map(String::as_str).collect();
                Err(wrong(field, format!("no indenter {id:?}; there is: {}", ids.join(", "))))
            }
        };
        let reference = SensitivityReference {
            covering: covering("sensitivity_reference.covering_mm", self.sensitivity_reference.covering_mm)?,
            indenter: known("sensitivity_reference.indenter", self.sensitivity_reference.indenter)?,
        };
        let sensitivity_counts_per_mm =
            self.sensitivity_counts_per_mm.check("sensitivity_counts_per_mm", elements)?;
        let baseline_counts = self.baseline_counts.check("baseline_counts", elements)?;
        let covering = match self.covering {
            Some(RawCovering { thickness_mm }) => covering("covering.thickness_mm", thickness_mm)?,
            None => reference.covering,
        };
        let rest = service::Rest {
            covering,
            baseline_counts: &baseline_counts,
            sensitivity_counts_per_mm: &sensitivity_counts_per_mm,
        };
        let service =
            service::check(&array, rest, self.envelope, self.motion, self.policy, self.sensor, self.stage)?;
        let rig = Rig {
            name: self.name,
            simulated: self.simulated,
            registration: self.registration.check("registration")?,
            psf: self.psf.check()?,
            sensitivity_counts_per_mm,
            baseline_counts,
            indenter: match self.indenter {
                Some(id) => known("indenter", id)?,
                None => reference.indenter.clone(),
            },
            covering,
            sensitivity_reference: reference,
            service,
            simulation: self.simulation.map(|simulation| simulation.check(&array)).transpose()?,
            array,
            indenters,
        };
        if rig.simulated && rig.service.is_some() && rig.simulation.is_none() {
            return Err(wrong("simulation", "missing; a simulated rig needs it").into());
        }
        // A sensor's description always makes a forward model.
        if let Some(Err(error)) = Model::of_rig(&rig).map(|model| model.forward()) {
            return Err(wrong("sensitivity_reference", error.to_string()).into());
        }
        Ok(rig)
    }
}

impl RawPsf {
    fn check(self) -> Result<Psf, WrongField> {
        Ok(Psf {
            sigma_intercept_mm: positive("psf.sigma_intercept_mm", self.sigma_intercept_mm)?,
            sigma_per_mm: not_negative("psf.sigma_per_mm", self.sigma_per_mm)?,
        })
    }
}

fn covering(field: &str, thickness_mm: f64) -> Result<Covering, WrongField> {
    Ok(Covering { thickness_mm: positive(field, thickness_mm)? })
}
