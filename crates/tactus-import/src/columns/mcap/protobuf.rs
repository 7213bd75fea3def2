//! Messages in protobuf, by the descriptors that the file has.

use prost_reflect::{DescriptorPool, DynamicMessage, MapKey, MessageDescriptor, ReflectMessage as _, Value};

use super::{Cell, LIST_MAX, Take, below};

/// Has a second and its nanoseconds.
const TIMESTAMP: &str = "google.protobuf.Timestamp";

/// Decodes messages of one kind.
pub(super) struct Decoder(MessageDescriptor);

impl Decoder {
    /// From a `FileDescriptorSet`.
    pub(super) fn of(name: &str, descriptors: &[u8]) -> Result<Self, String> {
        let pool =
            DescriptorPool::decode(descriptors).map_err(|error| format!("the schema of {name}: {error}"))?;
        let message = pool.get_message_by_name(name);
        message.map(Self).ok_or_else(|| format!("the schema does not describe {name}"))
    }

    pub(super) fn decode(&self, data: &[u8], take: Take<'_>) -> Result<(), String> {
        let message = DynamicMessage::decode(self.0.clone(), data)
            .map_err(|error| format!("no {}: {error}", self.0.full_name()))?;
        fields("", &message, take);
        Ok(())
    }
}

/// Fields without presence that a message lacks have their default.
fn fields(path: &str, message: &DynamicMessage, take: Take<'_>) {
    for field in message.descriptor().fields() {
        if !field.supports_presence() || message.has_field(&field) {
            cells(&below(path, field.name()), &message.get_field(&field), take);
        }
    }
}

fn cells(path: &str, value: &Value, take: Take<'_>) {
    let mut number = |number| take(path, Cell::Number(number));
    match value {
        Value::Bool(value) => number(f64::from(u8::from(*value))),
        Value::I32(value) | Value::EnumNumber(value) => number(f64::from(*value)),
        Value::I64(value) => number(*value as f64),
        Value::U32(value) => number(f64::from(*value)),
        Value::U64(value) => number(*value as f64),
        Value::F32(value) => number(f64::from(*value)),
        Value::F64(value) => number(*value),
        Value::String(text) => take(path, Cell::Text(text.clone())),
        // No numbers, or only their program knows of which kind.
        Value::Bytes(_) => {}
        Value::Message(message) => match time_ns(message) {
            Some(ns) => number(ns),
            None => fields(path, message, take),
        },
        Value::List(values) if values.len() > LIST_MAX => {}
        Value::List(values) => {
            for (index, one) in values.iter().enumerate() {
                cells(&format!("{path}[{index}]"), one, take);
            }
        }
        Value::Map(values) => {
            for (key, one) in values {
                cells(&format!("{path}[{}]", in_words(key)), one, take);
            }
        }
    }
}

fn time_ns(message: &DynamicMessage) -> Option<f64> {
    let of = |name| message.get_field_by_name(name).as_deref().and_then(|value| Some(value.as_i64()? as f64));
    let nanos = || message.get_field_by_name("nanos").as_deref().and_then(Value::as_i32);
    (message.descriptor().full_name() == TIMESTAMP).then_some(())?;
    Some(of("seconds")? * 1e9 + f64::from(nanos()?))
}

fn in_words(key: &MapKey) -> String {
    match key {
        MapKey::Bool(key) => key.to_string(),
        MapKey::I32(key) => key.to_string(),
        MapKey::I64(key) => key.to_string(),
        MapKey::U32(key) => key.to_string(),
        MapKey::U64(key) => key.to_string(),
        MapKey::String(key) => key.clone(),
    }
}
