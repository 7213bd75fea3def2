//! Rows as a table for people, as JSON, and as files.

use std::{
    fs::Permissions,
    io::{self, BufWriter, ErrorKind, Write as _},
    ops::ControlFlow,
    os::unix::fs::PermissionsExt as _,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use arrow::{
    array::RecordBatch,
    compute::cast,
    csv,
    datatypes::{DataType, Field, Schema, SchemaRef},
    json::{WriterBuilder, writer::LineDelimited},
    util::display::{ArrayFormatter, FormatOptions},
};
use parquet::arrow::ArrowWriter;
use tempfile::NamedTempFile;

/// Who takes the rows of an answer.
pub(crate) trait Answer {
    /// Takes rows; breaks if it wants no more.
    fn add(&mut self, rows: &RecordBatch) -> anyhow::Result<ControlFlow<()>>;
}

/// The first rows as a table for people.
#[derive(Debug)]
pub(crate) struct Table {
    columns: SchemaRef,
    rows: Vec<Vec<String>>,
    is_cut: bool,
}

impl Table {
    /// So many rows are shown.
    pub(crate) const ROWS: usize = 100;
    /// So many characters of a value.
    const CHARACTERS: usize = 60;

    pub(crate) fn new(columns: SchemaRef) -> Self {
        Self { columns, rows: Vec::new(), is_cut: false }
    }

    /// True if there are more rows.
    pub(crate) fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Lines of columns that stand below each other; numbers to the right.
    pub(crate) fn in_lines(&self) -> Vec<String> {
        let names = self.columns.fields().iter().map(|field| field.name().clone()).collect();
        let lines: Vec<Vec<String>> = [names].into_iter().chain(self.rows.iter().cloned()).collect();
        let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max();
        let widths: Vec<usize> = (0..self.columns.fields().len()).filter_map(width).collect();
        lines.iter().map(|line| self.line(line, &widths)).collect()
    }

    fn line(&self, cells: &[String], widths: &[usize]) -> String {
        let cells = self.columns.fields().iter().zip(cells).zip(widths);
        let padded = cells.map(|((field, cell), &width)| {
            if field.data_type().is_numeric() { format!("{cell:>width$}") } else { format!("{cell:width$}") }
        });
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    }
}

impl Answer for Table {
    fn add(&mut self, rows: &RecordBatch) -> anyhow::Result<ControlFlow<()>> {
        let options = FormatOptions::default();
        let columns = rows.columns().iter().map(|column| ArrayFormatter::try_new(column, &options));
        let columns = columns.collect::<Result<Vec<_>, _>>()?;
        for row in 0..rows.num_rows() {
            if self.rows.len() == Self::ROWS {
                self.is_cut = true;
                return Ok(ControlFlow::Break(()));
            }
            self.rows.push(columns.iter().map(|column| short(&column.value(row).to_string())).collect());
        }
        Ok(ControlFlow::Continue(()))
    }
}

fn short(text: &str) -> String {
    if text.chars().count() <= Table::CHARACTERS {
        return text.to_owned();
    }
    text.chars().take(Table::CHARACTERS - 1).chain(['…']).collect()
}

/// Each row as a JSON object in a line of standard output.
#[derive(Debug)]
pub(crate) struct Lines;

impl Answer for Lines {
    fn add(&mut self, rows: &RecordBatch) -> anyhow::Result<ControlFlow<()>> {
        let mut lines = Vec::new();
        let builder = WriterBuilder::new().with_explicit_nulls(true);
        let mut writer = builder.build::<_, LineDelimited>(&mut lines);
        writer.write(rows)?;
        writer.finish()?;
        drop(writer);
        // Who closes the pipe, as `head` does, wants no more.
        match io::stdout().lock().write_all(&lines) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(ControlFlow::Break(())),
            written => Ok(ControlFlow::Continue(written?)),
        }
    }
}

/// A file, which appears when it is whole.
#[derive(Debug)]
pub(crate) struct OutFile {
    path: PathBuf,
    rows: u64,
    part: Part,
}

/// The file until then.
#[derive(Debug)]
enum Part {
    Parquet(ArrowWriter<NamedTempFile>),
    Csv(csv::Writer<BufWriter<NamedTempFile>>),
}

impl OutFile {
    pub(crate) fn create(path: &Path, columns: &SchemaRef) -> anyhow::Result<Self> {
        let part = || -> anyhow::Result<NamedTempFile> {
            let folder =
                path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let readable = Permissions::from_mode(0o666);
            let file = tempfile::Builder::new().permissions(readable).tempfile_in(folder);
            file.with_context(|| path.display().to_string())
        };
        let part = match path.extension().and_then(|extension| extension.to_str()) {
            Some("parquet") => Part::Parquet(ArrowWriter::try_new(part()?, columns.clone(), None)?),
            Some("csv") => Part::Csv(csv::Writer::new(BufWriter::new(part()?))),
            _ => bail!("{}: the name of a file must end in .parquet or .csv", path.display()),
        };
        Ok(Self { path: path.to_owned(), rows: 0, part })
    }

    /// Puts the file where it belongs; returns its rows.
    pub(crate) fn finish(self) -> anyhow::Result<u64> {
        let path = self.path.display().to_string();
        let part = match self.part {
            Part::Parquet(writer) => writer.into_inner()?,
            Part::Csv(writer) => writer.into_inner().into_inner().context(path.clone())?,
        };
        part.persist(&self.path).context(path)?;
        Ok(self.rows)
    }
}

impl Answer for OutFile {
    fn add(&mut self, rows: &RecordBatch) -> anyhow::Result<ControlFlow<()>> {
        self.rows += rows.num_rows() as u64;
        match &mut self.part {
            Part::Parquet(writer) => writer.write(rows)?,
            Part::Csv(writer) => writer.write(&flat(rows)?)?,
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// The rows with lists as text, because CSV has no lists.
fn flat(rows: &RecordBatch) -> anyhow::Result<RecordBatch> {
    let mut fields = Vec::new();
    let mut columns = Vec::new();
    for (field, column) in rows.schema().fields().iter().zip(rows.columns()) {
        if field.data_type().is_nested() {
            fields.push(Field::new(field.name(), DataType::Utf8, true));
            columns.push(cast(column, &DataType::Utf8)?);
        } else {
            fields.push(field.as_ref().clone());
            columns.push(column.clone());
        }
    }
    Ok(RecordBatch::try_new(Schema::new(fields).into(), columns)?)
}
