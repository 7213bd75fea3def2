//! The report of a study, which repeats the paper on one rig.
//!
//! [`study_html`] makes one page: a table of all quantities with the paper's values, all figures in the paper's order,
//! and the details of the calibration.

use std::fmt;

use tactus_calibrate::Estimate;

use crate::{
    calibration::{self, CalibrationReport, Drawing, FigurePlacement},
    document::{Column, SIMULATED_BADGE, SIMULATED_NOTICE, Table, document, notes},
    markup::Text,
    numbers::{count, duration, estimate, interval, plural, short},
};

/// The results of a study.
#[derive(Debug, Clone, Copy)]
pub struct StudyReport<'a> {
    /// The rig's name.
    pub rig: &'a str,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// The runs in order of time.
    pub runs: &'a [StudyRun],
    /// The compared quantities in the paper's order.
    pub quantities: &'a [ComparedQuantity],
    /// The calibration, if there is one. Its Figures 2a, 2b, 5a and 5b are shown among the others.
    pub calibration: Option<CalibrationReport<'a>>,
    /// The other figures, in any order.
    pub figures: &'a [StudyFigure],
    /// Sentences about what could not be done, and what it would take.
    pub missing: &'a [String],
    /// Sentences to read before using a number.
    pub warnings: &'a [String],
}

/// One run of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRun {
    /// Name of the step.
    pub name: String,
    /// Its id.
    pub run_id: String,
    /// Number of completed presses.
    pub presses: u64,
    /// Duration by the rig's clock.
    pub duration_s: f64,
    /// Path of its recording.
    pub path: String,
}

/// One quantity: the paper's value and this rig's.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedQuantity {
    /// Name of the quantity.
    pub quantity: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// The paper's value in words.
    pub paper: Option<String>,
    /// This rig's value.
    pub found: FoundValue,
    /// True value; known for simulated rigs only.
    pub truth: Option<f64>,
    /// Whether the truth lies inside the 95 % interval.
    pub inside: Option<bool>,
    /// A remark; may be empty.
    pub note: String,
}

/// This rig's value of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum FoundValue {
    /// A number with its standard error.
    Estimate(Estimate),
    /// A result without a standard error, in words.
    Text(String),
    /// Not determined; the quantity's note says why.
    Nothing,
}

/// A finished figure.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyFigure {
    /// Number in the paper, such as `3a`. Figures with an empty number come last.
    pub number: String,
    /// What it shows.
    pub title: String,
    /// Text below the figure.
    pub caption: String,
    /// SVG text of a [`Sheet`](crate::plot::Sheet). It is not escaped.
    pub svg: String,
}

/// Makes the page of a study: HTML with its style and figures inline.
///
/// All text is escaped, except that the figures' SVG is trusted; nothing is loaded.
pub fn study_html(report: &StudyReport<'_>) -> String {
    let page = fmt::from_fn(|f| {
        header(f, report)?;
        notes(f, "Could not be done", report.missing)?;
        notes(f, "To know before using a number", report.warnings)?;
        comparison(f, report)?;
        runs(f, report.runs)?;
        figures(f, report)?;
        details(f, report)
    });
    document(format!("Study \u{b7} {}", report.rig), page)
}

fn header(f: &mut fmt::Formatter<'_>, report: &StudyReport<'_>) -> fmt::Result {
    let (badge, unreal) = if report.simulated { (SIMULATED_BADGE, SIMULATED_NOTICE) } else { ("", "") };
    let presses: u64 = report.runs.iter().map(|run| run.presses).sum();
    let seconds: f64 = report.runs.iter().map(|run| run.duration_s).sum();
    writeln!(
        f,
        "<header>\n<div class=\"headline\"><h1>The paper repeated on one rig</h1>{badge}</div>\n<p class=\"under\">Rig {} &#183; {}, {} presses, \
         {} by the rig's clock &#183; after <cite>Characterization and Simulation of Tactile Sensors</cite></p>\n{unreal}\n</header>",
        Text(report.rig),
        plural(report.runs.len() as u64, "run"),
        count(presses),
        duration(seconds),
    )
}

