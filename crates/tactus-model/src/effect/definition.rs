//! Definitions of effects: name, parameters and their values.

use super::draft::Draft;
use super::knots::{FreeCurve, KNOTS_MAX, Knots, Values};
use super::table::{By, Table};
use super::{OnContact, OnCovering, OnElement, OnMotion, OnReadout, REGISTRY};
use crate::Array;
use crate::trace::Covariate;

/// An effect's name, parameters and relations. Its equation and source are in its file.
#[derive(Debug)]
pub struct Definition {
    /// The name in reports and model files: a contract.
    pub name: &'static str,
    /// Summary, as half a sentence.
    pub summary: &'static str,
    /// Its parameters, in the order in which their values are listed.
    pub parameters: &'static [Parameter],
    /// Effects, and base parameters by their names in the model file, that look alike in much of the data.
    pub near_twins: &'static [&'static str],
    /// Covariates by which it shows: a draft by one of them may be another form of it.
    pub acts_by: &'static [Covariate],
    /// Experiments, or parts of `diagnose`, that show it.
    pub shown_by: &'static [&'static str],
    /// The free curve that may stand in place of its formula, if there is one.
    pub curve: Option<FreeCurve>,
    /// Creates the effect's object at its stage from its values.
    pub make: Make,
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The name, its unit last.
    pub name: &'static str,
    /// With all parameters at these values the effect changes nothing.
    pub neutral: f64,
    /// Least and greatest value.
    pub range: [f64; 2],
    /// What kind of number it is.
    pub kind: ParameterKind,
    /// True if it is neutral where no value is given.
    pub is_optional: bool,
    /// What it may be a table of, in place of one value.
    pub varies: &'static [By],
    /// True if fits leave it neutral unless they start from another value: one of several places or directions, of which a rig has hardly
    /// more than one.
    pub is_apart: bool,
}

/// Kinds of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// A real number.
    Real,
    /// Index of an element; no fit varies it, and it has no meaning on another array.
    Element,
    /// Index of an element, or -1 for all elements, the default.
    ElementOrAll,
    /// A number that no fit varies; neutral by default.
    Given,
}

/// Where in the pipeline an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names say it")]
pub enum PipelineStage {
    Motion,
    Contact,
    Covering,
    Element,
    Readout,
}

/// Creates an effect's object at its stage from its values.
#[derive(Debug, Clone, Copy)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Make {
    Motion(fn(&Values) -> Box<dyn OnMotion>),
    Contact(fn(&Values) -> Box<dyn OnContact>),
    Covering(fn(&Values) -> Box<dyn OnCovering>),
    Element(fn(&Values) -> Box<dyn OnElement>),
    Readout(fn(&Values) -> Box<dyn OnReadout>),
    Draft(&'static Draft),
}

/// A definition with a value or a table for each parameter, within its range; or with knots in place of its formula.
#[derive(Debug, Clone)]
pub struct Effect {
    definition: &'static Definition,
    values: Values,
}

