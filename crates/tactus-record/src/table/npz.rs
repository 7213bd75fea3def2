//! Writes a measurement table as an archive of `NumPy` arrays: a ZIP file without compression.
//!
//! The columns are held in memory until the end, because an array begins with its length.

use std::{
    collections::BTreeMap,
    io::{self, Write},
    path::PathBuf,
};

use tactus_schema::{
    Rig,
    table::{RIG_METADATA_KEY, RowView},
};

use super::{TableError, plain_part::PlainPart};

/// Least version of a ZIP reader.
const ZIP_VERSION: u16 = 20;
/// 1 January 1980, the first day that a ZIP file knows: two equal tables are equal files.
const ZIP_DATE: u16 = (1 << 5) | 1;

/// A table of arrays being written.
pub(crate) struct NpzWriter {
    part: PlainPart,
    metadata: BTreeMap<String, String>,
    elements: usize,
    runs: Names,
    phases: Names,
    indenters: Names,
    press: Vec<i32>,
    t_ns: Vec<i64>,
    /// x, y, z, covering, temperature.
    columns: [Vec<f64>; 5],
    counts: Vec<f32>,
}

/// Names, and for each row the index of its name.
#[derive(Default)]
struct Names {
    names: Vec<String>,
    rows: Vec<i32>,
}

impl Names {
    fn push(&mut self, name: &str) {
        let known = self.names.iter().rposition(|one| one == name);
        let index = known.unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.names.len() - 1
        });
        self.rows.push(i32::try_from(index).unwrap_or(i32::MAX));
    }
}

impl NpzWriter {
    pub(crate) fn create(path: PathBuf, rig_json: &str) -> Result<Self, TableError> {
        let elements = match Rig::from_json(rig_json) {
            Ok(rig) => rig.array.elements(),
            Err(source) => return Err(TableError::Rig { path, source }),
        };
        Ok(Self {
            part: PlainPart::create(path)?,
            metadata: BTreeMap::from([(RIG_METADATA_KEY.to_owned(), rig_json.to_owned())]),
            elements,
            runs: Names::default(),
            phases: Names::default(),
            indenters: Names::default(),
            press: Vec::new(),
            t_ns: Vec::new(),
            columns: Default::default(),
            counts: Vec::new(),
        })
    }

    pub(crate) fn put(&mut self, row: &RowView<'_>) -> Result<(), TableError> {
        let bytes = (self.counts.len() + row.counts.len()) * size_of::<f32>();
        if u32::try_from(bytes).is_err() {
            let full = io::Error::other("an archive of arrays holds at most 4 GiB: write Parquet instead");
            return Err(TableError::Io { action: "write", path: self.part.path().to_owned(), source: full });
        }
        let [x_mm, y_mm, z_mm] = row.position_mm;
        let temperature_c = row.temperature_c.unwrap_or(f64::NAN);
        for (column, value) in self.columns.iter_mut().zip([x_mm, y_mm, z_mm, row.covering_mm, temperature_c])
        {
            column.push(value);
        }
        self.runs.push(row.run);
        self.phases.push(row.phase.name());
        self.indenters.push(row.indenter);
        self.press.push(row.press);
        self.t_ns.push(row.t_ns);
        self.counts.extend_from_slice(row.counts);
        Ok(())
    }

    pub(crate) fn metadata(&mut self, key: &str, value: String) {
        self.metadata.insert(key.to_owned(), value);
    }

