//! MCAP with messages in JSON, protobuf or ROS 2's CDR. The rows are the messages of one topic; columns of other topics, such as the
//! stage's, are interpolated at their times.
//!
//! Fields are named by their path: `pose.z`, `values[3]`. Times (`google.protobuf.Timestamp`, `builtin_interfaces/Time`) are numbers in
//! ns.

mod protobuf;
mod ros;

use std::{collections::BTreeMap, fs, path::Path};

use mcap::{Channel, MessageStream, Summary};
use serde_json::Value;
use tactus_record::meter;

use super::{Column, Columns, Places, file_error};
use crate::{ImportError, mapping::FileForm};

/// Name of the column with the time at which a message was logged, in nanoseconds.
const LOG_TIME: &str = "log_time";

/// Longer lists, such as pictures, become no columns.
const LIST_MAX: usize = 4096;

/// The messages of one topic.
struct Topic {
    decoder: Decoder,
    times_ns: Vec<u64>,
    columns: BTreeMap<String, Column>,
}

/// How the messages of a topic are read.
enum Decoder {
    Json,
    Protobuf(protobuf::Decoder),
    Ros(ros::Decoder),
}

/// One value of a message.
enum Cell {
    Number(f64),
    Text(String),
}

/// Takes the values of a message, each with its path.
type Take<'a> = &'a mut dyn FnMut(&str, Cell);

pub(super) fn read(path: &Path, form: &FileForm) -> Result<Columns, ImportError> {
    let bytes =
        fs::read(path).map_err(|source| ImportError::Io { action: "read", path: path.to_owned(), source })?;
    let broken = |error: mcap::McapError| file_error(path, error.to_string());
    // An index that is missing or damaged costs only the progress.
    let statistics = Summary::read(&bytes).ok().flatten().and_then(|summary| summary.stats);
    let messages = statistics.map_or(0, |statistics| statistics.message_count);
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    let mut left_out: BTreeMap<String, String> = BTreeMap::new();
    for message in MessageStream::new(&bytes).map_err(broken)? {
        let message = message.map_err(broken)?;
        meter::count((bytes.len() as u64).checked_div(messages).unwrap_or(0));
        let name = &message.channel.topic;
        if left_out.contains_key(name) {
            continue;
        }
        if !topics.contains_key(name) {
            match Decoder::of(&message.channel) {
                Ok(decoder) => {
                    let topic = Topic { decoder, times_ns: Vec::new(), columns: BTreeMap::new() };
                    topics.insert(name.clone(), topic);
                }
                // Others of the file may be what is wanted.
                Err(problem) => {
                    left_out.insert(name.clone(), problem);
                    continue;
                }
            }
        }
        if let Some(topic) = topics.get_mut(name) {
            let number = topic.times_ns.len();
            topic
                .take(&message.data, message.log_time)
                .map_err(|problem| file_error(path, format!("message {number} of {name}: {problem}")))?;
        }
    }
    let rows = rows_topic(path, form, &topics, &left_out)?;
    joined(path, &rows, topics, left_out)
}

impl Topic {
    /// Takes a message, or says what is wrong with it.
    fn take(&mut self, data: &[u8], at_ns: u64) -> Result<(), String> {
        let Self { decoder, times_ns, columns } = self;
        times_ns.push(at_ns);
        let number = times_ns.len();
        decoder.decode(data, &mut |field, cell| {
            let column = columns.entry(field.to_owned()).or_default();
            // Fields that earlier messages lacked.
            column.numbers.resize(number - 1, f64::NAN);
            match cell {
                Cell::Number(cell) => column.numbers.push(cell),
                Cell::Text(cell) => column.push_text(&cell),
            }
        })?;
        for column in columns.values_mut() {
            column.numbers.resize(number, f64::NAN);
        }
        Ok(())
    }
}

