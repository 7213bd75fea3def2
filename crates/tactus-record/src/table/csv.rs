//! Writes a measurement table as text with commas (RFC 4180), and its metadata as JSON beside it.

use std::{
    collections::BTreeMap,
    io::{self, Write},
    path::PathBuf,
};

use serde_json::Value;
use tactus_schema::{
    Rig,
    table::{RIG_METADATA_KEY, RowView},
};

use super::{TableError, plain_part::PlainPart};

/// A table in text form being written.
pub(crate) struct CsvWriter {
    part: PlainPart,
    metadata: BTreeMap<String, String>,
    rows: u64,
}

impl CsvWriter {
    pub(crate) fn create(path: PathBuf, rig_json: &str) -> Result<Self, TableError> {
        let rig = match Rig::from_json(rig_json) {
            Ok(rig) => rig,
            Err(source) => return Err(TableError::Rig { path, source }),
        };
        let mut part = PlainPart::create(path)?;
        part.write(|file| {
            write!(file, "run,press,phase,t_ns,x_mm,y_mm,z_mm,covering_mm,indenter,temperature_c")?;
            (0..rig.array.elements()).try_for_each(|element| write!(file, ",counts_{element}"))?;
            writeln!(file)
        })?;
        let metadata = BTreeMap::from([(RIG_METADATA_KEY.to_owned(), rig_json.to_owned())]);
        Ok(Self { part, metadata, rows: 0 })
    }

    pub(crate) fn put(&mut self, row: &RowView<'_>) -> Result<(), TableError> {
        self.rows += 1;
        self.part.write(|file| {
            let [x_mm, y_mm, z_mm] = row.position_mm;
            text(file, row.run)?;
            write!(file, ",{},{},{},{x_mm},{y_mm},{z_mm}", row.press, row.phase.name(), row.t_ns)?;
            write!(file, ",{},", row.covering_mm)?;
            text(file, row.indenter)?;
            match row.temperature_c {
                Some(temperature_c) => write!(file, ",{temperature_c}")?,
                None => write!(file, ",")?,
            }
            row.counts.iter().try_for_each(|count| write!(file, ",{count}"))?;
            writeln!(file)
        })
    }

    pub(crate) fn metadata(&mut self, key: &str, value: String) {
        self.metadata.insert(key.to_owned(), value);
    }

    /// Places the metadata first: a table at its path is complete.
    pub(crate) fn finish(self) -> Result<u64, TableError> {
        let Self { part, metadata, rows } = self;
        let values = metadata.into_iter().map(|(key, value)| {
            let value = serde_json::from_str(&value).unwrap_or(Value::String(value));
            (key, value)
        });
        let json = Value::Object(values.collect());
        let mut beside = PlainPart::create(part.path().with_extension("metadata.json"))?;
        beside.write(|file| writeln!(file, "{json:#}"))?;
        beside.finish()?;
        part.finish()?;
        Ok(rows)
    }

    pub(crate) fn abandon(self) {
        self.part.abandon();
    }
}

/// A text, in quotes where it has to be.
fn text(file: &mut impl Write, text: &str) -> io::Result<()> {
    if text.contains(['"', ',', '\n', '\r']) {
        write!(file, "\"{}\"", text.replace('"', "\"\""))
    } else {
        file.write_all(text.as_bytes())
    }
}
