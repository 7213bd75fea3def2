//! Output for people: aligned tables and durations.

use std::fmt::Write as _;
use std::io::{ErrorKind, IsTerminal as _, Write as _};

/// Prints `name  value` lines with the values aligned.
pub(crate) fn print_fields(fields: &[(&str, String)]) {
    let width = fields.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    for (name, value) in fields {
        say(&format!("{name:width$}  {value}"));
    }
}

/// Prints a table with a header, columns aligned to their widest cell.
pub(crate) fn print_table(header: &[&str], rows: &[Vec<String>]) {
    for line in table(header, rows) {
        say(&line);
    }
}

/// As [`print_table`], with lines that end at the edge of the terminal: the last column gives way.
pub(crate) fn print_table_cut(header: &[&str], rows: &[Vec<String>]) {
    let is_terminal = std::io::stdout().is_terminal();
    let size = is_terminal.then(|| ratatui::crossterm::terminal::size().ok()).flatten();
    let width = size.map_or(usize::MAX, |(columns, _)| usize::from(columns).max(1));
    for line in table(header, rows) {
        say(&cut(&line, width));
    }
}

/// A line of at most so many characters; an ellipsis says that something is missing.
fn cut(line: &str, width: usize) -> String {
    if line.chars().count() <= width {
        return line.to_owned();
    }
    line.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

fn table(header: &[&str], rows: &[Vec<String>]) -> Vec<String> {
    let mut widths: Vec<_> = header.iter().map(|cell| cell.chars().count()).collect();
    for row in rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut line = String::new();
        for (cell, width) in cells.zip(&widths) {
            // Writing to a string cannot fail.
            let _written = write!(line, "{cell:width$}  ");
        }
        line.trim_end().to_owned()
    };
    let header = line(&mut header.iter().copied());
    [header].into_iter().chain(rows.iter().map(|row| line(&mut row.iter().map(String::as_str)))).collect()
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
