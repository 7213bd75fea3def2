//! The draft file: an effect that no class of the library names, as data, with what speaks for it; TOML, `tactus.draft/1`.
//!
//! Discovery writes it. Simulators and virtual devices take the draft from a model file, which holds its [`Draft`] whole; discovery also takes
//! those of a folder.
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
//! A table has `at`, a list of places for each covariate, and `values` in place of `numbers`. Unknown keys are refused, and so is a file whose
//! end is missing: what speaks for the draft must be there, unless it was only stated.

mod line;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Definition, Draft, EffectError, Law, PipelineStage, When};

use crate::description::{LARGEST, WrongField, check_kind, check_schema, wrong};
use line::line_of;

/// The schema's name in the file.
pub const SCHEMA: &str = "tactus.draft/1";
/// The folds of a discovery, in each of which a draft may come first.
const FOLDS: u32 = 5;

/// A draft with what speaks for it.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftFile {
    /// The effect.
    pub draft: Draft,
    /// What became of it.
    pub status: DraftStatus,
    /// What it was before a person withdrew it.
    pub was: Option<DraftStatus>,
    /// Covariance of the law's numbers that were fitted, or of a table's values; empty if it was not estimated. Of a straight line these are
    /// the offset and the slope, or one of them; of a tone its sine and cosine; of other laws the scale.
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
    /// Share of what was left that it closes on presses that were not fitted; left out where nothing was left there.
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
    /// One field is wrong, or missing.
    #[error("{}{field}: {problem}", line.map_or_else(String::new, |line| format!("line {line}: ")))]
    Field {
        /// Its line, from 1; `None` of a field that is missing.
        line: Option<usize>,
        /// Path of the field, such as `effect.carrier`.
        field: String,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    /// `"tactus.draft/1"`.
    schema: String,
    /// What became of it.
    status: DraftStatus,
    /// What it was before a person withdrew it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    was: Option<DraftStatus>,
    /// The effect.
    effect: RawDraft,
    /// Covariance of the law's fitted numbers: of a straight line its offset and slope, or one of them; of a tone its sine and cosine; of other
    /// laws the scale; of a table its values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    covariance: Vec<Vec<f64>>,
    /// Classes of the library that come nearest, the nearest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    nearest: Vec<Nearest>,
    /// The data that it was drafted from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evidence: Option<DraftEvidence>,
    /// What a new measurement says of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    confirmation: Option<DraftConfirmation>,
}

/// A draft as draft files and model files hold it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawDraft {
    /// Its name: small letters, digits and hyphens, and none of the library's.
    name: String,
    /// What it is, in one sentence.
    sentence: String,
    /// Where in the pipeline it acts: follows from the carrier and the covariates, and must be stated so.
    stage: String,
    /// What it adds to.
    carrier: String,
    /// `"multiply"` of the carrier `own signal`, else `"add"`.
    combine: String,
    /// When it acts.
    when: String,
    /// The curve.
    law: String,
    /// A weight for each element, if it does not act on all alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Vec<f64>>,
    /// Places of a table, in order: a list for each covariate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    at: Option<Vec<Vec<f64>>>,
    /// Values of a table: of two covariates, those of the second one follow each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values: Option<Vec<f64>>,
    /// The numbers of any other law, by name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    numbers: Option<BTreeMap<String, f64>>,
    /// What the curve is a function of: one or two.
    #[serde(rename = "covariate")]
    covariates: Vec<RawCovariate>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCovariate {
    /// Its name.
    name: String,
    /// Its unit, which must be stated; empty of a number without one.
    unit: String,
    /// Its least and greatest value in the data.
    range: [f64; 2],
}

