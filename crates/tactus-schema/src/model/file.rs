//! The form of the model file: raw serde types, checked into [`Model`].

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tactus_model::effect::{By, Definition, Knots, Table};
use tactus_model::{Array, Covering, Effect, Psf, Response};

use super::{BaseModel, Evidence, KnownEffect, Model, ModelFileError};
use crate::description::{
    OneOrEach, RawArray, RawIndenter, WrongField, check_kind, check_schema, not_negative, positive, wrong,
};
use crate::draft::RawDraft;

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.model/1";

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawModel {
    /// `"tactus.model/1"`.
    schema: String,
    /// The base model's numbers.
    base: RawBase,
    /// `[[effect]]`: the effects, in the order in which they act.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    effects: Vec<RawEffect>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBase {
    /// Counts per mm when the reference indenter presses the element's own centre: one number, or one for
    /// each element.
    sensitivity_counts_per_mm: OneOrEach,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sensitivity_counts_per_mm_se: Option<OneOrEach>,
    /// `k` of the response `R(u) = u + k u^2`: one number, or one for each element.
    quadratic_per_mm: OneOrEach,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    quadratic_per_mm_se: Option<OneOrEach>,
    /// Counts without load: one number, or one for each element.
    baseline_counts: OneOrEach,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    baseline_counts_se: Option<OneOrEach>,
    /// Standard deviation of an element's noise.
    noise_rms_counts: f64,
    /// The array, as in a rig file.
    array: RawArray,
    /// How the covering spreads a press.
    psf: RawPsf,
    /// With which tool and covering the sensitivity is.
    sensitivity_reference: RawReference,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "the names are the file's")]
struct RawPsf {
    /// Spread without a covering: Eq. 4, in mm.
    sigma_intercept_mm: f64,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_intercept_mm_se: Option<f64>,
    /// By how much it grows with each mm of covering.
    sigma_per_mm: f64,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_per_mm_se: Option<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawReference {
    /// Thickness of the covering.
    covering_mm: f64,
    /// The tool, as in a rig file.
    indenter: RawIndenter,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEffect {
    /// Name of the effect, of the library or of the draft.
    name: String,
    /// Version of the draft, as the lab's library lists it: the SHA-256 of its table with an empty name, in hexadecimal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    version: Option<String>,
    /// Its parameters by name; the units are in the names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, f64>,
    /// Places and values, by the keys of the effect's curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    knots: Option<BTreeMap<String, Vec<f64>>>,
    /// Tables in place of parameters, by their names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    tables: BTreeMap<String, RawTable>,
    /// Standard errors of parameters.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    standard_errors: BTreeMap<String, f64>,
    /// What has put it there: the data, and the residual on held-out presses before and after.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evidence: Option<RawEvidence>,
    /// What it is, if the library does not name it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    draft: Option<RawDraft>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTable {
    by: String,
    at: Vec<f64>,
    values: Vec<f64>,
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
        check_kind(SCHEMA, text)?;
        let raw: RawModel = toml::from_str(text)?;
        check_schema(SCHEMA, &raw.schema)?;
        let base = raw.base.check()?;
        let effects = raw.effects.into_iter().enumerate();
        let effects = effects.map(|(index, raw)| raw.check(index, &base.array)).collect::<Result<_, _>>()?;
        let model = Self { base, effects };
        // A sensor's parameters always make a forward model.
        model.forward()?;
        Ok(model)
    }

    /// The text of the model file; reading it gives the same model, to the bit.
    ///
    /// # Errors
    /// If the model holds values that no file can.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(&RawModel {
            schema: SCHEMA.into(),
            base: RawBase::of(&self.base),
            effects: self.effects.iter().map(RawEffect::of).collect(),
        })
    }
}

