//! One number for all elements, or one each.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::{WrongField, finite, wrong};

/// One number for all elements, or one each, row-major.
///
/// Deserialised by hand: an untagged enum cannot read numbers if any crate of the program enables `serde_json`'s feature
/// `arbitrary_precision`, which represents a number as a map.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum OneOrEach {
    One(f64),
    Each(Vec<f64>),
}

impl OneOrEach {
    /// One number if all are the same to the bit.
    pub(crate) fn of(values: &[f64]) -> Self {
        match values {
            [first, rest @ ..] if rest.iter().all(|value| value.to_bits() == first.to_bits()) => {
                Self::One(*first)
            }
            _ => Self::Each(values.to_vec()),
        }
    }

    pub(crate) fn check(self, field: &str, elements: usize) -> Result<Vec<f64>, WrongField> {
        let values = match self {
            Self::One(value) => vec![value; elements],
            Self::Each(values) => values,
        };
        if values.len() != elements {
            return Err(wrong(field, format!("{} values for {elements} elements", values.len())));
        }
        for (index, value) in values.iter().enumerate() {
            finite(format!("{field}[{index}]"), *value)?;
        }
        Ok(values)
    }
}

impl<'de> Deserialize<'de> for OneOrEach {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberOrList)
    }
}

struct NumberOrList;

impl<'de> Visitor<'de> for NumberOrList {
    type Value = OneOrEach;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number for all elements, or a list with one for each")
    }

    fn visit_f64<E>(self, value: f64) -> Result<OneOrEach, E> {
        Ok(OneOrEach::One(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<OneOrEach, E> {
        Ok(OneOrEach::One(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<OneOrEach, E> {
        Ok(OneOrEach::One(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrEach, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(OneOrEach::Each)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<OneOrEach, A::Error> {
        let number = serde_json::Number::deserialize(MapAccessDeserializer::new(map))?;
        number.as_f64().map(OneOrEach::One).ok_or_else(|| A::Error::custom("a number out of range"))
    }
}
