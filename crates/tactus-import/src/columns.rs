//! The columns of a lab's file, whatever its format.

mod mcap;
mod npz;
mod text;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{ImportError, mapping::FileForm};

/// Names of columns that an error lists.
const NAMES_LISTED: usize = 16;

/// The columns of one file.
#[derive(Debug)]
pub(crate) struct Columns {
    path: PathBuf,
    rows: usize,
    by_name: BTreeMap<String, Column>,
    /// Names in the file's order.
    names: Vec<String>,
    places: Places,
    /// Topics whose messages cannot be read, and why.
    left_out: BTreeMap<String, String>,
}

/// A column: numbers, and the cells that are none.
#[derive(Debug, Default)]
pub(crate) struct Column {
    /// NaN where the cell is no number.
    numbers: Vec<f64>,
    texts: BTreeMap<usize, String>,
}

/// How an error names a row.
#[derive(Debug)]
enum Places {
    /// By the line of each row.
    Lines(Vec<u64>),
    /// By the index, from 0.
    Rows,
    /// By the index of the message on a topic, from 0.
    Messages(String),
}

impl Column {
    fn of_numbers(numbers: Vec<f64>) -> Self {
        Self { numbers, texts: BTreeMap::new() }
    }

    fn push(&mut self, cell: &str, decimal: char) {
        let number = match decimal {
            '.' => cell.parse(),
            _ => cell.replace(decimal, ".").parse(),
        };
        if let Ok(number) = number {
            self.numbers.push(number);
        } else {
            self.push_text(cell);
        }
    }

    fn push_text(&mut self, cell: &str) {
        self.texts.insert(self.numbers.len(), cell.to_owned());
        self.numbers.push(f64::NAN);
    }

    /// The numbers; NaN where a cell is none.
    pub(crate) fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// True if no cell is a number.
    pub(crate) fn is_text(&self) -> bool {
        self.texts.len() == self.numbers.len()
    }

    /// Least and greatest number; `None` without numbers.
    pub(crate) fn range(&self) -> Option<[f64; 2]> {
        let finite = || self.numbers.iter().copied().filter(|number| number.is_finite());
        finite()
            .next()
            .map(|_| [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)])
    }

    /// True if every number is whole.
    pub(crate) fn is_whole(&self) -> bool {
        self.numbers.iter().filter(|number| number.is_finite()).all(|number| number.fract() == 0.0)
    }

    /// A cell as text.
    pub(crate) fn text(&self, row: usize) -> String {
        self.texts.get(&row).cloned().unwrap_or_else(|| self.numbers[row].to_string())
    }
}

impl Columns {
    /// Reads a file by its name: .csv, .tsv or .txt, .npz, .mcap.
    pub(crate) fn read(path: &Path, form: &FileForm) -> Result<Self, ImportError> {
        let extension =
            path.extension().and_then(|one| one.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "csv" | "tsv" | "txt" | "dat" => text::read(path, form),
            "npz" => npz::read(path),
            "mcap" => mcap::read(path, form),
            _ => Err(file_error(
                path,
                "the name does not say what it is: .csv, .tsv, .txt, .dat, .npz or .mcap",
            )),
        }
    }

    fn new(path: &Path, columns: Vec<(String, Column)>, places: Places) -> Result<Self, ImportError> {
        let rows = columns.first().map_or(0, |(_, column)| column.numbers.len());
        if rows == 0 {
            return Err(file_error(path, "there are no rows"));
        }
        if let Some((name, column)) = columns.iter().find(|(_, column)| column.numbers.len() != rows) {
            let (first, _) = &columns[0];
            let found = column.numbers.len();
            return Err(file_error(path, format!("{name:?} has {found} rows, and {first:?} has {rows}")));
        }
        let names: Vec<String> = columns.iter().map(|(name, _)| name.clone()).collect();
        if let Some(name) =
            names.iter().enumerate().find_map(|(at, name)| names[..at].contains(name).then_some(name))
        {
            return Err(file_error(path, format!("two columns are named {name:?}")));
        }
        Ok(Self {
            path: path.to_owned(),
            rows,
            by_name: columns.into_iter().collect(),
            names,
            places,
            left_out: BTreeMap::new(),
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Names, in the file's order.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The column that a key of the mapping names.
    pub(crate) fn get(&self, key: &str, name: &str) -> Result<&Column, ImportError> {
        self.by_name.get(name).ok_or_else(|| {
            let of_topic = |topic: &str| name.strip_prefix(topic).is_some_and(|field| field.starts_with(':'));
            if let Some((topic, problem)) = self.left_out.iter().find(|(topic, _)| of_topic(topic)) {
                return file_error(
                    &self.path,
                    format!("{key} of the mapping names {name:?}, and topic {topic:?}: {problem}"),
                );
            }
            let listed: Vec<String> =
                self.names.iter().take(NAMES_LISTED).map(|name| format!("{name:?}")).collect();
            let more = self.names.len() - listed.len();
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let (key, column) = (key.to_owned(), name.to_owned());
            ImportError::Column { path: self.path.clone(), key, column, known: listed.join(", ") + &more }
        })
    }

    /// The numbers of a column: every cell must be one.
    pub(crate) fn numbers(&self, key: &str, name: &str) -> Result<&[f64], ImportError> {
        let column = self.get(key, name)?;
        match column.numbers.iter().position(|number| !number.is_finite()) {
            None => Ok(&column.numbers),
            Some(row) => {
                let cell = column.text(row);
                let what = if cell.trim().is_empty() {
                    "empty".to_owned()
                } else {
                    format!("{cell:?} is no number")
                };
                Err(self.fault(row, name, format!("{what}; correct it or remove the row")))
            }
        }
    }

    /// An error of one cell.
    pub(crate) fn fault(&self, row: usize, column: &str, problem: impl Into<String>) -> ImportError {
        let place = match &self.places {
            Places::Lines(lines) => format!("line {}", lines[row]),
            Places::Rows => format!("row {row}"),
            Places::Messages(topic) => format!("message {row} of {topic}"),
        };
        ImportError::Value {
            path: self.path.clone(),
            place,
            column: column.to_owned(),
            problem: problem.into(),
        }
    }
}

fn file_error(path: &Path, problem: impl Into<String>) -> ImportError {
    ImportError::File { path: path.to_owned(), problem: problem.into() }
}
