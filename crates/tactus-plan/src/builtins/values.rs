//! Conversion between Rust types and script values.

use serde_json::{Map, Value as Json};
use starlark::values::dict::DictRef;
use starlark::values::float::UnpackFloat;
use starlark::values::list::{AllocList, ListRef};
use starlark::values::structs::{AllocStruct, StructRef};
use starlark::values::tuple::TupleRef;
use starlark::values::{Heap, UnpackValue, Value};

use crate::{ElementView, MeanReading, RigView};

/// Most values, and bytes of texts among them, that are written into one JSON.
const JSON_SIZE_MAX: usize = 1 << 20;
/// Deepest nesting of a value that is written as JSON.
const JSON_DEPTH_MAX: usize = 32;

/// The rig, as scripts see it.
pub(crate) fn rig_value<'v>(rig: &RigView, heap: Heap<'v>) -> Value<'v> {
    let count = |number: usize| heap.alloc(i64::try_from(number).unwrap_or(i64::MAX));
    let pair = |pair: [f64; 2]| heap.alloc(AllocList(pair));
    let optional = |number: Option<f64>| number.map_or_else(Value::new_none, |number| heap.alloc(number));
    let element = |element: &ElementView| {
        heap.alloc(AllocStruct([
            ("index", count(element.index)),
            ("row", count(element.row)),
            ("col", count(element.col)),
            ("x_mm", heap.alloc(element.x_mm)),
            ("y_mm", heap.alloc(element.y_mm)),
        ]))
    };
    heap.alloc(AllocStruct([
        ("name", heap.alloc(rig.name.as_str())),
        ("simulated", heap.alloc(rig.simulated)),
        ("rows", count(rig.rows)),
        ("cols", count(rig.cols)),
        ("elements", heap.alloc(AllocList(rig.elements.iter().map(element)))),
        ("element_mm", pair(rig.element_mm)),
        ("pitch_mm", pair(rig.pitch_mm)),
        ("extent_mm", heap.alloc(AllocList(rig.extent_mm.map(pair)))),
        ("rate_hz", heap.alloc(rig.rate_hz)),
        ("full_scale_counts", heap.alloc(rig.full_scale_counts)),
        ("covering_mm", heap.alloc(rig.covering_mm)),
        ("depth_max_mm", optional(rig.depth_max_mm)),
        ("depth_share_max", optional(rig.depth_share_max)),
        ("sigma_mm", heap.alloc(rig.sigma_mm)),
        ("indenter", heap.alloc(rig.indenter.as_str())),
        ("origin_mm", pair(rig.origin_mm)),
        ("rotation_deg", heap.alloc(rig.rotation_deg)),
        ("safe_height_mm", optional(rig.safe_height_mm)),
        ("load_speed_mm_per_s", optional(rig.load_speed_mm_per_s)),
        ("load_speed_max_mm_per_s", optional(rig.load_speed_max_mm_per_s)),
    ]))
}

/// A reading, as scripts see it.
pub(super) fn reading_value<'v>(reading: &MeanReading, heap: Heap<'v>) -> Value<'v> {
    let numbers = |numbers: &[f64]| heap.alloc(AllocList(numbers.iter().copied()));
    heap.alloc(AllocStruct([
        ("counts", numbers(&reading.mean_counts)),
        ("signal", numbers(&reading.signal)),
        ("rms", numbers(&reading.rms)),
        ("frames", heap.alloc(reading.frames)),
    ]))
}

/// A script's value as JSON. A part that JSON cannot express, or that is too large or nested too deeply, is null.
pub(crate) fn to_json(value: Value<'_>) -> Json {
    let mut left = JSON_SIZE_MAX;
    json(value, 0, &mut left)
}

fn json(value: Value<'_>, depth: usize, left: &mut usize) -> Json {
    let size = 1 + value.unpack_str().map_or(0, str::len);
    if depth > JSON_DEPTH_MAX || *left < size {
        return Json::Null;
    }
    *left -= size;
    if let Some(truth) = value.unpack_bool() {
        Json::Bool(truth)
    } else if let Some(text) = value.unpack_str() {
        Json::from(text)
    } else if let Ok(Some(whole)) = i64::unpack_value(value) {
        Json::from(whole)
    } else if let Ok(Some(UnpackFloat(number))) = UnpackFloat::unpack_value(value) {
        Json::from(number)
    } else if let Some(list) = ListRef::from_value(value) {
        list.iter().map(|value| json(value, depth + 1, left)).collect()
    } else if let Some(tuple) = TupleRef::from_value(value) {
        tuple.iter().map(|value| json(value, depth + 1, left)).collect()
    } else if let Some(fields) = StructRef::from_value(value) {
        Json::Object(
            fields
                .iter()
                .map(|(name, value)| (name.as_str().to_owned(), json(value, depth + 1, left)))
                .collect(),
        )
    } else if let Some(dict) = DictRef::from_value(value) {
        let mut entries = Map::new();
        for (key, value) in dict.iter() {
            if let Some(key) = key.unpack_str() {
                entries.insert(key.to_owned(), json(value, depth + 1, left));
            }
        }
        Json::Object(entries)
    } else {
        Json::Null
    }
}

/// A parameter's value as the script sees it.
pub(super) fn from_json<'v>(value: &Json, heap: Heap<'v>) -> Value<'v> {
    match value {
        Json::Bool(truth) => heap.alloc(*truth),
        Json::String(text) => heap.alloc(text.as_str()),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => heap.alloc(whole),
            None => heap.alloc(number.as_f64().unwrap_or(f64::NAN)),
        },
        Json::Array(values) => heap.alloc(AllocList(values.iter().map(|value| from_json(value, heap)))),
        Json::Null | Json::Object(_) => Value::new_none(),
    }
}
