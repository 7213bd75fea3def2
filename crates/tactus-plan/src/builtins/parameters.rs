//! Declaring parameters.
#![expect(clippy::too_many_arguments, reason = "`param` is called with names")]

use serde_json::Value as Json;
use starlark::environment::GlobalsBuilder;
use starlark::eval::Evaluator;
use starlark::starlark_module;
use starlark::values::Value;
use starlark::values::float::UnpackFloat;
use starlark::values::list::UnpackList;
use starlark::values::none::NoneOr;

use super::arguments::finite;
use super::values::{from_json, to_json};
use crate::Parameter;
use crate::context::{self, Halt};
use crate::parameter::ParameterType;

#[starlark_module]
pub(super) fn functions(builder: &mut GlobalsBuilder) {
    /// Declares a parameter and gives its value: what the run was asked for, or the default.
    ///
    /// The default also tells the type: a number, a whole number, a text, True or False, or a list of numbers.
    /// `choices`, `min` and `max` bound the value, or each value of a list.
    fn param<'v>(
        name: &str,
        default: Value<'v>,
        #[starlark(default = "")] doc: &str,
        #[starlark(default = NoneOr::None)] unit: NoneOr<&'v str>,
        #[starlark(default = NoneOr::None)] choices: NoneOr<UnpackList<Value<'v>>>,
        #[starlark(default = NoneOr::None)] min: NoneOr<UnpackFloat>,
        #[starlark(default = NoneOr::None)] max: NoneOr<UnpackFloat>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        let default = to_json(default);
        let kind = ParameterType::of(&default).map_err(|problem| Halt::Failed(problem.into()))?;
        let bound = |name, bound: NoneOr<UnpackFloat>| {
            bound.into_option().map(|UnpackFloat(bound)| finite(name, bound)).transpose()
        };
        let declared = Parameter {
            name: name.to_owned(),
            kind,
            default,
            doc: doc.to_owned(),
            unit: unit.into_option().map(str::to_owned),
            choices: choices.into_option().map(|choices| choices_of(kind, choices.items)),
            min: bound("min", min)?,
            max: bound("max", max)?,
        };
        let value = context::current()?.declare(declared)?;
        Ok(from_json(&value, eval.heap()))
    }
}

/// The choices in the parameter's own type, so that 1 and 1.0 are the same float.
fn choices_of(kind: ParameterType, choices: Vec<Value<'_>>) -> Vec<Json> {
    let float = |choice: Json| choice.as_f64().map_or(choice, Json::from);
    let choices = choices.into_iter().map(to_json);
    match kind {
        ParameterType::Float | ParameterType::ListOfFloat => choices.map(float).collect(),
        ParameterType::Bool | ParameterType::Int | ParameterType::String | ParameterType::ListOfInt => {
            choices.collect()
        }
    }
}