impl DraftFile {
    /// Reads a draft file.
    ///
    /// # Errors
    /// [`DraftFileError`] names the line and key, or the field that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, DraftFileError> {
        let placed = |WrongField { field, problem }| DraftFileError::Field {
            line: line_of(text, &field),
            field,
            problem,
        };
        check_kind(SCHEMA, text).map_err(placed)?;
        let raw: RawFile = toml::from_str(text)?;
        Self::checked(raw).map_err(placed)
    }

    fn checked(raw: RawFile) -> Result<Self, WrongField> {
        check_schema(SCHEMA, &raw.schema)?;
        let draft = raw.effect.check("effect")?;
        draft.check().map_err(|error| wrong(format!("effect.{}", wrong_part(&draft)), error.to_string()))?;
        let file = Self {
            draft,
            status: raw.status,
            was: raw.was,
            covariance: raw.covariance,
            nearest: raw.nearest,
            evidence: raw.evidence,
            confirmation: raw.confirmation,
        };
        file.check_numbers()?;
        file.check_nearest()?;
        file.check_evidence()?;
        file.check_confirmation()?;
        Ok(file)
    }

    /// Checks that the lists of numbers have the right length.
    fn check_numbers(&self) -> Result<(), WrongField> {
        if self.draft.weights.as_ref().is_some_and(Vec::is_empty) {
            return Err(wrong("effect.weights", "must have a number for each element"));
        }
        let size = self.covariance.len();
        let fitted = fitted_numbers(&self.draft.law);
        if size > 0 && !fitted.contains(&size) {
            let [least, most] = [fitted.start(), fitted.end()];
            let of = if least == most { most.to_string() } else { format!("{least} or {most}") };
            return Err(wrong("covariance", format!("must have {of} rows for this law, not {size}")));
        }
        for (index, row) in self.covariance.iter().enumerate() {
            let field = || format!("covariance[{index}]");
            if row.len() != size {
                return Err(wrong(field(), format!("must have {size} numbers, not {}", row.len())));
            }
            row.iter().try_for_each(|number| finite(field(), *number))?;
        }
        Ok(())
    }

    /// Checks the classes that come nearest.
    fn check_nearest(&self) -> Result<(), WrongField> {
        for (index, one) in self.nearest.iter().enumerate() {
            plain(format!("nearest[{index}].class"), &one.class)?;
            finite(format!("nearest[{index}].ln_odds_behind"), one.ln_odds_behind)?;
        }
        Ok(())
    }

    /// What the file must bear out: what a withdrawn draft would be if somebody took it back.
    fn stated(&self) -> DraftStatus {
        let mut back = self.clone();
        back.take_back();
        back.status
    }

    /// Checks that what speaks for the draft is there.
    fn check_evidence(&self) -> Result<(), WrongField> {
        if self.was == Some(DraftStatus::Retired) {
            return Err(wrong(
                "was",
                "must be what the draft was before a person withdrew it, not \"retired\"",
            ));
        }
        let is_stated =
            self.covariance.is_empty() && self.nearest.is_empty() && self.stated() != DraftStatus::Partial;
        let Some(seen) = &self.evidence else {
            let is_lost = "is missing: the file has lost its end, or it was cut by hand";
            return if is_stated { Ok(()) } else { Err(wrong("evidence", is_lost)) };
        };
        if seen.data.is_empty() {
            return Err(wrong("evidence.data", "must name the data; the file may have lost its end"));
        }
        seen.data.keys().try_for_each(|run| plain("evidence.data", run))?;
        if !(0.0..=1.0).contains(&seen.p_value) {
            return Err(wrong("evidence.p_value", format!("must be between 0 and 1, not {}", seen.p_value)));
        }
        finite("evidence.ln_odds", seen.ln_odds)?;
        if seen.folds > FOLDS {
            return Err(wrong("evidence.folds", format!("must be at most {FOLDS}, not {}", seen.folds)));
        }
        check_share("evidence", seen.closed_share, seen.closed_share_se)
    }

    /// Checks what a new measurement says, and that it is there if the status rests on one.
    fn check_confirmation(&self) -> Result<(), WrongField> {
        let status = self.stated();
        let is_measured = matches!(status, DraftStatus::Confirmed | DraftStatus::Refuted);
        let Some(told) = &self.confirmation else {
            let name = status.name();
            let is_missing =
                format!("is missing: a draft is {name} by a new measurement, and the file has none");
            return if is_measured { Err(wrong("confirmation", is_missing)) } else { Ok(()) };
        };
        if told.data.is_empty() {
            let is_empty = "must name the new data; the file may have lost its end";
            return Err(wrong("confirmation.data", is_empty));
        }
        told.data.keys().try_for_each(|run| plain("confirmation.data", run))?;
        finite("confirmation.strength", told.strength)?;
        error("confirmation.strength_se", told.strength_se)?;
        check_share("confirmation", told.closed_share, told.closed_share_se)
    }

    /// The text of the draft file; reading it gives the same draft, to the bit.
    ///
    /// # Errors
    /// If the draft holds values that no file can.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(&RawFile {
            schema: SCHEMA.into(),
            status: self.status,
            was: self.was,
            effect: RawDraft::of(&self.draft),
            covariance: self.covariance.clone(),
            nearest: self.nearest.clone(),
            evidence: self.evidence.clone(),
            confirmation: self.confirmation.clone(),
        })
    }

    /// The text of which the SHA-256 is the draft's version: its table, with an empty name. It is the same under each name and status.
    ///
    /// # Errors
    /// If the draft holds values that no file can.
    pub fn versioned(draft: &Draft) -> Result<String, toml::ser::Error> {
        toml::to_string(&RawDraft { name: String::new(), ..RawDraft::of(draft) })
    }

    /// The draft as an effect's definition.
    ///
    /// # Errors
    /// [`EffectError::Draft`].
    pub fn define(&self) -> Result<&'static Definition, EffectError> {
        self.draft.clone().define()
    }

    /// Withdraws the draft: no discovery tries it.
    pub fn retire(&mut self) {
        if self.status != DraftStatus::Retired {
            self.was = Some(std::mem::replace(&mut self.status, DraftStatus::Retired));
        }
    }

    /// Takes a withdrawn draft back. A file that does not say what it was before is a draft again.
    pub fn take_back(&mut self) {
        if self.status == DraftStatus::Retired {
            self.status = self.was.take().unwrap_or(DraftStatus::Drafted);
        }
    }
}

