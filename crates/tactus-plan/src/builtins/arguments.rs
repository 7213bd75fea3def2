//! Checks of function arguments.

use starlark::values::float::UnpackFloat;
use starlark::values::list::ListRef;
use starlark::values::tuple::TupleRef;
use starlark::values::{UnpackValue, Value};

use crate::context::Halt;

/// Most depths in one press, and most values of any list of numbers.
const NUMBERS_MAX: usize = 10_000;

pub(super) fn finite(name: &str, value: f64) -> Result<f64, Halt> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Halt::Failed(format!("{name} is {value}, not a finite number")))
    }
}

pub(super) fn positive(name: &str, value: f64) -> Result<f64, Halt> {
    match finite(name, value)? {
        value if value > 0.0 => Ok(value),
        value => Err(Halt::Failed(format!("{name} is {value}, it must be greater than 0"))),
    }
}

/// A list or tuple of finite numbers, at least one.
pub(super) fn numbers(name: &str, value: Value<'_>) -> Result<Vec<f64>, Halt> {
    let wrong = |what: &str| Halt::Failed(format!("{name} must be a list of numbers, not {what}"));
    let values: Vec<Value<'_>> = match (ListRef::from_value(value), TupleRef::from_value(value)) {
        (Some(list), _) => list.iter().collect(),
        (None, Some(tuple)) => tuple.iter().collect(),
        (None, None) => return Err(wrong(value.get_type())),
    };
    match values.len() {
        0 => return Err(Halt::Failed(format!("{name} is empty"))),
        1..=NUMBERS_MAX => {}
        many => return Err(Halt::Failed(format!("{name} has {many} values, the limit is {NUMBERS_MAX}"))),
    }
    let number = |value: Value<'_>| match UnpackFloat::unpack_value(value) {
        Ok(Some(UnpackFloat(number))) => finite(name, number),
        Ok(None) | Err(_) => Err(wrong(&format!("of {}", value.get_type()))),
    };
    values.into_iter().map(number).collect()
}
