//! Registration: position and rotation of the sensor in the robot's frame.

use std::fmt;

use tactus_calibrate::{Estimate, RegistrationFit};
use tactus_model::Covering;

use super::CalibrationReport;
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::{count, difference, estimate, interval, short},
    plot::number,
};

/// Left-out presses that are named at most.
const NAMED_MAX: usize = 12;

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &CalibrationReport<'_>) -> fmt::Result {
    writeln!(
        f,
        "<section>\n<h2>Registration</h2>\n<p class=\"lead\">The sensor frame in the robot's frame, fitted to presses at \
         several places jointly with the elements' sensitivities and the spread. The scale is a check: it comes from a second fit \
         and is not used; it should be 1.</p>"
    )?;
    match &report.calibration.registration {
        None => writeln!(
            f,
            "<p>Not determined. All later steps use the declared registration and treat it as exact.</p>"
        )?,
        Some(registration) => found(f, report, registration)?,
    }
    writeln!(f, "</section>")
}

fn found(
    f: &mut fmt::Formatter<'_>,
    report: &CalibrationReport<'_>,
    registration: &RegistrationFit,
) -> fmt::Result {
    let declared = report.declared_registration;
    let spread_mm = report.declared_psf.sigma_mm(Covering { thickness_mm: registration.covering_mm });
    let [x, y] = registration.origin_mm;
    let mut table = Table::new(&[
        Column::Name("quantity"),
        Column::Number("declared"),
        Column::Number("found"),
        Column::Number("95 % interval"),
        Column::Number("found \u{2212} declared"),
    ]);
    for (quantity, declared, found) in [
        ("origin x / mm", declared.origin_mm[0], Some(x)),
        ("origin y / mm", declared.origin_mm[1], Some(y)),
        ("rotation / \u{b0}", declared.rotation_deg, registration.rotation_deg),
        ("height of the surface / mm", 0.0, registration.surface_mm),
        ("scale (check)", 1.0, registration.scale),
        ("spread \u{3c3} of the covering in place / mm", spread_mm, Some(registration.sigma_mm)),
    ] {
        table.row(row(quantity, declared, found));
    }
    writeln!(f, "{table}")?;
    let runs: Vec<String> =
        registration.runs.iter().map(|run| format!("<code>{}</code>", Text(run))).collect();
    writeln!(
        f,
        "<p>From {} presses of {} under the covering of {} mm. The residuals are {} times the noise: 1 if the model holds.</p>",
        count(registration.presses as u64),
        runs.join(", "),
        short(registration.covering_mm, 3),
        number(registration.residual_in_noise, 2),
    )?;
    left_out(f, &registration.left_out)
}

fn row(quantity: &str, declared: f64, found: Option<Estimate>) -> [String; 5] {
    let declared_text = short(declared, 6);
    match found {
        None => [quantity.into(), declared_text, "not determined".into(), String::new(), String::new()],
        Some(found) => [
            quantity.into(),
            declared_text,
            estimate(&found),
            interval(&found),
            difference(found.value - declared, found.standard_error),
        ],
    }
}

fn left_out(f: &mut fmt::Formatter<'_>, presses: &[(String, i32)]) -> fmt::Result {
    if presses.is_empty() {
        return Ok(());
    }
    let named: Vec<String> = presses[..presses.len().min(NAMED_MAX)]
        .chunk_by(|(run, _), (next, _)| run == next)
        .map(|of_run| {
            let indices: Vec<String> = of_run.iter().map(|(_, press)| press.to_string()).collect();
            format!("{} of {}", indices.join(", "), Text(&of_run[0].0))
        })
        .collect();
    let more = presses.len().saturating_sub(NAMED_MAX);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    writeln!(f, "<p>Left out, because they contradict the others: press {}{more}.</p>", named.join("; "))
}
