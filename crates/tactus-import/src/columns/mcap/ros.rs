//! Messages of ROS 2: CDR, by the text of the definitions that the file has (`ros2msg`).

use std::{collections::BTreeMap, str};

use super::{Cell, LIST_MAX, Take, below};

/// Has a second and its nanoseconds.
const TIME: &str = "builtin_interfaces/Time";
/// Messages in messages at most; more is a definition that contains itself.
const DEPTH_MAX: usize = 32;

/// Decodes messages of one kind.
pub(super) struct Decoder {
    name: String,
    definitions: BTreeMap<String, Vec<Field>>,
}

struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

#[derive(Clone)]
enum Kind {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    Text,
    /// By its name, `package/Name`.
    Message(String),
}

#[derive(Clone, Copy)]
enum Count {
    One,
    /// An array of so many.
    Fixed(usize),
    /// A sequence, which says how many it has.
    Told,
}

/// A message that is being read.
struct Reader<'a> {
    data: &'a [u8],
    at: usize,
    is_big: bool,
}

impl Decoder {
    /// From definitions: the message's own first, then each that it uses after a line of `=` and its name.
    pub(super) fn of(name: &str, text: &[u8]) -> Result<Self, String> {
        let text = str::from_utf8(text).map_err(|error| format!("the schema of {name}: {error}"))?;
        let name = short(name);
        let mut definitions = BTreeMap::new();
        let mut current = (name.clone(), Vec::new());
        for line in text.lines().map(|line| line.split('#').next().unwrap_or_default().trim()) {
            if line.starts_with("====") {
                continue;
            }
            if let Some(next) = line.strip_prefix("MSG:") {
                let (name, fields) = std::mem::replace(&mut current, (short(next.trim()), Vec::new()));
                definitions.insert(name, fields);
            } else if let Some(field) = Field::parse(line, &current.0)? {
                current.1.push(field);
            }
        }
        definitions.insert(current.0, current.1);
        let used = |field: &Field| match field {
            Field { kind: Kind::Message(name), .. } => Some(name.clone()),
            Field { .. } => None,
        };
        let mut used = definitions.values().flatten().filter_map(used);
        if let Some(unknown) = used.find(|name| !definitions.contains_key(name) && name != TIME) {
            return Err(format!("the schema of {name} does not describe {unknown}"));
        }
        Ok(Self { name, definitions })
    }

    pub(super) fn decode(&self, data: &[u8], take: Take<'_>) -> Result<(), String> {
        let is_big = match data {
            [0, 0, _, _, ..] => true,
            [0, 1, _, _, ..] => false,
            _ => return Err("no CDR of version 1".to_owned()),
        };
        // Values are aligned to the byte after the head.
        let mut reader = Reader { data: &data[4..], at: 0, is_big };
        self.message(&self.name, "", &mut reader, take, DEPTH_MAX)
    }

    fn message(
        &self,
        name: &str,
        path: &str,
        reader: &mut Reader<'_>,
        take: Take<'_>,
        depth: usize,
    ) -> Result<(), String> {
        let Some(depth) = depth.checked_sub(1) else {
            return Err(format!("field {path}: {name} contains itself"));
        };
        if name == TIME {
            let ns = reader.i32(path)? * 1e9 + reader.u32(path)?;
            take(path, Cell::Number(ns));
            return Ok(());
        }
        let fields = self.definitions.get(name).map(Vec::as_slice).unwrap_or_default();
        if fields.is_empty() {
            // Such a message has a byte.
            reader.bytes::<1>(path)?;
        }
        for Field { name, kind, count } in fields {
            let path = below(path, name);
            let count = match count {
                Count::One => {
                    self.value(kind, &path, reader, take, depth)?;
                    continue;
                }
                Count::Fixed(count) => *count,
                Count::Told => reader.length(&path)?,
            };
            if count > reader.data.len() {
                return Err(format!("field {path}: the message is too short for {count} values"));
            }
            let mut ignore = |_: &str, _: Cell| {};
            let take: Take<'_> = if count > LIST_MAX { &mut ignore } else { &mut *take };
            for index in 0..count {
                self.value(kind, &format!("{path}[{index}]"), reader, take, depth)?;
            }
        }
        Ok(())
    }

