//! What a page may ask for.

use serde::Deserialize;
use serde_json::{Map, Value};
use tactus_schema::pb;

/// Name of the experiment that moves the tip to a place.
const MOVE_TO: &str = "move-to";
/// Longest name of who runs an experiment, in characters.
const WHO_CHARS_MAX: usize = 60;

/// A command that needs the lease.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Order {
    Pause,
    Resume {
        /// Confirms that the covering of this thickness is in place.
        covering_mm: Option<f64>,
    },
    Reset,
    /// Start an experiment.
    Run(pb::RunRequest),
}

/// A question that commands nothing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Question {
    Experiments,
    /// What would this run do?
    Plan(pb::RunRequest),
}

/// Body of `POST /plan` and `/run`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct RunForm {
    experiment: String,
    #[serde(default)]
    parameters: Map<String, Value>,
    /// As text: the page's numbers have 53 bits.
    #[serde(default)]
    seed: Option<String>,
    /// For the record of the run.
    #[serde(default)]
    who: String,
}

/// Body of `POST /move`: a place in the sensor frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "all are lengths in mm")]
struct MoveForm {
    x_mm: f64,
    y_mm: f64,
    /// Height above the surface, not below the safe height; the safe height without.
    height_mm: Option<f64>,
}

/// Body of `POST /resume`; may be empty.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ResumeForm {
    covering_mm: Option<f64>,
}

impl Order {
    /// The command of a path with its body; `None` if there is no such command.
    ///
    /// # Errors
    /// What is wrong with the body.
    pub(crate) fn of(name: &str, body: &[u8]) -> Option<Result<Self, String>> {
        Some(match name {
            "pause" => Ok(Self::Pause),
            "reset" => Ok(Self::Reset),
            "resume" if body.is_empty() => Ok(Self::Resume { covering_mm: None }),
            "resume" => parse(body).map(|ResumeForm { covering_mm }| Self::Resume { covering_mm }),
            "run" => run_request(body).map(Self::Run),
            "move" => parse(body).map(|place| Self::Run(move_to(place))),
            _ => return None,
        })
    }

    /// Who asks, where the page says so.
    pub(crate) fn who(&self) -> Option<&str> {
        match self {
            Self::Run(request) if !request.who.is_empty() => Some(&request.who),
            Self::Run(_) | Self::Pause | Self::Resume { .. } | Self::Reset => None,
        }
    }
}

impl Question {
    /// What the body of `POST /plan` asks.
    ///
    /// # Errors
    /// What is wrong with the body.
    pub(crate) fn plan(body: &[u8]) -> Result<Self, String> {
        run_request(body).map(Self::Plan)
    }
}

pub(crate) fn parse<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, String> {
    serde_json::from_slice(body).map_err(|error| format!("the request's body is not understood: {error}"))
}

fn run_request(body: &[u8]) -> Result<pb::RunRequest, String> {
    let RunForm { experiment, parameters, seed, who } = parse(body)?;
    // A request with no script is one for a script of the service's own.
    if experiment.is_empty() {
        return Err("the request names no experiment".into());
    }
    let seed = seed.filter(|seed| !seed.is_empty());
    let seed = seed.map(|seed| seed.parse()).transpose();
    Ok(pb::RunRequest {
        experiment,
        parameters_json: Value::Object(parameters).to_string(),
        seed: seed.map_err(|_| "the seed is a whole number from 0 to 2^64 - 1".to_owned())?,
        who: name(&who),
        ..Default::default()
    })
}

/// A person's name, for the record of a run.
pub(crate) fn name(who: &str) -> String {
    who.trim().chars().filter(|c| !c.is_control()).take(WHO_CHARS_MAX).collect()
}

fn move_to(MoveForm { x_mm, y_mm, height_mm }: MoveForm) -> pb::RunRequest {
    let mut parameters = serde_json::json!({ "x_mm": x_mm, "y_mm": y_mm });
    if let Some(height_mm) = height_mm {
        parameters["height_mm"] = height_mm.into();
    }
    pb::RunRequest {
        experiment: MOVE_TO.into(),
        parameters_json: parameters.to_string(),
        ..Default::default()
    }
}

#[cfg(test)]
#[path = "order_tests.rs"]
mod tests;
