//! Faulty elements.

use std::fmt;

use tactus_calibrate::{FaultKind, FaultyElement};
use tactus_model::Array;

use super::{CalibrationReport, elements::health_map};
use crate::{
    document::{Column, Table},
    numbers::{digits, plural, short},
};

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &CalibrationReport<'_>) -> fmt::Result {
    let (array, health) = (report.array, &report.calibration.health);
    writeln!(
        f,
        "<section>\n<h2>Faulty elements</h2>\n<p class=\"lead\">Found from the elements' readings. Faulty elements are left \
         out of every fit. An element is judged only if a press came near enough to it.</p>\n<div class=\"beside\">\n<div>"
    )?;
    if health.faults.is_empty() {
        writeln!(f, "<p>No fault was found.</p>")?;
    } else {
        writeln!(f, "{}", table(array, &health.faults))?;
    }
    let (faulty, not_judged) = (health.faults.len(), health.not_judged.len());
    let sound = array.elements().saturating_sub(faulty + not_judged);
    writeln!(
        f,
        "<p>{} in all: {sound} sound, {faulty} faulty, {not_judged} not judged.</p>",
        plural(array.elements() as u64, "element")
    )?;
    let crossed = health.faults.iter().any(|fault| matches!(fault.kind, FaultKind::CrossWired { .. }));
    let lines = if crossed {
        " A line goes from a cross-wired element to the one whose signal it gives."
    } else {
        ""
    };
    writeln!(
        f,
        "</div>\n<figure>\n{}\n<figcaption>The array from above, row 0 at the bottom.{lines}</figcaption>\n</figure>\n</div>\n</section>",
        health_map(array, health)
    )
}

/// The faulty elements, each with its evidence.
pub(crate) fn table(array: &Array, faults: &[FaultyElement]) -> Table<'static> {
    let mut table = Table::new(&[
        Column::Number("element"),
        Column::Name("(row, col)"),
        Column::Name("fault"),
        Column::Prose("evidence"),
    ]);
    for fault in faults {
        let kind = kind(array, fault.kind);
        table.row([fault.element.to_string(), place(array, fault.element), kind, fault.evidence.clone()]);
    }
    table
}

/// `(row, col)` of an element.
pub(super) fn place(array: &Array, element: usize) -> String {
    format!("({}, {})", element / array.cols(), element % array.cols())
}

/// A fault in a few words.
pub(super) fn kind(array: &Array, kind: FaultKind) -> String {
    match kind {
        FaultKind::Dead => "dead".into(),
        FaultKind::Stuck { counts } => format!("stuck at {}", short(counts, 3)),
        FaultKind::CrossWired { answers_for } => {
            format!("cross-wired to {answers_for} {}", place(array, answers_for))
        }
        FaultKind::Noisy { rms_counts } => format!("noisy, {} counts rms", digits(rms_counts, 3)),
    }
}
