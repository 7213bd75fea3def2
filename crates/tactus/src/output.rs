//! Output for people: aligned tables and durations.

use std::io::{ErrorKind, IsTerminal as _, Write as _};

use comfy_table::presets::NOTHING;
use comfy_table::{ColumnConstraint, ContentArrangement, Table, Width};

/// Prints `name  value` lines with the values aligned.
pub(crate) fn print_fields(fields: &[(&str, String)]) {
    for line in aligned(fields) {
        say(&line);
    }
}

fn aligned<'a>(fields: &'a [(&str, String)]) -> impl Iterator<Item = String> + 'a {
    let width = fields.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    fields.iter().map(move |(name, value)| format!("{name:width$}  {value}"))
}

/// Space between two columns of a table.
const GAP: usize = 2;

/// Prints a table with a header. At a terminal it is as wide as that at most: long cells go on in further lines; if not even their longest
/// words fit side by side, each row is a paragraph.
pub(crate) fn print_table(header: &[&str], rows: &[Vec<String>]) {
    say(&table(header, rows, terminal_columns()));
}

/// Width of the terminal at standard output; `None` if that is no terminal.
pub(crate) fn terminal_columns() -> Option<usize> {
    let is_terminal = std::io::stdout().is_terminal();
    let size = is_terminal.then(|| ratatui::crossterm::terminal::size().ok()).flatten();
    size.map(|(columns, _)| usize::from(columns))
}

fn table(header: &[&str], rows: &[Vec<String>], columns: Option<usize>) -> String {
    // No word is divided: somebody may want to copy it.
    let longest = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column)).map(String::as_str);
        let words = cells.chain([header[column]]).flat_map(str::split_whitespace);
        words.map(|word| word.chars().count() + GAP).max().unwrap_or(GAP)
    };
    let least: Vec<usize> = (0..header.len()).map(longest).collect();
    if columns.is_some_and(|columns| least.iter().sum::<usize>() > columns) {
        return paragraphs(header, rows);
    }
    let mut table = Table::new();
    table.load_style(NOTHING).set_header(header).add_rows(rows);
    if let Some(columns) = columns {
        let in_cells = |width: usize| u16::try_from(width).unwrap_or(u16::MAX);
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(in_cells(columns));
        let at_least = |width: &usize| ColumnConstraint::LowerBoundary(Width::Fixed(in_cells(*width)));
        table.set_constraints(least.iter().map(at_least));
    }
    for column in table.column_iter_mut() {
        column.set_padding((0, 2));
    }
    table.trim_fmt()
}

/// The cells of each row below each other, with their names; none of what is empty.
fn paragraphs(header: &[&str], rows: &[Vec<String>]) -> String {
    let paragraph = |row: &Vec<String>| {
        let cells = header.iter().copied().zip(row.iter().cloned());
        let told: Vec<_> = cells.filter(|(_, cell)| !cell.is_empty()).collect();
        aligned(&told).collect::<Vec<_>>().join("\n")
    };
    rows.iter().map(paragraph).collect::<Vec<_>>().join("\n\n")
}

/// Prints a line. If the reader closed the pipe, as `head` does, the program continues.
pub(crate) fn say(line: &str) {
    let _gone = writeln!(std::io::stdout().lock(), "{line}");
}

/// Prints the command that a person is likely to want next, as the last line.
pub(crate) fn say_next(what: &str) {
    say(&format!("next: {what}"));
}

/// Writes a long text to standard output. A closed pipe is not an error.
pub(crate) fn write(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// `4 min 05 s`, `12.3 s`.
pub(crate) fn duration(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round();
    let (hours, minutes, rest) = ((whole / 3600.0).floor(), (whole / 60.0).floor() % 60.0, whole % 60.0);
    if hours > 0.0 {
        format!("{hours:.0} h {minutes:02.0} min")
    } else {
        format!("{minutes:.0} min {rest:02.0} s")
    }
}

#[cfg(test)]
#[path = "output_tests.rs"]
mod tests;
