//! The frame of every page, and what pages are made of: one HTML document, its style inline, that loads nothing.

use std::fmt;

use tactus_model::Array;

use crate::{
    markup::Text,
    numbers::{plural, short},
    plot,
};

/// Said of whatever no physical sensor was read for.
pub(crate) const SIMULATED_BADGE: &str =
    "<span class=\"badge warn\" title=\"No physical sensor was read.\">SIMULATED</span>";

/// The same as the badge, in words.
pub(crate) const SIMULATED_NOTICE: &str = "<p class=\"message warn\"><strong>No physical sensor was read: everything on this page is about \
                                 a simulated one.</strong></p>";

/// The head of a page about one sensor: what it is, `about` before the rig's name (markup), and which array.
pub(crate) fn sensor_header(
    f: &mut fmt::Formatter<'_>,
    title: &str,
    about: &str,
    rig: &str,
    array: &Array,
    simulated: bool,
) -> fmt::Result {
    writeln!(f, "<header>\n<div class=\"headline\"><h1>{title}</h1>")?;
    if simulated {
        writeln!(f, "{SIMULATED_BADGE}")?;
    }
    writeln!(
        f,
        "</div>\n<p class=\"under\">{about} {} &#183; {}, {} of {} elements, {} mm apart</p>",
        Text(rig),
        Text(array.name()),
        plural(array.rows() as u64, "row"),
        array.cols(),
        short(array.pitch_mm(), 3),
    )?;
    if simulated {
        writeln!(f, "{SIMULATED_NOTICE}")?;
    }
    writeln!(f, "</header>")
}

/// A page of markup under a title, which is escaped.
pub(crate) fn document(title: impl fmt::Display, body: impl fmt::Display) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <title>{}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        Text(title),
        plot::STYLE,
        include_str!("document.css"),
    )
}

/// Sentences that must not be overlooked, under a heading if there is one; nothing without any.
pub(crate) fn notes(f: &mut fmt::Formatter<'_>, heading: &str, notes: &[String]) -> fmt::Result {
    if notes.is_empty() {
        return Ok(());
    }
    f.write_str("<div class=\"notes\">\n")?;
    if !heading.is_empty() {
        writeln!(f, "<h2>{heading}</h2>")?;
    }
    writeln!(f, "<ul>")?;
    for note in notes {
        writeln!(f, "<li>{}</li>", Text(note))?;
    }
    writeln!(f, "</ul>\n</div>")
}

/// A table, row by row; displays itself as HTML. What stands in it is escaped.
pub(crate) struct Table<'a> {
    columns: &'a [Column],
    /// Cells, escaped.
    rows: Vec<Vec<String>>,
}

/// A column's head, and what stands below it.
#[derive(Clone, Copy)]
pub(crate) enum Column {
    /// A word or two, never broken.
    Name(&'static str),
    /// A number.
    Number(&'static str),
    /// As many lines as it takes.
    Prose(&'static str),
}

impl<'a> Table<'a> {
    pub(crate) fn new(columns: &'a [Column]) -> Self {
        Self { columns, rows: Vec::new() }
    }

    /// One more row, below those before; one cell a column.
    pub(crate) fn row<T: fmt::Display>(&mut self, cells: impl IntoIterator<Item = T>) {
        self.rows.push(cells.into_iter().map(|cell| Text(cell).to_string()).collect());
    }
}

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("<div class=\"scroll\"><table class=\"numbers\">\n<thead><tr>")?;
        for column in self.columns {
            let (Column::Name(head) | Column::Number(head) | Column::Prose(head)) = column;
            write!(f, "<th{}>{}</th>", column.class(), Text(head))?;
        }
        writeln!(f, "</tr></thead>\n<tbody>")?;
        for row in &self.rows {
            f.write_str("<tr>")?;
            for (column, cell) in self.columns.iter().zip(row) {
                write!(f, "<td{}>{cell}</td>", column.class())?;
            }
            writeln!(f, "</tr>")?;
        }
        writeln!(f, "</tbody></table></div>")
    }
}

impl Column {
    fn class(self) -> &'static str {
        match self {
            Self::Name(_) => "",
            Self::Number(_) => " class=\"n\"",
            Self::Prose(_) => " class=\"prose\"",
        }
    }
}

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;