    fn value(
        &self,
        kind: &Kind,
        path: &str,
        reader: &mut Reader<'_>,
        take: Take<'_>,
        depth: usize,
    ) -> Result<(), String> {
        let number = match kind {
            Kind::Bool | Kind::U8 => f64::from(u8::from_le_bytes(reader.bytes(path)?)),
            Kind::I8 => f64::from(i8::from_le_bytes(reader.bytes(path)?)),
            Kind::I16 => f64::from(i16::from_le_bytes(reader.bytes(path)?)),
            Kind::U16 => f64::from(u16::from_le_bytes(reader.bytes(path)?)),
            Kind::I32 => reader.i32(path)?,
            Kind::U32 => reader.u32(path)?,
            Kind::I64 => i64::from_le_bytes(reader.bytes(path)?) as f64,
            Kind::U64 => u64::from_le_bytes(reader.bytes(path)?) as f64,
            Kind::F32 => f64::from(f32::from_le_bytes(reader.bytes(path)?)),
            Kind::F64 => f64::from_le_bytes(reader.bytes(path)?),
            Kind::Text => {
                take(path, Cell::Text(reader.text(path)?));
                return Ok(());
            }
            Kind::Message(name) => return self.message(name, path, reader, take, depth),
        };
        take(path, Cell::Number(number));
        Ok(())
    }
}

impl Field {
    /// `None` for a line without a field, or with a constant.
    fn parse(line: &str, message: &str) -> Result<Option<Self>, String> {
        let mut words = line.split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else { return Ok(None) };
        // A default may follow, also one with `=`.
        if name.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            return Ok(None);
        }
        let wrong = || format!("the schema of {message}: {line:?} is no field that can be imported");
        let (kind, count) = match kind.split_once('[') {
            None => (kind, Count::One),
            Some((kind, "]")) => (kind, Count::Told),
            Some((kind, bound)) if bound.starts_with("<=") => (kind, Count::Told),
            Some((kind, count)) => {
                let count = count.strip_suffix(']').and_then(|count| count.parse().ok());
                (kind, Count::Fixed(count.ok_or_else(wrong)?))
            }
        };
        let kind = match kind.split("<=").next().unwrap_or_default() {
            "bool" => Kind::Bool,
            "int8" => Kind::I8,
            "uint8" | "byte" | "char" => Kind::U8,
            "int16" => Kind::I16,
            "uint16" => Kind::U16,
            "int32" => Kind::I32,
            "uint32" => Kind::U32,
            "int64" => Kind::I64,
            "uint64" => Kind::U64,
            "float32" => Kind::F32,
            "float64" => Kind::F64,
            "string" => Kind::Text,
            "wstring" => return Err(wrong()),
            other if other.contains('/') => Kind::Message(short(other)),
            other => {
                let package = message.split('/').next().unwrap_or_default();
                Kind::Message(format!("{package}/{other}"))
            }
        };
        Ok(Some(Self { name: name.to_owned(), kind, count }))
    }
}

impl Reader<'_> {
    /// The bytes of a number, the least first; a number is aligned to its size.
    fn bytes<const N: usize>(&mut self, path: &str) -> Result<[u8; N], String> {
        self.at = self.at.next_multiple_of(N);
        let bytes = self.data.get(self.at..).and_then(<[u8]>::first_chunk::<N>);
        let mut bytes = *bytes.ok_or_else(|| format!("field {path}: the message ends before it"))?;
        self.at += N;
        if self.is_big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn i32(&mut self, path: &str) -> Result<f64, String> {
        Ok(f64::from(i32::from_le_bytes(self.bytes(path)?)))
    }

    fn u32(&mut self, path: &str) -> Result<f64, String> {
        Ok(f64::from(u32::from_le_bytes(self.bytes(path)?)))
    }

    fn length(&mut self, path: &str) -> Result<usize, String> {
        let length = u32::from_le_bytes(self.bytes(path)?);
        Ok(usize::try_from(length).unwrap_or(usize::MAX))
    }

    /// A text ends with a zero, which its length counts.
    fn text(&mut self, path: &str) -> Result<String, String> {
        let length = self.length(path)?;
        let end = self.at.checked_add(length);
        let text = end.and_then(|end| self.data.get(self.at..end));
        let text = text.ok_or_else(|| format!("field {path}: the message ends within it"))?;
        self.at += length;
        Ok(String::from_utf8_lossy(text.strip_suffix(b"\0").unwrap_or(text)).into_owned())
    }
}

/// `package/Name`, also of `package/msg/Name`.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}
