//! The HTML document of every page, with inline style, and the parts that pages share.

mod contents;

use std::fmt;

use tactus_model::Array;

use crate::{
    markup::Text,
    numbers::{plural, short},
    plot,
};

/// Marks pages of simulated data.
pub(crate) const SIMULATED_BADGE: &str =
    "<span class=\"badge warn\" title=\"No physical sensor was read.\">SIMULATED</span>";

/// States in words that the data are simulated.
pub(crate) const SIMULATED_NOTICE: &str = "<p class=\"message warn\"><strong>No physical sensor was read: all data on this page are \
                                 simulated.</strong></p>";

/// The header of a page about one sensor. `about` is HTML and stands before the rig's name.
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

/// A complete page. The title is escaped; `body` is HTML. If it has many sections, their list stands below its header.
pub(crate) fn document(title: impl fmt::Display, body: impl fmt::Display) -> String {
    let body = contents::listed(body.to_string());
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

/// A highlighted list of sentences under a heading, which may be empty; nothing for an empty list.
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

/// A table that displays itself as HTML. Cells are escaped.
pub(crate) struct Table<'a> {
    columns: &'a [Column],
    /// Escaped cells.
    rows: Vec<Vec<String>>,
}

/// Heading and kind of a column.
#[derive(Clone, Copy)]
pub(crate) enum Column {
    /// A few words on one line.
    Name(&'static str),
    /// A right-aligned number.
    Number(&'static str),
    /// Text that may wrap.
    Prose(&'static str),
}

impl<'a> Table<'a> {
    pub(crate) fn new(columns: &'a [Column]) -> Self {
        Self { columns, rows: Vec::new() }
    }

    /// Appends a row with one cell per column.
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