    /// Writes all arrays; returns the number of rows.
    pub(crate) fn finish(mut self) -> Result<u64, TableError> {
        let rows = self.t_ns.len();
        let shape = format!("({rows},)");
        let mut arrays = vec![
            ("press".to_owned(), npy("<i4", &shape, self.press.iter().flat_map(|one| one.to_le_bytes()))),
            ("t_ns".to_owned(), npy("<i8", &shape, self.t_ns.iter().flat_map(|one| one.to_le_bytes()))),
        ];
        for (name, column) in
            ["x_mm", "y_mm", "z_mm", "covering_mm", "temperature_c"].into_iter().zip(&self.columns)
        {
            let bytes = column.iter().flat_map(|one| one.to_le_bytes());
            arrays.push((name.to_owned(), npy("<f8", &shape, bytes)));
        }
        for (row, all, names) in [
            ("run", "runs", &self.runs),
            ("phase", "phases", &self.phases),
            ("indenter", "indenters", &self.indenters),
        ] {
            let bytes = names.rows.iter().flat_map(|one| one.to_le_bytes());
            arrays.push((row.to_owned(), npy("<i4", &shape, bytes)));
            arrays.push((all.to_owned(), texts(&names.names, &format!("({},)", names.names.len()))));
        }
        let shape = format!("({rows}, {})", self.elements);
        let counts = self.counts.iter().flat_map(|one| one.to_le_bytes());
        arrays.push(("counts".to_owned(), npy("<f4", &shape, counts)));
        for (key, value) in &self.metadata {
            arrays.push((key.clone(), texts(std::slice::from_ref(value), "()")));
        }
        self.part.write(|file| zip(file, &arrays))?;
        self.part.finish()?;
        Ok(rows as u64)
    }

    pub(crate) fn abandon(self) {
        self.part.abandon();
    }
}

/// An array in `NumPy`'s format, version 1.0: its header fills whole 64 bytes.
fn npy(kind: &str, shape: &str, values: impl Iterator<Item = u8>) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version and length take 10 bytes, the end of the line one.
    let padded = (head.len() + 11).next_multiple_of(64) - 11;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(padded + 1).unwrap_or(u16::MAX).to_le_bytes());
    bytes.extend(format!("{head:padded$}\n").into_bytes());
    bytes.extend(values);
    bytes
}

/// Texts: each character takes 4 bytes, and all have the length of the longest.
fn texts(texts: &[String], shape: &str) -> Vec<u8> {
    let width = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
    let padded = |text: &String| {
        let chars: Vec<u32> = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(width).collect();
        chars.into_iter().flat_map(u32::to_le_bytes)
    };
    npy(&format!("<U{width}"), shape, texts.iter().flat_map(padded))
}

/// A ZIP file of arrays, stored as they are.
fn zip(file: &mut impl Write, arrays: &[(String, Vec<u8>)]) -> io::Result<()> {
    let too_large = |_| io::Error::other("an archive of arrays holds at most 4 GiB: write Parquet instead");
    let mut directory: Vec<u8> = Vec::new();
    let mut offset: u32 = 0;
    for (name, bytes) in arrays {
        let name = format!("{name}.npy");
        let size = u32::try_from(bytes.len()).map_err(too_large)?;
        let name_length = u16::try_from(name.len()).map_err(too_large)?;
        // Shared by the entry's head and the directory: version, no flags, stored, midnight, date, checksum, sizes, length of the name.
        let mut shared: Vec<u8> = Vec::new();
        for half in [ZIP_VERSION, 0, 0, 0, ZIP_DATE] {
            shared.extend(half.to_le_bytes());
        }
        for whole in [crc32fast::hash(bytes), size, size] {
            shared.extend(whole.to_le_bytes());
        }
        shared.extend(name_length.to_le_bytes());
        let head = [b"PK\x03\x04", &shared[..], &[0; 2], name.as_bytes()].concat();
        file.write_all(&head)?;
        file.write_all(bytes)?;
        directory.extend(b"PK\x01\x02");
        directory.extend(ZIP_VERSION.to_le_bytes());
        directory.extend(&shared);
        // No extra field, no comment, first disk, no attributes.
        directory.extend([0; 12]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
        let entry = u32::try_from(head.len()).map_err(too_large)?.checked_add(size);
        offset = entry.and_then(|entry| offset.checked_add(entry)).ok_or_else(|| {
            io::Error::other("an archive of arrays holds at most 4 GiB: write Parquet instead")
        })?;
    }
    let entries = u16::try_from(arrays.len()).map_err(too_large)?.to_le_bytes();
    let length = u32::try_from(directory.len()).map_err(too_large)?.to_le_bytes();
    file.write_all(&directory)?;
    file.write_all(
        &[b"PK\x05\x06", &[0; 4][..], &entries, &entries, &length, &offset.to_le_bytes(), &[0; 2]].concat(),
    )
}
