//! The model file as it is written: raw serde types, checked into [`Model`].

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tactus_model::{Array, Covering, Effect, Indenter, Mesh, Psf, Response};

use super::{Base, Evidence, KnownEffect, Model, ModelFileError};

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.model/1";

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawModel {
    schema: String,
    base: RawBase,
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    effects: Vec<RawEffect>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBase {
    sensitivity_counts_per_mm: OneOrEach,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sensitivity_counts_per_mm_se: Option<OneOrEach>,
    quadratic_per_mm: OneOrEach,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    quadratic_per_mm_se: Option<OneOrEach>,
    baseline_counts: OneOrEach,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    baseline_counts_se: Option<OneOrEach>,
    noise_rms_counts: f64,
    array: RawArray,
    psf: RawPsf,
    sensitivity_reference: RawReference,
}

/// One number for all elements, or one each, row-major.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number for all elements, or a list with one for each")]
enum OneOrEach {
    One(f64),
    Each(Vec<f64>),
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
#[expect(clippy::struct_field_names, reason = "the names are the file's")]
struct RawPsf {
    sigma_intercept_mm: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_intercept_mm_se: Option<f64>,
    sigma_per_mm: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_per_mm_se: Option<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawReference {
    covering_mm: f64,
    indenter: RawIndenter,
}

/// A tool: its shape, and the size that goes with it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "kebab-case", deny_unknown_fields)]
enum RawIndenter {
    Cylinder { diameter_mm: f64 },
    Sphere { diameter_mm: f64 },
    Cone { diameter_mm: f64, apex_deg: f64 },
    Box { size_mm: [f64; 2] },
    Mesh { vertices_mm: Vec<[f64; 3]>, triangles: Vec<[u32; 3]> },
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEffect {
    name: String,
    parameters: BTreeMap<String, f64>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    standard_errors: BTreeMap<String, f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evidence: Option<RawEvidence>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEvidence {
    data: String,
    heldout_rms_before_counts: f64,
    heldout_rms_after_counts: f64,
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// [`ModelFileError`] names the line and key, the field or the effect that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, ModelFileError> {
        let raw: RawModel = toml::from_str(text)?;
        if raw.schema != SCHEMA {
            return Err(wrong("schema", format!("this program reads {SCHEMA:?}, not {:?}", raw.schema)));
        }
        let base = check_base(raw.base)?;
        let effects = raw.effects.into_iter().enumerate();
        let effects =
            effects.map(|(index, raw)| check_effect(index, raw, &base.array)).collect::<Result<_, _>>()?;
        let model = Self { base, effects };
        // Parameters that make no forward model are none of a sensor.
        model.forward()?;
        Ok(model)
    }

    /// The model file; reading it gives the same model, to the bit.
    ///
    /// # Errors
    /// If a model was made that no file can hold.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let Response {
            sensitivity_counts_per_mm,
            baseline_counts,
            quadratic_per_mm,
            reference_indenter,
            reference_covering,
        } = &self.base.response;
        let [sigma_intercept_mm_se, sigma_per_mm_se] = self.base.psf_se;
        let each = |values: &Option<Vec<f64>>| values.as_deref().map(one_or_each);
        toml::to_string(&RawModel {
            schema: SCHEMA.into(),
            base: RawBase {
                sensitivity_counts_per_mm: one_or_each(sensitivity_counts_per_mm),
                sensitivity_counts_per_mm_se: each(&self.base.sensitivity_counts_per_mm_se),
                quadratic_per_mm: one_or_each(quadratic_per_mm),
                quadratic_per_mm_se: each(&self.base.quadratic_per_mm_se),
                baseline_counts: one_or_each(baseline_counts),
                baseline_counts_se: each(&self.base.baseline_counts_se),
                noise_rms_counts: self.base.noise_rms_counts,
                array: raw_array(&self.base.array),
                psf: RawPsf {
                    sigma_intercept_mm: self.base.psf.sigma_intercept_mm,
                    sigma_intercept_mm_se,
                    sigma_per_mm: self.base.psf.sigma_per_mm,
                    sigma_per_mm_se,
                },
                sensitivity_reference: RawReference {
                    covering_mm: reference_covering.thickness_mm,
                    indenter: raw_indenter(reference_indenter),
                },
            },
            effects: self.effects.iter().map(raw_effect).collect(),
        })
    }
}

fn check_base(raw: RawBase) -> Result<Base, ModelFileError> {
    let array = check_array(raw.array)?;
    let elements = array.elements();
    let psf = raw.psf;
    positive("base.psf.sigma_intercept_mm", psf.sigma_intercept_mm)?;
    not_negative("base.psf.sigma_per_mm", psf.sigma_per_mm)?;
    let se = |field: &str, raw: Option<f64>| raw.map(|se| not_negative(field, se)).transpose();
    let each_se = |field: &str, raw: Option<OneOrEach>| {
        let Some(values) = raw.map(|raw| each(field, raw, elements)).transpose()? else { return Ok(None) };
        values.iter().try_for_each(|se| not_negative(field, *se).map(drop))?;
        Ok::<_, ModelFileError>(Some(values))
    };
    let reference = raw.sensitivity_reference;
    Ok(Base {
        array,
        psf: Psf { sigma_intercept_mm: psf.sigma_intercept_mm, sigma_per_mm: psf.sigma_per_mm },
        psf_se: [
            se("base.psf.sigma_intercept_mm_se", psf.sigma_intercept_mm_se)?,
            se("base.psf.sigma_per_mm_se", psf.sigma_per_mm_se)?,
        ],
        response: Response {
            sensitivity_counts_per_mm: each(
                "base.sensitivity_counts_per_mm",
                raw.sensitivity_counts_per_mm,
                elements,
            )?,
            baseline_counts: each("base.baseline_counts", raw.baseline_counts, elements)?,
            quadratic_per_mm: each("base.quadratic_per_mm", raw.quadratic_per_mm, elements)?,
            reference_indenter: check_indenter(reference.indenter)?,
            reference_covering: Covering {
                thickness_mm: positive("base.sensitivity_reference.covering_mm", reference.covering_mm)?,
            },
        },
        sensitivity_counts_per_mm_se: each_se(
            "base.sensitivity_counts_per_mm_se",
            raw.sensitivity_counts_per_mm_se,
        )?,
        baseline_counts_se: each_se("base.baseline_counts_se", raw.baseline_counts_se)?,
        quadratic_per_mm_se: each_se("base.quadratic_per_mm_se", raw.quadratic_per_mm_se)?,
        noise_rms_counts: not_negative("base.noise_rms_counts", raw.noise_rms_counts)?,
    })
}

fn check_array(raw: RawArray) -> Result<Array, ModelFileError> {
    for (field, stated, listed) in [
        ("base.array.rows", raw.rows, raw.row_centres_mm.len()),
        ("base.array.cols", raw.cols, raw.col_centres_mm.len()),
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

fn raw_array(array: &Array) -> RawArray {
    RawArray {
        name: array.name().into(),
        rows: array.rows(),
        cols: array.cols(),
        element_mm: array.element_mm(),
        col_centres_mm: array.col_centres_mm().to_vec(),
        row_centres_mm: array.row_centres_mm().to_vec(),
        rate_hz: array.rate_hz(),
        full_scale_counts: array.full_scale_counts(),
        step_counts: array.step_counts(),
    }
}

fn check_indenter(raw: RawIndenter) -> Result<Indenter, ModelFileError> {
    let field = |name: &str| format!("base.sensitivity_reference.indenter.{name}");
    let diameter = |diameter_mm| positive(field("diameter_mm"), diameter_mm);
    Ok(match raw {
        RawIndenter::Cylinder { diameter_mm } => Indenter::Cylinder { diameter_mm: diameter(diameter_mm)? },
        RawIndenter::Sphere { diameter_mm } => Indenter::Sphere { diameter_mm: diameter(diameter_mm)? },
        RawIndenter::Cone { diameter_mm, apex_deg } if apex_deg > 0.0 && apex_deg < 180.0 => {
            Indenter::Cone { diameter_mm: diameter(diameter_mm)?, apex_deg }
        }
        RawIndenter::Cone { .. } => {
            return Err(wrong(field("apex_deg"), "the full angle at the tip lies between 0 and 180"));
        }
        RawIndenter::Box { size_mm: [x, y] } => {
            Indenter::Box { size_mm: [positive(field("size_mm[0]"), x)?, positive(field("size_mm[1]"), y)?] }
        }
        RawIndenter::Mesh { vertices_mm, triangles } => {
            let mesh = Mesh::new(&vertices_mm, &triangles);
            Indenter::Mesh(Arc::new(mesh.map_err(|error| wrong(field("triangles"), error.to_string()))?))
        }
    })
}

fn raw_indenter(tool: &Indenter) -> RawIndenter {
    match tool {
        Indenter::Cylinder { diameter_mm } => RawIndenter::Cylinder { diameter_mm: *diameter_mm },
        Indenter::Sphere { diameter_mm } => RawIndenter::Sphere { diameter_mm: *diameter_mm },
        Indenter::Cone { diameter_mm, apex_deg } => {
            RawIndenter::Cone { diameter_mm: *diameter_mm, apex_deg: *apex_deg }
        }
        Indenter::Box { size_mm } => RawIndenter::Box { size_mm: *size_mm },
        Indenter::Mesh(mesh) => RawIndenter::Mesh {
            vertices_mm: mesh.vertices_mm().to_vec(),
            triangles: mesh.triangles().to_vec(),
        },
    }
}

fn check_effect(index: usize, raw: RawEffect, array: &Array) -> Result<KnownEffect, ModelFileError> {
    let parameters = raw.parameters.iter().map(|(name, value)| (name.as_str(), *value));
    let effect = Effect::new(&raw.name, parameters)
        .and_then(|effect| effect.fits(array).map(|()| effect))
        .map_err(|source| ModelFileError::Effect { index, source })?;
    for (name, se) in &raw.standard_errors {
        let field = format!("effect[{index}].standard_errors.{name}");
        if effect.value(name).is_none() {
            return Err(wrong(field, format!("{} has no such parameter", effect.name())));
        }
        not_negative(field, *se)?;
    }
    let rms = |name: &str, rms| not_negative(format!("effect[{index}].evidence.{name}"), rms);
    let check_evidence = |raw: RawEvidence| {
        Ok::<_, ModelFileError>(Evidence {
            data: raw.data,
            heldout_rms_before_counts: rms("heldout_rms_before_counts", raw.heldout_rms_before_counts)?,
            heldout_rms_after_counts: rms("heldout_rms_after_counts", raw.heldout_rms_after_counts)?,
        })
    };
    let evidence = raw.evidence.map(check_evidence).transpose()?;
    Ok(KnownEffect { effect, standard_errors: raw.standard_errors, evidence })
}

fn raw_effect(known: &KnownEffect) -> RawEffect {
    RawEffect {
        name: known.effect.name().into(),
        parameters: known.effect.parameters().map(|(name, value)| (name.into(), value)).collect(),
        standard_errors: known.standard_errors.clone(),
        evidence: known.evidence.as_ref().map(|evidence| RawEvidence {
            data: evidence.data.clone(),
            heldout_rms_before_counts: evidence.heldout_rms_before_counts,
            heldout_rms_after_counts: evidence.heldout_rms_after_counts,
        }),
    }
}

fn each(field: &str, raw: OneOrEach, elements: usize) -> Result<Vec<f64>, ModelFileError> {
    let values = match raw {
        OneOrEach::One(value) => vec![value; elements],
        OneOrEach::Each(values) => values,
    };
    if values.len() != elements {
        return Err(wrong(field, format!("{} values for {elements} elements", values.len())));
    }
    for (index, value) in values.iter().enumerate() {
        if value.abs() > LARGEST || value.is_nan() {
            return Err(wrong(format!("{field}[{index}]"), format!("finite and sane, not {value}")));
        }
    }
    Ok(values)
}

fn one_or_each(values: &[f64]) -> OneOrEach {
    match values {
        [first, rest @ ..] if rest.iter().all(|value| value.to_bits() == first.to_bits()) => {
            OneOrEach::One(*first)
        }
        _ => OneOrEach::Each(values.to_vec()),
    }
}

/// Nothing in a lab is larger, in any unit used here; sums and products of a few such numbers stay finite.
const LARGEST: f64 = 1e12;

fn positive(field: impl Into<String>, value: f64) -> Result<f64, ModelFileError> {
    if value > 0.0 && value <= LARGEST {
        Ok(value)
    } else {
        Err(wrong(field, format!("positive and finite, not {value}")))
    }
}

fn not_negative(field: impl Into<String>, value: f64) -> Result<f64, ModelFileError> {
    if (0.0..=LARGEST).contains(&value) {
        Ok(value)
    } else {
        Err(wrong(field, format!("not negative and finite, not {value}")))
    }
}

fn wrong(field: impl Into<String>, problem: impl Into<String>) -> ModelFileError {
    ModelFileError::Field { field: field.into(), problem: problem.into() }
}
