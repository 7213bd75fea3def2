//! The draft file: an effect that no class of the library names, as data, with what speaks for it; TOML, `tactus.draft/1`.
//!
//! Discovery writes it. Simulators, virtual devices and calibration take the draft from a model file, which holds its [`Draft`] whole;
//! discovery also takes those of a folder.
//!
//! ```toml
//! schema = "tactus.draft/1"
//! status = "drafted"
//!
//! [effect]
//! name = "draft-1"
//! sentence = "While the tool touches, the counts of each element rise by an amount of its own."
//! stage = "readout"
//! carrier = "counts"
//! combine = "add"
//! when = "in contact"
//! law = "linear"
//! numbers = { offset = 3.0, slope = 0.0 }
//!
//! [[effect.covariate]]
//! name = "depth"
//! unit = "mm"
//! range = [0.0, 0.6]
//! ```
//!
//! A table has `at`, a list of places for each covariate, and `values` in place of `numbers`. Unknown keys are refused.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Definition, Draft, EffectError, Law, PipelineStage, When};

use crate::description::{WrongField, check_kind, check_schema, wrong};

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.draft/1";

/// A draft with what speaks for it.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftFile {
    /// The effect.
    pub draft: Draft,
    /// What became of it.
    pub status: DraftStatus,
    /// Covariance of the law's numbers, or of a table's values; empty if it was not estimated.
    pub covariance: Vec<Vec<f64>>,
    /// Classes of the library that come nearest, the nearest first.
    pub nearest: Vec<Nearest>,
    /// The data that it was drafted from; `None` if it was only stated.
    pub evidence: Option<DraftEvidence>,
    /// What a new measurement says; `None` before there is one.
    pub confirmation: Option<DraftConfirmation>,
}

/// What a new measurement says of a draft.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DraftConfirmation {
    /// The new data, by id, with the SHA-256 of the file.
    pub data: BTreeMap<String, String>,
    /// The strength of the draft there; 1 as it was drafted.
    pub strength: f64,
    /// Standard error of the strength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength_se: Option<f64>,
    /// Share of what is left without it that it closes there, on presses that were not fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed_share: Option<f64>,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed_share_se: Option<f64>,
}

/// What became of a draft.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DraftStatus {
    /// It closes most of what was left, on presses that it was not drafted from.
    Drafted,
    /// It closes a part.
    Partial,
    /// A new measurement agrees with it.
    Confirmed,
    /// A new measurement does not.
    Refuted,
    /// A person has withdrawn it.
    Retired,
}

/// A class of the library beside a draft.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nearest {
    /// Its name.
    pub class: String,
    /// By how much the logarithm of its odds is behind that of the draft.
    pub ln_odds_behind: f64,
}

/// What speaks for a draft.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DraftEvidence {
    /// The data, by id, with the SHA-256 of the file.
    pub data: BTreeMap<String, String>,
    /// The seed of the discovery.
    pub seed: u64,
    /// Probability that noise gives as much to any draft of the grammar.
    pub p_value: f64,
    /// Logarithm of its odds against none.
    pub ln_odds: f64,
    /// In how many of five folds the same carrier and covariates come first.
    pub folds: u32,
    /// Share of what was left that it closes on presses that nobody had opened when it was drafted; `None` where nothing was left there.
    pub closed_share: Option<f64>,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed_share_se: Option<f64>,
}

/// Why a file is not a draft.
#[derive(Debug, thiserror::Error)]
pub enum DraftFileError {
    /// The TOML is malformed; the text names line and key.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// The draft is no effect.
    #[error("{0}")]
    Draft(#[from] EffectError),
    /// One field is wrong.
    #[error("{field}: {problem}")]
    Field {
        /// Path of the field, such as `effect.carrier`.
        field: String,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
}

impl From<WrongField> for DraftFileError {
    fn from(WrongField { field, problem }: WrongField) -> Self {
        Self::Field { field, problem }
    }
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    schema: String,
    status: DraftStatus,
    effect: RawDraft,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    covariance: Vec<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    nearest: Vec<Nearest>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evidence: Option<DraftEvidence>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    confirmation: Option<DraftConfirmation>,
}

/// A draft as draft files and model files hold it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawDraft {
    name: String,
    sentence: String,
    stage: String,
    carrier: String,
    combine: String,
    when: String,
    law: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    at: Option<Vec<Vec<f64>>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values: Option<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    numbers: Option<BTreeMap<String, f64>>,
    #[serde(rename = "covariate")]
    covariates: Vec<RawCovariate>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCovariate {
    name: String,
    unit: String,
    range: [f64; 2],
}

impl DraftFile {
    /// Reads a draft file.
    ///
    /// # Errors
    /// [`DraftFileError`] names the line and key, or the field that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, DraftFileError> {
        check_kind(SCHEMA, text)?;
        let raw: RawFile = toml::from_str(text)?;
        check_schema(SCHEMA, &raw.schema)?;
        let draft = raw.effect.check("effect")?;
        draft.check()?;
        Ok(Self {
            draft,
            status: raw.status,
            covariance: raw.covariance,
            nearest: raw.nearest,
            evidence: raw.evidence,
            confirmation: raw.confirmation,
        })
    }

    /// The text of the draft file; reading it gives the same draft, to the bit.
    ///
    /// # Errors
    /// If the draft holds values that no file can.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(&RawFile {
            schema: SCHEMA.into(),
            status: self.status,
            effect: RawDraft::of(&self.draft),
            covariance: self.covariance.clone(),
            nearest: self.nearest.clone(),
            evidence: self.evidence.clone(),
            confirmation: self.confirmation.clone(),
        })
    }

    /// The draft as an effect's definition.
    ///
    /// # Errors
    /// [`EffectError::Draft`].
    pub fn define(&self) -> Result<&'static Definition, EffectError> {
        self.draft.clone().define()
    }
}

