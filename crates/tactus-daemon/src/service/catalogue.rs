//! The experiments that the service knows by name, with their parameters on this rig.

use std::path::Path;

use tactus_plan::{Evaluate, Parameter, RigView, ScriptLimits};
use tactus_runner::experiments;
use tactus_schema::{Rig, pb};

/// All of them, in the order of their names. Blocks while their top levels are evaluated.
pub(super) fn list(folder: Option<&Path>, rig: &Rig, evaluator: &dyn Evaluate) -> Vec<pb::Experiment> {
    let view = RigView::of(rig);
    experiments::names(folder).into_iter().map(|name| describe(name, folder, &view, evaluator)).collect()
}

fn describe(name: String, folder: Option<&Path>, rig: &RigView, evaluator: &dyn Evaluate) -> pb::Experiment {
    let script = match experiments::named(&name, folder) {
        Ok(script) => script,
        Err(error) => return pb::Experiment { name, error: error.to_string(), ..Default::default() },
    };
    let doc = script.doc().to_owned();
    match evaluator.parameters(&script, rig, &ScriptLimits::default(), &|| false) {
        Ok(parameters) => {
            let parameters = parameters.into_iter().map(told).collect();
            pb::Experiment { name, doc, parameters, error: String::new() }
        }
        Err(error) => pb::Experiment { name, doc, parameters: Vec::new(), error: error.to_string() },
    }
}

fn told(parameter: Parameter) -> pb::Parameter {
    let Parameter { name, kind, default, doc, unit, choices, min, max } = parameter;
    pb::Parameter {
        name,
        kind: kind.word().to_owned(),
        default_json: default.to_string(),
        doc,
        unit,
        choices_json: choices.unwrap_or_default().iter().map(ToString::to_string).collect(),
        min,
        max,
    }
}