/// Why a name and parameters do not make an effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum EffectError {
    /// No effect of this name.
    #[error("no effect {name:?}; there is: {}", names(REGISTRY.iter().map(|known| known.name)))]
    Unknown { name: String },
    /// A parameter has no value.
    #[error("{effect}: {parameter} is missing")]
    Missing { effect: &'static str, parameter: &'static str },
    /// The effect has no such parameter.
    #[error("{effect}: no parameter {parameter:?}; there is: {known}")]
    NoParameter { effect: &'static str, parameter: String, known: String },
    /// A parameter is given twice.
    #[error("{effect}: {parameter} is given twice")]
    Twice { effect: &'static str, parameter: &'static str },
    /// A value is out of its range.
    #[error("{effect}: {parameter} must lie from {} to {}, not at {value}", range[0], range[1])]
    Range { effect: &'static str, parameter: &'static str, range: [f64; 2], value: f64 },
    /// Knots for an effect that has its formula only.
    #[error("{effect}: has no knots, only its parameters")]
    NoKnots { effect: &'static str },
    /// A parameter is given beside knots that replace it.
    #[error("{effect}: {parameter} is replaced by the knots; leave it out")]
    Replaced { effect: &'static str, parameter: &'static str },
    /// Places and values are not as many.
    #[error("{effect}: knots must be 1 to {KNOTS_MAX}, with as many {of} as {at}, not {values} and {places}")]
    KnotsNumber { effect: &'static str, at: &'static str, of: &'static str, places: usize, values: usize },
    /// A place or a value of the knots breaks the rules of the effect's curve.
    #[error("{effect}: knots.{key}[{index}] must be {want}, not {value}")]
    Knot { effect: &'static str, key: &'static str, index: usize, value: f64, want: String },
    /// A table for a parameter that has one value everywhere.
    #[error("{effect}: {parameter} is no table of {by}{}", allowed(varies))]
    NoTable { effect: &'static str, parameter: String, by: &'static str, varies: &'static [By] },
    /// A parameter is given beside its table.
    #[error("{effect}: {parameter} is replaced by its table; leave it out")]
    Tabled { effect: &'static str, parameter: &'static str },
    /// A table breaks its rules.
    #[error("{effect}: the table of {parameter} {want}")]
    Table { effect: &'static str, parameter: &'static str, want: String },
    /// An index is not that of an element of the array.
    #[error("{effect}: {parameter} must be one of the elements 0 to {last}, not {value}")]
    Element { effect: &'static str, parameter: &'static str, last: usize, value: f64 },
    /// A draft is no effect.
    #[error("draft {name:?}: {want}")]
    Draft { name: String, want: String },
}

impl Definition {
    /// The effect of this name in the [`REGISTRY`].
    ///
    /// # Errors
    /// [`EffectError::Unknown`] lists those that there are.
    pub fn find(name: &str) -> Result<&'static Self, EffectError> {
        let found = REGISTRY.iter().find(|known| known.name == name);
        found.copied().ok_or_else(|| EffectError::Unknown { name: name.into() })
    }

    /// Where it acts.
    pub fn stage(&self) -> PipelineStage {
        match self.make {
            Make::Motion(_) => PipelineStage::Motion,
            Make::Contact(_) => PipelineStage::Contact,
            Make::Covering(_) => PipelineStage::Covering,
            Make::Element(_) => PipelineStage::Element,
            Make::Readout(_) => PipelineStage::Readout,
            Make::Draft(draft) => draft.stage(),
        }
    }

    /// The draft that it is made from; `None` for an effect with a name of its own.
    pub fn draft(&self) -> Option<&'static Draft> {
        if let Make::Draft(draft) = self.make { Some(draft) } else { None }
    }

    /// True if knots in place of the formula replace a parameter.
    pub fn replaces(&self, parameter: &str) -> bool {
        self.curve.as_ref().is_some_and(|curve| curve.replaces.contains(&parameter))
    }

    fn index_of(&self, parameter: &str) -> Result<usize, EffectError> {
        self.parameters.iter().position(|one| one.name == parameter).ok_or_else(|| EffectError::NoParameter {
            effect: self.name,
            parameter: parameter.into(),
            known: names(self.parameters.iter().map(|one| one.name)),
        })
    }

    fn check(&self, parameter: &Parameter, value: f64) -> Result<f64, EffectError> {
        let Parameter { name, range, .. } = *parameter;
        if (range[0]..=range[1]).contains(&value) {
            Ok(value)
        } else {
            Err(EffectError::Range { effect: self.name, parameter: name, range, value })
        }
    }
}

impl Parameter {
    /// Greatest number of counts. Any value is allowed in effect: what a count is, differs from sensor to sensor.
    pub const COUNTS_MAX: f64 = 1e12;

    /// A real number of counts.
    pub const fn counts(name: &'static str) -> Self {
        Self::real(name, 0.0, [-Self::COUNTS_MAX, Self::COUNTS_MAX])
    }

    /// True if it is a number of counts: its range says nothing about what is much or little.
    pub fn is_counts(&self) -> bool {
        self.range[1].to_bits() == Self::COUNTS_MAX.to_bits()
    }

    /// Its range in words.
    pub fn range_in_words(&self) -> String {
        let [least, most] = self.range;
        match (self.is_counts(), least < 0.0) {
            (true, true) => "any".to_owned(),
            (true, false) => format!("{least} or more"),
            (false, _) => format!("{least} to {most}"),
        }
    }

    /// A real number within a range.
    pub const fn real(name: &'static str, neutral: f64, range: [f64; 2]) -> Self {
        Self {
            name,
            neutral,
            range,
            kind: ParameterKind::Real,
            is_optional: false,
            varies: &[],
            is_apart: false,
        }
    }

    /// The same parameter as optional. Parameters that an effect has had since its first version are not optional.
    #[must_use]
    pub const fn or_neutral(self) -> Self {
        Self { is_optional: true, ..self }
    }

    /// The same parameter as optional, which fits leave neutral unless they start from another value.
    #[must_use]
    pub const fn apart(self) -> Self {
        Self { is_optional: true, is_apart: true, ..self }
    }

    /// The same parameter, which may also be a table. Only parameters of stages without memory before the elements can be.
    #[must_use]
    pub const fn or_table_of(self, varies: &'static [By]) -> Self {
        Self { varies, ..self }
    }

    /// Index of an element.
    pub const fn element(name: &'static str) -> Self {
        Self {
            name,
            neutral: 0.0,
            range: [0.0, u32::MAX as f64],
            kind: ParameterKind::Element,
            is_optional: false,
            varies: &[],
            is_apart: false,
        }
    }

    /// Index of an element, or -1 for all of them.
    pub const fn element_or_all(name: &'static str) -> Self {
        Self {
            name,
            neutral: -1.0,
            range: [-1.0, u32::MAX as f64],
            kind: ParameterKind::ElementOrAll,
            is_optional: true,
            varies: &[],
            is_apart: false,
        }
    }

    /// A number within a range that no fit varies.
    pub const fn given(name: &'static str, neutral: f64, range: [f64; 2]) -> Self {
        Self {
            name,
            neutral,
            range,
            kind: ParameterKind::Given,
            is_optional: true,
            varies: &[],
            is_apart: false,
        }
    }

    /// True if a value is the index of an element.
    fn names_element(&self, value: f64) -> bool {
        self.kind == ParameterKind::Element
            || self.kind == ParameterKind::ElementOrAll && value.to_bits() != self.neutral.to_bits()
    }
}

impl Effect {
    /// The effect of a name in the [`REGISTRY`], with a value for each parameter, in any order; those that are
    /// [`Parameter::is_optional`] may be left out.
    ///
    /// # Errors
    /// [`EffectError`] says what is unknown, missing or out of range.
    pub fn new<'a>(
        name: &str,
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<Self, EffectError> {
        Self::of(Definition::find(name)?, parameters)
    }

    /// An effect of any definition, with a value for each parameter, in any order.
    ///
    /// # Errors
    /// As [`Effect::new`].
    pub fn of<'a>(
        definition: &'static Definition,
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<Self, EffectError> {
        Self::checked(definition, parameters, None, Vec::new())
    }

    /// An effect with knots in place of its formula, and a value for each parameter that they do not replace.
    ///
    /// # Errors
    /// As [`Effect::new`]; [`EffectError::NoKnots`], [`EffectError::Replaced`], [`EffectError::KnotsNumber`] and [`EffectError::Knot`].
    pub fn of_knots<'a>(
        definition: &'static Definition,
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
        knots: Knots,
    ) -> Result<Self, EffectError> {
        Self::checked(definition, parameters, Some(knots), Vec::new())
    }

    /// The same effect with a table in place of a parameter's value.
    ///
    /// # Errors
    /// [`EffectError::NoParameter`], [`EffectError::NoTable`] and [`EffectError::Table`].
    pub fn with_table(&self, parameter: &str, table: Table) -> Result<Self, EffectError> {
        let Values { knots, mut tables, .. } = self.values.clone();
        let index = self.definition.index_of(parameter)?;
        tables.retain(|(of, _)| *of != index);
        tables.push((index, table));
        let parameters = self.parameters().filter(|(name, _)| *name != parameter);
        Self::checked(self.definition, parameters, knots, tables)
    }

    /// An effect with a value or a table for each parameter, or with knots in place of its formula; tables by the names of parameters.
    ///
    /// # Errors
    /// As [`Effect::new`], [`Effect::of_knots`] and [`Effect::with_table`]; [`EffectError::Tabled`].
    pub fn with_tables<'a>(
        definition: &'static Definition,
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
        knots: Option<Knots>,
        tables: impl IntoIterator<Item = (&'a str, Table)>,
    ) -> Result<Self, EffectError> {
        let index = |(name, table)| Ok((definition.index_of(name)?, table));
        let tables = tables.into_iter().map(index).collect::<Result<_, EffectError>>()?;
        Self::checked(definition, parameters, knots, tables)
    }

    fn checked<'a>(
        definition: &'static Definition,
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
        knots: Option<Knots>,
        mut tables: Vec<(usize, Table)>,
    ) -> Result<Self, EffectError> {
        let effect = definition.name;
        tables.sort_by_key(|(of, _)| *of);
        if let Some(knots) = &knots {
            knots.check(effect, definition.curve.as_ref().ok_or(EffectError::NoKnots { effect })?)?;
        }
        for (parameter, table) in &tables {
            table.check(effect, &definition.parameters[*parameter])?;
        }
        let is_replaced = |parameter: &Parameter| knots.is_some() && definition.replaces(parameter.name);
        let is_tabled = |index: usize| tables.iter().any(|(of, _)| *of == index);
        let mut given = vec![None; definition.parameters.len()];
        for (name, value) in parameters {
            let index = definition.index_of(name)?;
            let parameter = &definition.parameters[index];
            if is_tabled(index) {
                return Err(EffectError::Tabled { effect, parameter: parameter.name });
            }
            if is_replaced(parameter) {
                return Err(EffectError::Replaced { effect, parameter: parameter.name });
            }
            if given[index].replace(value).is_some() {
                return Err(EffectError::Twice { effect, parameter: parameter.name });
            }
        }
        let value = |(index, value): (usize, Option<f64>)| {
            let parameter = &definition.parameters[index];
            match value {
                Some(value) => definition.check(parameter, value),
                None if parameter.is_optional || is_replaced(parameter) || is_tabled(index) => {
                    Ok(parameter.neutral)
                }
                None => Err(EffectError::Missing { effect, parameter: parameter.name }),
            }
        };
        let values = given.into_iter().enumerate().map(value).collect::<Result<_, _>>()?;
        Ok(Self { definition, values: Values { parameters: values, knots, tables } })
    }

    /// The effect that changes nothing.
    pub fn neutral(definition: &'static Definition) -> Self {
        let parameters = definition.parameters.iter().map(|one| one.neutral).collect();
        Self { definition, values: Values { parameters, knots: None, tables: Vec::new() } }
    }

    /// The same effect with another value of one parameter.
    ///
    /// # Errors
    /// [`EffectError::NoParameter`], [`EffectError::Range`] and [`EffectError::Replaced`].
    pub fn with(&self, parameter: &str, value: f64) -> Result<Self, EffectError> {
        let replaced = |(name, old)| (name, if name == parameter { value } else { old });
        let unknown = self.parameters().all(|(name, _)| name != parameter).then_some((parameter, value));
        let Values { knots, tables, .. } = self.values.clone();
        Self::checked(self.definition, self.parameters().map(replaced).chain(unknown), knots, tables)
    }

    /// What it is.
    pub fn definition(&self) -> &'static Definition {
        self.definition
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.definition.name
    }

    /// Its parameters with their values, less those that knots or tables replace.
    pub fn parameters(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let all = self.definition.parameters.iter().zip(self.values.iter().copied()).enumerate();
        all.filter_map(|(index, (parameter, value))| {
            let is_replaced = self.knots().is_some() && self.definition.replaces(parameter.name)
                || self.values.tables.iter().any(|(of, _)| *of == index);
            (!is_replaced).then_some((parameter.name, value))
        })
    }

    /// Its parameters that are tables.
    pub fn tables(&self) -> impl Iterator<Item = (&'static str, &Table)> {
        self.values
            .tables
            .iter()
            .map(|(parameter, table)| (self.definition.parameters[*parameter].name, table))
    }

    /// The knots in place of its formula; `None` if it has its formula.
    pub fn knots(&self) -> Option<&Knots> {
        self.values.knots()
    }

    /// A parameter's value; `None` if there is no such parameter, or if knots or a table replace it.
    pub fn value(&self, parameter: &str) -> Option<f64> {
        self.parameters().find(|(name, _)| *name == parameter).map(|(_, value)| value)
    }

    /// True if it names elements, and so belongs to one array.
    pub fn names_elements(&self) -> bool {
        if self.definition.draft().is_some_and(|draft| draft.weights.is_some()) {
            return true;
        }
        let mut parameters = self.definition.parameters.iter().zip(self.values.iter());
        parameters.any(|(parameter, value)| parameter.names_element(*value))
    }

    /// True if it acts before the signal that reaches the elements is known: on motion, contact or spread.
    pub fn acts_before_signal(&self) -> bool {
        match self.definition.make {
            Make::Motion(_) | Make::Contact(_) => true,
            Make::Covering(make) => make(&self.values).spreads(),
            Make::Element(_) | Make::Readout(_) => false,
            Make::Draft(draft) => draft.stage() == PipelineStage::Motion,
        }
    }

    /// Checks that the elements it names are the array's.
    ///
    /// # Errors
    /// [`EffectError::Element`], or [`EffectError::Draft`] of a draft with weights for another number of elements.
    pub fn fits(&self, array: &Array) -> Result<(), EffectError> {
        if let Some(draft) = self.definition.draft() {
            draft.fits(array)?;
        }
        let last = array.elements() - 1;
        for (parameter, &value) in self.definition.parameters.iter().zip(self.values.iter()) {
            let is_element = value.fract() == 0.0 && (0.0..=last as f64).contains(&value);
            if parameter.names_element(value) && !is_element {
                let (effect, parameter) = (self.name(), parameter.name);
                return Err(EffectError::Element { effect, parameter, last, value });
            }
        }
        Ok(())
    }

    /// What its object is made from.
    pub(crate) fn values(&self) -> &Values {
        &self.values
    }
}

impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.definition, other.definition) && self.values == other.values
    }
}

/// What a parameter may be a table of, for a message.
fn allowed(varies: &[By]) -> String {
    if varies.is_empty() {
        ", only a value".into()
    } else {
        format!("; it may be one of {}", names(varies.iter().map(|by| by.name())))
    }
}

fn names(names: impl Iterator<Item = &'static str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
#[path = "definition_tests.rs"]
mod tests;