impl RawBase {
    fn of(base: &BaseModel) -> Self {
        let [sigma_intercept_mm_se, sigma_per_mm_se] = base.psf_se;
        let response = &base.response;
        let each_se = |values: &Option<Vec<f64>>| values.as_deref().map(OneOrEach::of);
        Self {
            sensitivity_counts_per_mm: OneOrEach::of(&response.sensitivity_counts_per_mm),
            sensitivity_counts_per_mm_se: each_se(&base.sensitivity_counts_per_mm_se),
            quadratic_per_mm: OneOrEach::of(&response.quadratic_per_mm),
            quadratic_per_mm_se: each_se(&base.quadratic_per_mm_se),
            baseline_counts: OneOrEach::of(&response.baseline_counts),
            baseline_counts_se: each_se(&base.baseline_counts_se),
            noise_rms_counts: base.noise_rms_counts,
            array: RawArray::of(&base.array),
            psf: RawPsf {
                sigma_intercept_mm: base.psf.sigma_intercept_mm,
                sigma_intercept_mm_se,
                sigma_per_mm: base.psf.sigma_per_mm,
                sigma_per_mm_se,
            },
            sensitivity_reference: RawReference {
                covering_mm: response.reference_covering.thickness_mm,
                indenter: RawIndenter::of(&response.reference_indenter),
            },
        }
    }

    fn check(self) -> Result<BaseModel, ModelFileError> {
        let array = self.array.check::<ModelFileError>("base.array")?;
        let each = |name: &str, raw: OneOrEach| raw.check(&format!("base.{name}"), array.elements());
        let each_se = |name: &str, raw: Option<OneOrEach>| {
            let Some(values) = raw.map(|raw| each(name, raw)).transpose()? else { return Ok(None) };
            for (index, se) in values.iter().enumerate() {
                not_negative(format!("base.{name}[{index}]"), *se)?;
            }
            Ok::<_, WrongField>(Some(values))
        };
        let (psf, psf_se) = self.psf.check()?;
        let reference = self.sensitivity_reference;
        Ok(BaseModel {
            psf,
            psf_se,
            response: Response {
                sensitivity_counts_per_mm: each("sensitivity_counts_per_mm", self.sensitivity_counts_per_mm)?,
                baseline_counts: each("baseline_counts", self.baseline_counts)?,
                quadratic_per_mm: each("quadratic_per_mm", self.quadratic_per_mm)?,
                reference_indenter: reference.indenter.check("base.sensitivity_reference.indenter")?,
                reference_covering: Covering {
                    thickness_mm: positive("base.sensitivity_reference.covering_mm", reference.covering_mm)?,
                },
            },
            sensitivity_counts_per_mm_se: each_se(
                "sensitivity_counts_per_mm_se",
                self.sensitivity_counts_per_mm_se,
            )?,
            baseline_counts_se: each_se("baseline_counts_se", self.baseline_counts_se)?,
            quadratic_per_mm_se: each_se("quadratic_per_mm_se", self.quadratic_per_mm_se)?,
            noise_rms_counts: not_negative("base.noise_rms_counts", self.noise_rms_counts)?,
            array,
        })
    }
}

impl RawPsf {
    fn check(self) -> Result<(Psf, [Option<f64>; 2]), WrongField> {
        let psf = Psf {
            sigma_intercept_mm: positive("base.psf.sigma_intercept_mm", self.sigma_intercept_mm)?,
            sigma_per_mm: not_negative("base.psf.sigma_per_mm", self.sigma_per_mm)?,
        };
        let se = |field: &str, se: Option<f64>| se.map(|se| not_negative(field, se)).transpose();
        Ok((
            psf,
            [
                se("base.psf.sigma_intercept_mm_se", self.sigma_intercept_mm_se)?,
                se("base.psf.sigma_per_mm_se", self.sigma_per_mm_se)?,
            ],
        ))
    }
}

impl RawEffect {
    fn of(known: &KnownEffect) -> Self {
        let curve = known.effect.definition().curve.as_ref();
        let knots = known.effect.knots().zip(curve).map(|(Knots { at, values }, curve)| {
            [(curve.at.to_owned(), at.clone()), (curve.of.to_owned(), values.clone())].into()
        });
        Self {
            name: known.effect.name().into(),
            version: known.version.clone(),
            parameters: known.effect.parameters().map(|(name, value)| (name.into(), value)).collect(),
            knots,
            tables: known.effect.tables().map(|(name, table)| (name.into(), RawTable::of(table))).collect(),
            standard_errors: known.standard_errors.clone(),
            evidence: known.evidence.as_ref().map(|evidence| RawEvidence {
                data: evidence.data.clone(),
                heldout_rms_before_counts: evidence.heldout_rms_before_counts,
                heldout_rms_after_counts: evidence.heldout_rms_after_counts,
            }),
            draft: known.effect.definition().draft().map(RawDraft::of),
        }
    }

