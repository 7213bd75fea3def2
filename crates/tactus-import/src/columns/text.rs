//! Text with a line of names, and one line for each frame.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};
use tactus_record::meter::MeteredFile;

use super::{Column, Columns, Places, file_error};
use crate::{ImportError, mapping::FileForm};

pub(super) fn read(path: &Path, form: &FileForm) -> Result<Columns, ImportError> {
    let failed = |error: csv::Error| file_error(path, error.to_string());
    let file = MeteredFile::open(path);
    let file = file.map_err(|source| ImportError::Io { action: "read", path: path.to_owned(), source })?;
    let mut reader = ReaderBuilder::new()
        .delimiter(form.delimiter)
        .comment(form.comment)
        .trim(Trim::All)
        .from_reader(file);
    let names: Vec<String> = reader
        .headers()
        .map_err(failed)?
        .iter()
        .map(|name| name.trim_start_matches('\u{feff}').to_owned())
        .collect();
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(file_error(path, "the first line has no names of columns: write them into a first line"));
    }
    if names.len() == 1 {
        let delimiter = char::from(form.delimiter);
        return Err(file_error(
            path,
            format!(
                "{delimiter:?} divides no columns: write delimiter = \";\" (or \"\\t\") into [file] of the mapping"
            ),
        ));
    }
    let mut columns: Vec<Column> = names.iter().map(|_| Column::default()).collect();
    let mut lines = Vec::new();
    let mut record = StringRecord::new();
    while reader.read_record(&mut record).map_err(failed)? {
        lines.push(record.position().map_or(0, csv::Position::line));
        for (column, cell) in columns.iter_mut().zip(&record) {
            column.push(cell, form.decimal);
        }
    }
    Columns::new(path, names.into_iter().zip(columns).collect(), Places::Lines(lines))
}
