//! Values that somebody chose for a script's parameters.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::script::resolve;
use crate::{Parameter, RigView, Script, ScriptError, ScriptLimits, json_text};

/// Values by parameter name: those that differ from the defaults, or all of them once resolved.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Arguments(BTreeMap<String, Given>);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Given {
    Json(#[serde(with = "json_text")] Value),
    /// As typed by a person; the parameter's type decides how it is parsed.
    Text(String),
}

impl Arguments {
    /// Reads a JSON object, such as `{"depths_mm": [0.2, 0.3]}`; a blank text is no arguments.
    ///
    /// # Errors
    /// [`ScriptError::Malformed`] if it is not a JSON object.
    pub fn from_json(text: &str) -> Result<Self, ScriptError> {
        if text.trim().is_empty() {
            return Ok(Self::default());
        }
        let values: Map<String, Value> = serde_json::from_str(text).map_err(|error| {
            ScriptError::Malformed(format!("the arguments are not a JSON object: {error}"))
        })?;
        Ok(values.into_iter().collect())
    }

    /// Adds one value written as `name=value`: JSON after the sign, or a bare text where a text is wanted.
    /// A later value replaces an earlier one of the same name.
    ///
    /// # Errors
    /// [`ScriptError::Malformed`] without a name or a sign.
    pub fn set(&mut self, assignment: &str) -> Result<(), ScriptError> {
        match assignment.split_once('=') {
            Some((name, value)) if !name.trim().is_empty() => {
                self.0.insert(name.trim().to_owned(), Given::Text(value.trim().to_owned()));
                Ok(())
            }
            _ => {
                Err(ScriptError::Malformed(format!("{assignment:?} is not name=value, such as dwell_s=0.5")))
            }
        }
    }

    /// All the values that the script would see: these, checked, and the defaults of the others.
    ///
    /// # Errors
    /// [`ScriptError::Argument`] names a parameter that does not exist (and those that do), or whose value has
    /// the wrong type or is out of range; other errors if the script's top level fails.
    pub fn resolve(&self, script: &Script, rig: &RigView) -> Result<Self, ScriptError> {
        resolve(script, self, rig, &ScriptLimits::default(), &|| false)
    }

    /// A JSON object with the values in the order of their names.
    pub fn to_json(&self) -> String {
        let value = |given: &Given| match given {
            Given::Json(value) => value.clone(),
            Given::Text(text) => serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.clone())),
        };
        let values: Map<_, _> = self.0.iter().map(|(name, given)| (name.clone(), value(given))).collect();
        Value::Object(values).to_string()
    }

    /// The names that have a value.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// True if no parameter has a value.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The value for a parameter: the one given, checked, or the default.
    pub(crate) fn value_for(&self, parameter: &Parameter) -> Result<Value, String> {
        match self.0.get(&parameter.name) {
            None => Ok(parameter.default.clone()),
            Some(Given::Json(value)) => parameter.accept(value),
            Some(Given::Text(text)) => parameter.accept_text(text),
        }
    }

    /// An error if there is a value for a parameter that the script does not declare.
    pub(crate) fn check_names(&self, parameters: &[Parameter]) -> Result<(), String> {
        let known = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
        let Some(name) = self.names().find(|name| !known(name)) else { return Ok(()) };
        let names: Vec<_> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        let existing = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        Err(format!("there is no parameter {name:?}; there is: {existing}"))
    }
}

impl FromIterator<(String, Value)> for Arguments {
    fn from_iter<I: IntoIterator<Item = (String, Value)>>(values: I) -> Self {
        Self(values.into_iter().map(|(name, value)| (name, Given::Json(value))).collect())
    }
}

#[cfg(test)]
#[path = "arguments_tests.rs"]
mod tests;