impl Decoder {
    /// By the channel's encoding and schema; or why its messages cannot be read.
    fn of(channel: &Channel<'_>) -> Result<Self, String> {
        let schema = channel.schema.as_ref();
        let kind = schema.map_or("", |schema| schema.encoding.as_str());
        match (channel.message_encoding.as_str(), kind, schema) {
            ("json", _, _) => Ok(Self::Json),
            ("protobuf", "protobuf", Some(schema)) => {
                protobuf::Decoder::of(&schema.name, &schema.data).map(Self::Protobuf)
            }
            ("cdr", "ros2msg", Some(schema)) => ros::Decoder::of(&schema.name, &schema.data).map(Self::Ros),
            (encoding, _, _) => Err(format!(
                "messages in {encoding:?} with a schema in {kind:?}; json, protobuf with its schema and cdr with ros2msg can be \
                 imported. Convert the file, or write its fields as CSV"
            )),
        }
    }

    fn decode(&self, data: &[u8], take: Take<'_>) -> Result<(), String> {
        match self {
            Self::Json => {
                let fields = serde_json::from_slice(data).map_err(|error| format!("no JSON: {error}"))?;
                flatten("", &fields, take);
                Ok(())
            }
            Self::Protobuf(decoder) => decoder.decode(data, take),
            Self::Ros(decoder) => decoder.decode(data, take),
        }
    }
}

/// The topic whose messages are the rows.
fn rows_topic(
    path: &Path,
    form: &FileForm,
    topics: &BTreeMap<String, Topic>,
    left_out: &BTreeMap<String, String>,
) -> Result<String, ImportError> {
    let known = || topics.keys().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    let of_left_out =
        |(name, problem): (&String, &String)| file_error(path, format!("topic {name:?}: {problem}"));
    match &form.topic {
        Some(topic) if topics.contains_key(topic) => Ok(topic.clone()),
        Some(topic) => Err(match left_out.get_key_value(topic) {
            Some(one) => of_left_out(one),
            None => file_error(path, format!("no topic {topic:?}; the file has {}", known())),
        }),
        None if topics.len() == 1 => Ok(topics.keys().next().cloned().unwrap_or_default()),
        None => Err(match left_out.first_key_value() {
            Some(one) if topics.is_empty() => of_left_out(one),
            _ => file_error(
                path,
                format!(
                    "which topic holds the frames? Write topic = \"...\" into [file] of the mapping; the file has {}",
                    known()
                ),
            ),
        }),
    }
}

/// All columns at the times of one topic: its own by their names, those of others as `topic:name`. Rows before the first and after the
/// last message of another topic have no number there.
fn joined(
    path: &Path,
    rows: &str,
    mut topics: BTreeMap<String, Topic>,
    left_out: BTreeMap<String, String>,
) -> Result<Columns, ImportError> {
    let (times_ns, own) = topics.remove(rows).map(|own| (own.times_ns, own.columns)).unwrap_or_default();
    let times = times_ns.iter().map(|ns| *ns as f64).collect();
    let mut columns = vec![(LOG_TIME.to_owned(), Column::of_numbers(times))];
    columns.extend(own);
    for (name, topic) in topics {
        let at = |column: &Column| {
            times_ns.iter().map(|ns| interpolated(&topic.times_ns, &column.numbers, *ns)).collect()
        };
        columns.extend(
            topic
                .columns
                .iter()
                .map(|(field, column)| (format!("{name}:{field}"), Column::of_numbers(at(column)))),
        );
    }
    let columns = Columns::new(path, columns, Places::Messages(rows.to_owned()))?;
    Ok(Columns { left_out, ..columns })
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

/// Calls `take` for every field.
fn flatten(path: &str, value: &Value, take: Take<'_>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                flatten(&below(path, name), value, take);
            }
        }
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                flatten(&format!("{path}[{index}]"), value, take);
            }
        }
        Value::Number(cell) => take(path, Cell::Number(cell.as_f64().unwrap_or(f64::NAN))),
        Value::String(cell) => take(path, Cell::Text(cell.clone())),
        Value::Null | Value::Bool(_) => take(path, Cell::Text(value.to_string())),
    }
}

/// The path of a field of a message at `path`.
fn below(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}
