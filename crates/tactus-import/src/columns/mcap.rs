//! MCAP with messages in JSON. The rows are the messages of one topic; columns of other topics, such as the stage's, are interpolated
//! at their times.

use std::{collections::BTreeMap, fs, path::Path};

use mcap::MessageStream;
use serde_json::Value;

use super::{Column, Columns, Places, file_error};
use crate::{ImportError, mapping::FileForm};

/// Name of the column with the time at which a message was logged, in nanoseconds.
const LOG_TIME: &str = "log_time";

/// The messages of one topic.
#[derive(Default)]
struct Topic {
    times_ns: Vec<u64>,
    columns: BTreeMap<String, Column>,
}

pub(super) fn read(path: &Path, form: &FileForm) -> Result<Columns, ImportError> {
    let bytes =
        fs::read(path).map_err(|source| ImportError::Io { action: "read", path: path.to_owned(), source })?;
    let broken = |error: mcap::McapError| file_error(path, error.to_string());
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    for message in MessageStream::new(&bytes).map_err(broken)? {
        let message = message.map_err(broken)?;
        let name = &message.channel.topic;
        let encoding = &message.channel.message_encoding;
        if encoding != "json" {
            let problem = format!(
                "topic {name:?} has messages in {encoding:?}; only \"json\" can be imported. Convert the file, or write its fields as CSV"
            );
            return Err(file_error(path, problem));
        }
        let topic = topics.entry(name.clone()).or_default();
        let fields: Value = serde_json::from_slice(&message.data).map_err(|error| {
            file_error(path, format!("message {} of {name}: no JSON: {error}", topic.times_ns.len()))
        })?;
        topic.times_ns.push(message.log_time);
        let number = topic.times_ns.len();
        flatten("", &fields, &mut |field, cell| {
            let column = topic.columns.entry(field.to_owned()).or_default();
            // Fields that earlier messages lacked.
            column.numbers.resize(number - 1, f64::NAN);
            match cell {
                Value::Number(cell) => column.numbers.push(cell.as_f64().unwrap_or(f64::NAN)),
                Value::String(cell) => column.push_text(cell),
                Value::Null | Value::Bool(_) | Value::Array(_) | Value::Object(_) => {
                    column.push_text(&cell.to_string());
                }
            }
        });
        for column in topic.columns.values_mut() {
            column.numbers.resize(number, f64::NAN);
        }
    }
    let rows = rows_topic(path, form, &topics)?;
    joined(path, &rows, topics)
}

/// The topic whose messages are the rows.
fn rows_topic(path: &Path, form: &FileForm, topics: &BTreeMap<String, Topic>) -> Result<String, ImportError> {
    let known = || topics.keys().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    match &form.topic {
        Some(topic) if topics.contains_key(topic) => Ok(topic.clone()),
        Some(topic) => Err(file_error(path, format!("no topic {topic:?}; the file has {}", known()))),
        None if topics.len() == 1 => Ok(topics.keys().next().cloned().unwrap_or_default()),
        None => Err(file_error(
            path,
            format!(
                "which topic holds the frames? Write topic = \"...\" into [file] of the mapping; the file has {}",
                known()
            ),
        )),
    }
}

/// All columns at the times of one topic: its own by their names, those of others as `topic:name`. Rows before the first and after the
/// last message of another topic have no number there.
fn joined(path: &Path, rows: &str, mut topics: BTreeMap<String, Topic>) -> Result<Columns, ImportError> {
    let own = topics.remove(rows).unwrap_or_default();
    let times = own.times_ns.iter().map(|ns| *ns as f64).collect();
    let mut columns = vec![(LOG_TIME.to_owned(), Column::of_numbers(times))];
    columns.extend(own.columns);
    for (name, topic) in topics {
        let at = |column: &Column| {
            own.times_ns.iter().map(|ns| interpolated(&topic.times_ns, &column.numbers, *ns)).collect()
        };
        columns.extend(
            topic
                .columns
                .iter()
                .map(|(field, column)| (format!("{name}:{field}"), Column::of_numbers(at(column)))),
        );
    }
    Columns::new(path, columns, Places::Messages(rows.to_owned()))
}

fn interpolated(times_ns: &[u64], numbers: &[f64], at_ns: u64) -> f64 {
    let next = times_ns.partition_point(|time| *time < at_ns);
    match (next.checked_sub(1), times_ns.get(next)) {
        (_, Some(time)) if *time == at_ns => numbers[next],
        (Some(last), Some(time)) => {
            let share = (at_ns - times_ns[last]) as f64 / (time - times_ns[last]) as f64;
            numbers[last] + share * (numbers[next] - numbers[last])
        }
        (_, None) | (None, _) => f64::NAN,
    }
}

/// Calls `take` for every field, by its path: `a.b`, `a[0]`.
fn flatten(path: &str, value: &Value, take: &mut impl FnMut(&str, &Value)) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                flatten(&if path.is_empty() { name.clone() } else { format!("{path}.{name}") }, value, take);
            }
        }
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                flatten(&format!("{path}[{index}]"), value, take);
            }
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => take(path, value),
    }
}
