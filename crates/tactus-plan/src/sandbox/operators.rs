//! Functions that replace the operators which can make large values, and measure first.

use std::collections::HashMap;

use starlark::environment::GlobalsBuilder;
use starlark::eval::Evaluator;
use starlark::starlark_module;
use starlark::values::string::STRING_TYPE;
use starlark::values::{UnpackValue, Value};

use super::text::{Numbers, SEQUENCE_MAX, TEXT_MAX_BYTES, write_text};
use crate::context::{self, Halt};
use crate::{Exceeded, sandbox::globals::OPERATORS};

/// For the syntax tree: each guarded operator becomes a call of the function of the same name. No script can
/// name such a function, for `+` is not an identifier.
pub(super) fn replacements() -> HashMap<String, String> {
    OPERATORS.iter().map(|(_, operator)| ((*operator).to_owned(), (*operator).to_owned())).collect()
}

#[starlark_module]
pub(super) fn functions(builder: &mut GlobalsBuilder) {
    fn plus<'v>(
        #[starlark(require = pos)] a: Value<'v>,
        #[starlark(require = pos)] b: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        check_whole(a)?;
        check_whole(b)?;
        if let (Some(left), Some(right)) = (size(a), size(b)) {
            check_size(a, left.saturating_add(right))?;
        }
        context::check_heap(eval)?;
        a.add(b, eval.heap())
    }

    fn times<'v>(
        #[starlark(require = pos)] a: Value<'v>,
        #[starlark(require = pos)] b: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        check_whole(a)?;
        check_whole(b)?;
        for (repeated, times) in [(a, b), (b, a)] {
            if let (Some(size), Ok(Some(times))) = (size(repeated), i64::unpack_value(times)) {
                check_size(repeated, size.saturating_mul(u64::try_from(times).unwrap_or(0)))?;
            }
        }
        context::check_heap(eval)?;
        a.mul(b, eval.heap())
    }

    fn percent<'v>(
        #[starlark(require = pos)] a: Value<'v>,
        #[starlark(require = pos)] b: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        if a.get_type() == STRING_TYPE {
            let mut text = String::new();
            write_text(b, Numbers::Whole, &mut text).map_err(Halt::from)?;
        }
        context::check_heap(eval)?;
        a.percent(b, eval.heap())
    }

    fn union<'v>(
        #[starlark(require = pos)] a: Value<'v>,
        #[starlark(require = pos)] b: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        if let (Some(left), Some(right)) = (size(a), size(b)) {
            check_size(a, left.saturating_add(right))?;
        }
        context::check_heap(eval)?;
        a.bit_or(b, eval.heap())
    }
}

/// Bytes of a text, values of a list or another collection; `None` for the rest.
fn size(value: Value<'_>) -> Option<u64> {
    match value.unpack_str() {
        Some(text) => u64::try_from(text.len()).ok(),
        None => value.length().ok().and_then(|length| u64::try_from(length).ok()),
    }
}

fn check_size(like: Value<'_>, size: u64) -> Result<(), Halt> {
    let (what, unit, limit) = match like.get_type() {
        STRING_TYPE => ("a text", "bytes", TEXT_MAX_BYTES as u64),
        _ => ("a list", "values", SEQUENCE_MAX as u64),
    };
    if size > limit {
        Err(Exceeded::Size { what: what.into(), size, unit: unit.into(), limit }.into())
    } else {
        Ok(())
    }
}

/// Checks that a whole number fits 64 bits: repeated multiplication would let it grow without a bound.
fn check_whole(value: Value<'_>) -> Result<(), Halt> {
    if value.get_type() == "int" && !matches!(i64::unpack_value(value), Ok(Some(_))) {
        return Err(Halt::Failed("a whole number beyond 64 bits: use floats".into()));
    }
    Ok(())
}
