//! Converts values to text of bounded length. The evaluator's own `str` repeats shared parts without a bound.

use starlark::values::dict::DictRef;
use starlark::values::float::UnpackFloat;
use starlark::values::list::ListRef;
use starlark::values::structs::StructRef;
use starlark::values::tuple::TupleRef;
use starlark::values::{UnpackValue, Value};

use crate::Exceeded;

/// Longest text that an operator, `str` or `log` makes.
pub(crate) const TEXT_MAX_BYTES: usize = 64 << 10;
/// Longest list that an operator or `range` makes.
pub(crate) const SEQUENCE_MAX: usize = 100_000;
/// Deepest nesting of a value that is written out.
const DEPTH_MAX: usize = 32;

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Numbers {
    /// With all their digits.
    Whole,
    /// Rounded to a millionth, for people.
    Rounded,
}

/// Appends a value as text: a text as it is, the rest as it would stand in a script.
pub(crate) fn write_text(value: Value<'_>, numbers: Numbers, out: &mut String) -> Result<(), Exceeded> {
    match value.unpack_str() {
        Some(text) => push(out, text),
        None => write(value, numbers, 0, out),
    }
}

fn write(value: Value<'_>, numbers: Numbers, depth: usize, out: &mut String) -> Result<(), Exceeded> {
    if depth > DEPTH_MAX {
        return push(out, "...");
    }
    if let Some(text) = value.unpack_str() {
        // Escapes take up to ten bytes a character; measured before they are made.
        push_measured(out, text.len(), || format!("{text:?}"))
    } else if let Some(list) = ListRef::from_value(value) {
        write_all(["[", "]"], list.iter(), numbers, depth, out)
    } else if let Some(tuple) = TupleRef::from_value(value) {
        write_all(["(", ")"], tuple.iter(), numbers, depth, out)
    } else if let Some(dict) = DictRef::from_value(value) {
        push(out, "{")?;
        for (index, (key, value)) in dict.iter().enumerate() {
            push(out, if index == 0 { "" } else { ", " })?;
            write(key, numbers, depth + 1, out)?;
            push(out, ": ")?;
            write(value, numbers, depth + 1, out)?;
        }
        push(out, "}")
    } else if let Some(fields) = StructRef::from_value(value) {
        push(out, "struct(")?;
        for (index, (name, value)) in fields.iter().enumerate() {
            push(out, if index == 0 { "" } else { ", " })?;
            push(out, name.as_str())?;
            push(out, "=")?;
            write(value, numbers, depth + 1, out)?;
        }
        push(out, ")")
    } else {
        write_plain(value, numbers, out)
    }
}

fn write_all<'v>(
    [open, close]: [&str; 2],
    values: impl Iterator<Item = Value<'v>>,
    numbers: Numbers,
    depth: usize,
    out: &mut String,
) -> Result<(), Exceeded> {
    push(out, open)?;
    for (index, value) in values.enumerate() {
        push(out, if index == 0 { "" } else { ", " })?;
        write(value, numbers, depth + 1, out)?;
    }
    push(out, close)
}

fn write_plain(value: Value<'_>, numbers: Numbers, out: &mut String) -> Result<(), Exceeded> {
    match value.get_type() {
        "float" if numbers == Numbers::Rounded => {
            let number = UnpackFloat::unpack_value(value)
                .ok()
                .flatten()
                .map_or(f64::NAN, |UnpackFloat(number)| number);
            let rounded = (number * 1e6).round() / 1e6;
            let kept = if number.abs() < 1e9 && (rounded != 0.0 || number == 0.0) { rounded } else { number };
            push(out, &kept.to_string())
        }
        "float" | "int" | "bool" | "NoneType" | "range" => push(out, &value.to_repr()),
        other => push(out, &format!("<{other}>")),
    }
}

fn push(out: &mut String, text: &str) -> Result<(), Exceeded> {
    push_measured(out, text.len(), || text)
}

fn push_measured<T: AsRef<str>>(
    out: &mut String,
    length: usize,
    text: impl FnOnce() -> T,
) -> Result<(), Exceeded> {
    let size = out.len() + length;
    if size > TEXT_MAX_BYTES {
        let (size, limit) = (size as u64, TEXT_MAX_BYTES as u64);
        return Err(Exceeded::Size { what: "a text".into(), size, unit: "bytes".into(), limit });
    }
    out.push_str(text().as_ref());
    Ok(())
}