    fn check(self, index: usize, array: &Array) -> Result<KnownEffect, ModelFileError> {
        let wrong_effect = |source| ModelFileError::Effect { index, source };
        let parameters = self.parameters.iter().map(|(name, value)| (name.as_str(), *value));
        let definition = match self.draft {
            None => Definition::find(&self.name),
            Some(raw) => {
                let field = format!("effect[{index}].draft");
                let draft = raw.check(&field)?;
                if draft.name != self.name {
                    return Err(
                        wrong(format!("{field}.name"), format!("must be {:?} here", self.name)).into()
                    );
                }
                draft.define()
            }
        }
        .map_err(wrong_effect)?;
        let knots = self.knots.as_ref().map(|raw| knots(raw, index, definition)).transpose()?;
        let mut tables = BTreeMap::new();
        for (name, raw) in &self.tables {
            tables.insert(name.as_str(), raw.check(index, name)?);
        }
        let effect = Effect::with_tables(definition, parameters, knots, tables);
        let effect = effect.and_then(|effect| effect.fits(array).map(|()| effect)).map_err(wrong_effect)?;
        for (name, se) in &self.standard_errors {
            let field = format!("effect[{index}].standard_errors.{name}");
            if effect.value(name).is_none() {
                return Err(wrong(field, format!("{} has no such parameter", effect.name())).into());
            }
            not_negative(field, *se)?;
        }
        let evidence = self.evidence.map(|evidence| evidence.check(index)).transpose()?;
        let is_hash =
            |version: &String| version.len() == 64 && version.chars().all(|one| one.is_ascii_hexdigit());
        if self.version.as_ref().is_some_and(|version| definition.draft().is_none() || !is_hash(version)) {
            let problem = "must be the SHA-256 of a draft, in hexadecimal; effects of the library have none";
            return Err(wrong(format!("effect[{index}].version"), problem).into());
        }
        Ok(KnownEffect { effect, standard_errors: self.standard_errors, evidence, version: self.version })
    }
}

/// Places and values of an effect's curve. An effect without a curve refuses any knots.
fn knots(
    raw: &BTreeMap<String, Vec<f64>>,
    index: usize,
    definition: &Definition,
) -> Result<Knots, WrongField> {
    let Some(curve) = &definition.curve else { return Ok(Knots::default()) };
    match (raw.get(curve.at), raw.get(curve.of)) {
        (Some(at), Some(values)) if raw.len() == 2 => Ok(Knots { at: at.clone(), values: values.clone() }),
        _ => Err(wrong(
            format!("effect[{index}].knots"),
            format!("those of {} have {} and {} and nothing else", definition.name, curve.at, curve.of),
        )),
    }
}

impl RawTable {
    fn of(Table { by, at, values }: &Table) -> Self {
        Self { by: by.name().into(), at: at.clone(), values: values.clone() }
    }

    fn check(&self, effect: usize, parameter: &str) -> Result<Table, WrongField> {
        let by = By::ALL.into_iter().find(|by| by.name() == self.by).ok_or_else(|| {
            let known = By::ALL.map(By::name).join(", ");
            wrong(format!("effect[{effect}].tables.{parameter}.by"), format!("must be one of {known}"))
        })?;
        Ok(Table { by, at: self.at.clone(), values: self.values.clone() })
    }
}

impl RawEvidence {
    fn check(self, effect: usize) -> Result<Evidence, WrongField> {
        let rms = |name: &str, rms| not_negative(format!("effect[{effect}].evidence.{name}"), rms);
        Ok(Evidence {
            data: self.data,
            heldout_rms_before_counts: rms("heldout_rms_before_counts", self.heldout_rms_before_counts)?,
            heldout_rms_after_counts: rms("heldout_rms_after_counts", self.heldout_rms_after_counts)?,
        })
    }
}