fn comparison(f: &mut fmt::Formatter<'_>, report: &StudyReport<'_>) -> fmt::Result {
    writeln!(
        f,
        "<section>\n<h2>Every quantity</h2>\n<p class=\"lead\">After &#177;: standard error. Intervals are 95 % intervals.{}</p>",
        if report.simulated { " The truth is a parameter of the simulated rig." } else { "" }
    )?;
    if report.quantities.is_empty() {
        return writeln!(f, "<p>Nothing was found.</p>\n</section>");
    }
    let truths = report.quantities.iter().any(|row| row.truth.is_some());
    let truth_head = if truths { "<th class=\"n\">truth</th>" } else { "" };
    writeln!(
        f,
        "<div class=\"scroll\"><table class=\"numbers\">\n<thead><tr><th>quantity</th><th class=\"n\">paper</th><th class=\"n\">this rig</th>\
         <th class=\"n\">95 % interval</th>{truth_head}<th>inside</th></tr></thead>\n<tbody>"
    )?;
    report.quantities.iter().try_for_each(|row| compared(f, row, truths))?;
    writeln!(f, "</tbody></table></div>")?;
    let judged = report.quantities.iter().filter(|row| row.truth.is_some()).filter_map(|row| row.inside);
    let (inside, all) = judged.fold((0, 0), |(inside, all), one| (inside + u64::from(one), all + 1));
    if all > 0 {
        writeln!(
            f,
            "<p>{} of {} known truths lie inside their intervals; 95 % are expected to.</p>",
            count(inside),
            count(all)
        )?;
    }
    writeln!(f, "</section>")
}

fn compared(f: &mut fmt::Formatter<'_>, row: &ComparedQuantity, truths: bool) -> fmt::Result {
    let (found, range) = match &row.found {
        FoundValue::Estimate(found) => (estimate(found), interval(found)),
        FoundValue::Text(text) => (text.clone(), String::new()),
        FoundValue::Nothing => ("not determined".into(), String::new()),
    };
    let unit = if row.unit.is_empty() { String::new() } else { format!(" / {}", row.unit) };
    write!(
        f,
        "<tr><td class=\"prose\">{}{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>",
        Text(&row.quantity),
        Text(unit),
        Text(row.paper.as_deref().unwrap_or("\u{2013}")),
        Text(found),
        Text(range)
    )?;
    if truths {
        write!(
            f,
            "<td class=\"n\">{}</td>",
            row.truth.map_or_else(|| "\u{2013}".into(), |truth| short(truth, 6))
        )?;
    }
    let (word, class) = match row.inside {
        Some(true) => ("yes", "good"),
        Some(false) => ("no", "bad"),
        None => ("", ""),
    };
    writeln!(f, "<td class=\"{class}\">{word}</td></tr>")?;
    if row.note.is_empty() {
        return Ok(());
    }
    let columns = if truths { 6 } else { 5 };
    writeln!(
        f,
        "<tr class=\"under\"><td colspan=\"{columns}\" class=\"prose note\">{}</td></tr>",
        Text(&row.note)
    )
}

fn runs(f: &mut fmt::Formatter<'_>, runs: &[StudyRun]) -> fmt::Result {
    writeln!(f, "<section>\n<h2>Runs</h2>")?;
    if runs.is_empty() {
        return writeln!(f, "<p>No run was made.</p>\n</section>");
    }
    let mut table = Table::new(&[
        Column::Name("experiment"),
        Column::Name("run"),
        Column::Number("presses"),
        Column::Number("duration"),
        Column::Prose("recording"),
    ]);
    for run in runs {
        let (presses, duration) = (count(run.presses), duration(run.duration_s));
        table.row([&run.name, &run.run_id, &presses, &duration, &run.path]);
    }
    writeln!(f, "{table}</section>")
}

fn figures(f: &mut fmt::Formatter<'_>, report: &StudyReport<'_>) -> fmt::Result {
    let measured = report.calibration.iter().flat_map(calibration::drawings).map(StudyFigure::from);
    let mut figures: Vec<StudyFigure> = measured.chain(report.figures.iter().cloned()).collect();
    // Stable: figures with the same number keep their order.
    figures.sort_by_cached_key(|figure| place(&figure.number));
    for StudyFigure { number, title, caption, svg } in figures {
        let number = if number.is_empty() { String::new() } else { format!("Figure {number}. ") };
        writeln!(
            f,
            "<section>\n<h2>{}{}</h2>\n<p class=\"lead\">{}</p>\n{svg}\n</section>",
            Text(number),
            Text(title),
            Text(caption)
        )?;
    }
    Ok(())
}

/// Sort key of a figure: its number, then its letter.
fn place(number: &str) -> (u32, String) {
    let digits = number.len() - number.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    (number[..digits].parse().unwrap_or(u32::MAX), number[digits..].to_owned())
}

fn details(f: &mut fmt::Formatter<'_>, report: &StudyReport<'_>) -> fmt::Result {
    writeln!(f, "<section>\n<h1>The calibration</h1>")?;
    match &report.calibration {
        None => writeln!(f, "<p>There is no calibration.</p>\n</section>"),
        Some(calibration) => {
            calibration::basis(f, calibration)?;
            calibration::remarks(f, calibration)?;
            writeln!(f, "</section>")?;
            calibration::sections(f, calibration, FigurePlacement::Elsewhere)
        }
    }
}

impl From<Drawing> for StudyFigure {
    fn from(drawing: Drawing) -> Self {
        let Drawing { number, title, caption, sheet } = drawing;
        Self { number: number.into(), title: title.into(), caption, svg: sheet.to_string() }
    }
}