impl DraftStatus {
    /// The word in the file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drafted => "drafted",
            Self::Partial => "partial",
            Self::Confirmed => "confirmed",
            Self::Refuted => "refuted",
            Self::Retired => "retired",
        }
    }

    /// True if discovery takes it among the effects of the library.
    pub const fn is_in_use(self) -> bool {
        matches!(self, Self::Drafted | Self::Partial | Self::Confirmed)
    }
}

impl RawDraft {
    pub(crate) fn of(draft: &Draft) -> Self {
        let table = if let Law::Table { at, values } = &draft.law { Some((at, values)) } else { None };
        let (at, values) = table.map(|(at, values)| (at.clone(), values.clone())).unzip();
        let numbers = draft.law.numbers().into_iter().map(|(name, value)| (name.to_owned(), value));
        let covariates = draft.covariates.iter().zip(&draft.ranges);
        Self {
            name: draft.name.clone(),
            sentence: draft.sentence.clone(),
            stage: stage_name(draft.stage()).into(),
            carrier: draft.carrier.name().into(),
            combine: combine(draft.carrier).into(),
            when: draft.when.name().into(),
            law: draft.law.name().into(),
            weights: draft.weights.clone(),
            numbers: at.is_none().then(|| numbers.collect()),
            at,
            values,
            covariates: covariates
                .map(|(covariate, range)| RawCovariate {
                    name: covariate.name().into(),
                    unit: covariate.unit().into(),
                    range: *range,
                })
                .collect(),
        }
    }

    /// The draft; `field` is the path of this table in its file.
    pub(crate) fn check(self, field: &str) -> Result<Draft, WrongField> {
        let among = |key: &str, given: &str, known: &mut dyn Iterator<Item = &'static str>| {
            let known: Vec<&str> = known.collect();
            wrong(format!("{field}.{key}"), format!("must be one of {}; not {given:?}", known.join(", ")))
        };
        let carrier =
            Carrier::ALL.into_iter().find(|known| known.name() == self.carrier).ok_or_else(|| {
                among("carrier", &self.carrier, &mut Carrier::ALL.into_iter().map(Carrier::name))
            })?;
        let when = When::ALL
            .into_iter()
            .find(|known| known.name() == self.when)
            .ok_or_else(|| among("when", &self.when, &mut When::ALL.into_iter().map(When::name)))?;
        let mut covariates = Vec::new();
        for (index, raw) in self.covariates.iter().enumerate() {
            let key = format!("covariate[{index}].name");
            let covariate = Covariate::find(&raw.name).ok_or_else(|| {
                among(&key, &raw.name, &mut Covariate::ALL.into_iter().map(Covariate::name))
            })?;
            agree(field, &format!("covariate[{index}].unit"), &raw.unit, covariate.unit())?;
            covariates.push(covariate);
        }
        let law = match (self.at, self.values, self.numbers) {
            (Some(at), Some(values), None) if self.law == "table" => Law::Table { at, values },
            (None, None, Some(numbers)) => {
                let numbers: Vec<(&str, f64)> =
                    numbers.iter().map(|(name, value)| (name.as_str(), *value)).collect();
                Law::of_numbers(&self.law, &numbers).ok_or_else(|| {
                    let problem = format!("{:?} is no law with the numbers that are given", self.law);
                    wrong(format!("{field}.law"), problem)
                })?
            }
            _ => {
                let problem = "a table has at and values, any other law has numbers";
                return Err(wrong(format!("{field}.law"), problem));
            }
        };
        let draft = Draft {
            name: self.name,
            sentence: self.sentence,
            carrier,
            when,
            covariates,
            ranges: self.covariates.iter().map(|raw| raw.range).collect(),
            law,
            weights: self.weights,
        };
        agree(field, "stage", &self.stage, stage_name(draft.stage()))?;
        agree(field, "combine", &self.combine, combine(carrier))?;
        Ok(draft)
    }
}

/// What follows from the rest must be stated so.
fn agree(field: &str, key: &str, stated: &str, follows: &str) -> Result<(), WrongField> {
    if stated == follows {
        return Ok(());
    }
    Err(wrong(format!("{field}.{key}"), format!("must be {follows:?} here, not {stated:?}")))
}

/// The name of a stage of the pipeline.
pub const fn stage_name(stage: PipelineStage) -> &'static str {
    match stage {
        PipelineStage::Motion => "motion",
        PipelineStage::Contact => "contact",
        PipelineStage::Covering => "covering",
        PipelineStage::Element => "element",
        PipelineStage::Readout => "readout",
    }
}

/// How the curve joins what is there: a share multiplies.
const fn combine(carrier: Carrier) -> &'static str {
    if matches!(carrier, Carrier::OwnSignal) { "multiply" } else { "add" }
}

#[cfg(test)]
#[path = "draft_tests.rs"]
mod tests;
