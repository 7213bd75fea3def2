//! The HTML page of a run's report.

mod comparisons;
mod images;
mod response;
mod summary;
mod time;

use std::fmt;

use crate::{
    document::{document, notes},
    markup::Text,
    plot,
    run::RunReport,
};

/// Width of the page's content.
const WIDTH_PX: f64 = 1080.0;

/// Lines of the event log that are shown at most.
const EVENTS_MAX: usize = 1500;

/// Makes the report's page: HTML with its style and figures inline.
///
/// Text from the recording is escaped. The page has no script and loads nothing.
pub fn render_html(report: &RunReport) -> String {
    let title = format!("{} \u{b7} {}", report.summary.experiment, report.summary.run_id);
    document(title, fmt::from_fn(|f| body(f, report)))
}

/// An element as reports name it: `element 18 (2, 2)`, with its row and column.
struct Element(usize, usize);

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(element, cols) = self;
        write!(f, "element {element} ({}, {})", element / cols, element % cols)
    }
}

fn body(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    summary::header(f, &report.summary)?;
    notes(f, "", &report.notes)?;
    summary::facts(f, report)?;
    if let Some(response) = &report.response {
        response::section(f, response, &report.array)?;
    }
    comparisons::sections(f, report)?;
    images::section(f, report)?;
    time::signal(f, report)?;
    time::losses(f, report)?;
    time::timing(f, &report.timing)?;
    events(f, report)
}

fn events(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    let all = report.events.len();
    let routine = all <= EVENTS_MAX;
    let shown: Vec<_> =
        report.events.iter().filter(|event| routine || !event.routine).take(EVENTS_MAX).collect();
    writeln!(f, "<section>\n<details>\n<summary><h2>Event log</h2> {all} events</summary>")?;
    if shown.len() < all {
        let left_out = if routine { "" } else { "; steps, phases, dwells and reads are left out" };
        writeln!(f, "<p>{} of {all} events are shown{left_out}.</p>", shown.len())?;
    }
    writeln!(f, "<table class=\"log\">\n<tr><th class=\"n\">time / s</th><th>event</th><th></th></tr>")?;
    for event in shown {
        let time = plot::number(event.at_s, 3);
        let class = if event.routine { "" } else { " class=\"notable\"" };
        writeln!(
            f,
            "<tr{class}><td class=\"n\">{time}</td><td>{}</td><td>{}</td></tr>",
            Text(event.kind),
            Text(event.detail.trim_end())
        )?;
    }
    writeln!(f, "</table>\n</details>\n</section>")
}
