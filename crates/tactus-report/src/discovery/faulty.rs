//! Elements that were found faulty before anything was fitted.

use std::fmt;

use tactus_discover::{Discovery, FaultKind};

use super::{DiscoveryReport, words::list};
use crate::calibration::health::table;

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let faulty = &report.discovery.faulty;
    if faulty.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "<section>\n<h2>Faulty elements</h2>\n<p class=\"lead\">Found from the elements' readings, as in a calibration, before anything was \
         fitted. Dead, stuck and noisy elements have no weight in any fit, test or figure of this page, except in those of miswired. A \
         cross-wired element is in the base model with the signal that it gives.</p>\n{}</section>",
        table(report.array, faulty)
    )
}

/// Such as `Faulty: elements 5 and 39 are dead and element 18 answers for 19.`; nothing without faults. Those that only the fit found are
/// among them.
pub(super) fn in_words(found: &Discovery) -> Option<String> {
    let of = |what: &str, is: fn(FaultKind) -> bool| {
        let elements = found.faulty.iter().filter(|one| is(one.kind)).map(|one| one.element.to_string());
        let elements: Vec<String> = elements.collect();
        let said = match elements.len() {
            0 => return None,
            1 => format!("element {} is {what}", elements[0]),
            _ => format!("elements {} are {what}", list(elements)),
        };
        Some(said)
    };
    let silent = [
        of("dead", |kind| matches!(kind, FaultKind::Dead)),
        of("stuck", |kind| matches!(kind, FaultKind::Stuck { .. })),
        of("noisy", |kind| matches!(kind, FaultKind::Noisy { .. })),
    ];
    let crossed = found.faulty.iter().filter_map(|one| match one.kind {
        FaultKind::CrossWired { answers_for } => {
            Some(format!("element {} answers for {answers_for}", one.element))
        }
        FaultKind::Dead | FaultKind::Stuck { .. } | FaultKind::Noisy { .. } => None,
    });
    let is_told =
        |element: f64| found.faulty.iter().any(|one| (one.element as f64).total_cmp(&element).is_eq());
    let fitted = found.steps.iter().filter(|step| step.effect == "miswired").flat_map(|step| &step.terms);
    let fitted = fitted.filter_map(|term| {
        let of = |name: &str| term.iter().find(|one| one.name == name).map(|one| one.value);
        let element = of("element").filter(|element| !is_told(*element))?;
        Some(of("answers_for").map_or_else(
            || format!("element {element} does not give its own signal (the presses do not tell whose)"),
            |answers_for| format!("element {element} answers for {answers_for}"),
        ))
    });
    let all: Vec<String> = silent.into_iter().flatten().chain(crossed).chain(fitted).collect();
    (!all.is_empty()).then(|| format!("Faulty: {}.", list(all)))
}
