//! Parameters of a script: declared by `param(...)`, checked here.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// One declared parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Type of its values, taken from the default.
    pub kind: ParameterType,
    /// Value if no other is given.
    pub default: Value,
    /// Meaning, for a person.
    pub doc: String,
    /// Unit of the value or of each value of the list.
    pub unit: Option<String>,
    /// The only values allowed, or those of each value of the list; any if `None`.
    pub choices: Option<Vec<Value>>,
    /// Least value allowed, or of each value of the list.
    pub min: Option<f64>,
    /// Greatest value allowed, or of each value of the list.
    pub max: Option<f64>,
}

/// Type of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterType {
    /// `true` or `false`.
    Bool,
    /// Whole number of 64 bits.
    Int,
    /// Finite number.
    Float,
    /// Text.
    String,
    /// At least one whole number.
    ListOfInt,
    /// At least one finite number.
    ListOfFloat,
}

impl fmt::Display for ParameterType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bool => "true or false",
            Self::Int => "a whole number",
            Self::Float => "a number",
            Self::String => "a text",
            Self::ListOfInt => "a list of whole numbers",
            Self::ListOfFloat => "a list of numbers",
        })
    }
}

impl ParameterType {
    /// The type's word, as in JSON.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Int => "int",
            Self::Float => "float",
            Self::String => "string",
            Self::ListOfInt => "list-of-int",
            Self::ListOfFloat => "list-of-float",
        }
    }
}

impl Parameter {
    /// Checks a declaration; the default must itself be allowed.
    pub(crate) fn declare(mut self) -> Result<Self, String> {
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if self.name.is_empty() || !self.name.chars().all(is_name) {
            return Err(format!(
                "the parameter's name {:?} may hold letters, digits and '_' only",
                self.name
            ));
        }
        let default = self.accept(&self.default);
        self.default = default.map_err(|problem| format!("the default of {problem}"))?;
        Ok(self)
    }

    /// The value in the parameter's own type, if it is allowed.
    pub(crate) fn accept(&self, value: &Value) -> Result<Value, String> {
        match self.kind {
            ParameterType::Bool | ParameterType::Int | ParameterType::Float | ParameterType::String => {
                self.accept_one(value)
            }
            ParameterType::ListOfInt | ParameterType::ListOfFloat => match value {
                Value::Array(values) if !values.is_empty() => values
                    .iter()
                    .map(|value| self.accept_one(value))
                    .collect::<Result<_, _>>()
                    .map(Value::Array),
                Value::Array(_) => Err(format!("{} needs at least one value", self.name)),
                Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) | Value::Object(_) => {
                    Err(self.mistyped(value))
                }
            },
        }
    }

    /// Parses a value from text: JSON, or the text itself for a text parameter.
    pub(crate) fn accept_text(&self, text: &str) -> Result<Value, String> {
        match (self.kind, serde_json::from_str::<Value>(text)) {
            (ParameterType::String, Ok(value @ Value::String(_))) => self.accept(&value),
            (ParameterType::String, _) => self.accept(&Value::String(text.to_owned())),
            (_, Ok(value)) => self.accept(&value),
            (_, Err(_)) => Err(self.mistyped(&Value::String(text.to_owned()))),
        }
    }

    fn accept_one(&self, value: &Value) -> Result<Value, String> {
        let value = self.typed(value).ok_or_else(|| self.mistyped(value))?;
        let Self { name, unit, .. } = self;
        let unit = unit.as_deref().map(|unit| format!(" {unit}")).unwrap_or_default();
        if let Some(choices) = self.choices.as_ref().filter(|choices| !choices.contains(&value)) {
            let choices: Vec<_> = choices.iter().map(Value::to_string).collect();
            return Err(format!("{name} is {value}, not one of {}", choices.join(", ")));
        }
        match (value.as_f64(), self.min, self.max) {
            (Some(number), Some(min), _) if number < min => {
                Err(format!("{name} is {value}{unit}, the least is {min}{unit}"))
            }
            (Some(number), _, Some(max)) if number > max => {
                Err(format!("{name} is {value}{unit}, the greatest is {max}{unit}"))
            }
            _ => Ok(value),
        }
    }

    fn typed(&self, value: &Value) -> Option<Value> {
        match self.kind {
            ParameterType::Bool => value.as_bool().map(Value::from),
            ParameterType::Int | ParameterType::ListOfInt => value.as_i64().map(Value::from),
            ParameterType::Float | ParameterType::ListOfFloat => {
                value.as_f64().filter(|number| number.is_finite()).map(Value::from)
            }
            ParameterType::String => value.as_str().map(Value::from),
        }
    }

    fn mistyped(&self, value: &Value) -> String {
        format!("{} is {value}, not {}", self.name, self.kind)
    }
}

impl ParameterType {
    /// The type of values like this one.
    pub(crate) fn of(value: &Value) -> Result<Self, &'static str> {
        match value {
            Value::Bool(_) => Ok(Self::Bool),
            Value::Number(number) if number.is_i64() => Ok(Self::Int),
            Value::Number(_) => Ok(Self::Float),
            Value::String(_) => Ok(Self::String),
            Value::Array(values) if values.is_empty() => {
                Err("a parameter's default list needs at least one value")
            }
            Value::Array(values) if values.iter().all(Value::is_i64) => Ok(Self::ListOfInt),
            Value::Array(values) if values.iter().all(Value::is_number) => Ok(Self::ListOfFloat),
            Value::Null | Value::Array(_) | Value::Object(_) => {
                Err("a parameter's default is a number, a text, True or False, or a list of numbers")
            }
        }
    }
}

#[cfg(test)]
#[path = "parameter_tests.rs"]
mod tests;