impl DraftStatus {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Drafted, Self::Partial, Self::Confirmed, Self::Refuted, Self::Retired];

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

    /// What it means.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Drafted => "it closes most of what was left, on presses that it was not drafted from",
            Self::Partial => "it closes a part of what was left",
            Self::Confirmed => "a new measurement agrees with it",
            Self::Refuted => {
                "a new measurement does not agree with it; it is kept, and no discovery tries it"
            }
            Self::Retired => "a person has withdrawn it; it is kept, and no discovery tries it",
        }
    }

    /// True if no new measurement has told yet whether it holds.
    pub const fn is_open(self) -> bool {
        matches!(self, Self::Drafted | Self::Partial)
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
        plain(format!("{field}.sentence"), &draft.sentence)?;
        // What is no effect at all is told by its own check.
        if draft.check().is_ok() {
            check_curve(&draft, field)?;
        }
        Ok(draft)
    }
}

/// Checks that a draft changes a model by finite numbers: that its curve, and each weight's part of it, is within [`LARGEST`] on its range.
fn check_curve(draft: &Draft, field: &str) -> Result<(), WrongField> {
    let within = |key: &str, value: f64| {
        let problem = format!("must not give an effect beyond +-{LARGEST:e}; it gives {value:e}");
        if value.abs() <= LARGEST { Ok(()) } else { Err(wrong(format!("{field}.{key}"), problem)) }
    };
    let (key, values) = match &draft.law {
        Law::Table { values, .. } => ("values", values.clone()),
        // It goes on beyond its range.
        Law::Periodic { offset, sine, cosine, per_unit } => {
            within("numbers.per_unit", *per_unit)?;
            ("numbers", vec![offset.abs() + sine.hypot(*cosine)])
        }
        // Each of these is greatest at an end.
        law @ (Law::Linear { .. }
        | Law::Power { .. }
        | Law::Exponential { .. }
        | Law::Saturating { .. }
        | Law::Threshold { .. }
        | Law::Logarithm { .. }) => {
            ("numbers", draft.ranges[0].iter().map(|end| law.value(&[*end])).collect())
        }
    };
    values.iter().try_for_each(|value| within(key, *value))?;
    let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    draft.weights.iter().flatten().try_for_each(|weight| within("weights", weight * most))
}

/// Checks a share of what was left that a draft closes, and its standard error. A draft that makes it worse closes less than nothing.
fn check_share(field: &str, share: Option<f64>, se: Option<f64>) -> Result<(), WrongField> {
    if let Some(share) = share.filter(|share| !(share.is_finite() && *share <= 1.0)) {
        return Err(wrong(
            format!("{field}.closed_share"),
            format!("must be finite and at most 1, not {share}"),
        ));
    }
    error(&format!("{field}.closed_share_se"), se)
}

/// Checks a number that may be as large as it likes.
fn finite(field: impl Into<String>, value: f64) -> Result<(), WrongField> {
    if value.is_finite() { Ok(()) } else { Err(wrong(field, format!("must be finite, not {value}"))) }
}

/// Checks a standard error, if there is one.
fn error(field: &str, se: Option<f64>) -> Result<(), WrongField> {
    match se {
        Some(se) if !(se.is_finite() && se >= 0.0) => {
            Err(wrong(field, format!("must be finite and not negative, not {se}")))
        }
        Some(_) | None => Ok(()),
    }
}

/// Checks that a text has no control characters: it is shown on terminals.
fn plain(field: impl Into<String>, text: &str) -> Result<(), WrongField> {
    match text.chars().find(|letter| letter.is_control()) {
        Some(letter) => Err(wrong(field, format!("must have no control characters, such as {letter:?}"))),
        None => Ok(()),
    }
}

/// How many numbers of a law are fitted, and so have a covariance. The shape of a law, such as an exponent or a length, is chosen.
fn fitted_numbers(law: &Law) -> RangeInclusive<usize> {
    match law {
        Law::Linear { .. } => 1..=2,
        Law::Periodic { .. } => 2..=2,
        Law::Table { values, .. } => values.len()..=values.len(),
        Law::Power { .. }
        | Law::Exponential { .. }
        | Law::Saturating { .. }
        | Law::Threshold { .. }
        | Law::Logarithm { .. } => 1..=1,
    }
}

/// The key of a draft that is no effect, in its table: the one without which it would be an effect.
fn wrong_part(draft: &Draft) -> String {
    let is_mended = |mended: Draft| mended.check().is_ok();
    if is_mended(Draft { name: "draft".into(), ..draft.clone() }) {
        return "name".into();
    }
    if is_mended(Draft { weights: None, ..draft.clone() }) {
        return "weights".into();
    }
    for index in 0..draft.ranges.len() {
        let mut ranges = draft.ranges.clone();
        ranges[index] = [0.0, 1.0];
        if is_mended(Draft { ranges, ..draft.clone() }) {
            return format!("covariate[{index}].range");
        }
    }
    let numbers = draft.law.numbers();
    let wrong =
        numbers.iter().find(|(name, value)| !value.is_finite() || (*name == "length" && *value <= 0.0));
    match (&draft.law, wrong) {
        (_, Some((name, _))) => format!("numbers.{name}"),
        (Law::Table { .. }, None) => "values".into(),
        (_, None) => "covariate".into(),
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
