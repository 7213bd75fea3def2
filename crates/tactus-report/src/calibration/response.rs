//! Responses of the elements.

use std::fmt;

use tactus_calibrate::{Estimate, ResponseFit, ResponseForm};

use super::{
    CalibrationReport, Drawing, FigurePlacement,
    elements::sensitivity_map,
    figure,
    figures::{decided, one_sign, recalibrated, responses, scatter_counts, uniform_counts_per_mm},
    health,
};
use crate::{
    document::{Column, Table},
    numbers::{digits, estimate, interval, plural, with_error},
    plot::number,
};

pub(super) fn drawings(response: &ResponseFit) -> [Drawing; 2] {
    let fits = match (one_sign(response), decided(response)) {
        (true, true) => {
            "The solid red line is the mean of the elements' linear fits, the dashed blue line that of their parabolas."
        }
        (true, false) => {
            "The solid red line is the mean of the elements' linear fits; depths are too few for parabolas."
        }
        (false, _) => "The sensitivities have both signs: no mean is drawn.",
    };
    let scatter = scatter_counts(response).map_or_else(String::new, |[before, after]| {
        format!(
            " The distance of the readings from one line for all is {} counts rms before and {} counts after.",
            digits(before, 3),
            digits(after, 3)
        )
    });
    [
        Drawing {
            number: "2a",
            title: "Response of the elements",
            caption: format!(
                "Dotted: each element's rise above rest in presses near its own centre. A point is one dwell, plotted against the indentation of \
                 an equal press exactly on the centre. {fits}"
            ),
            sheet: responses(response),
        },
        Drawing {
            number: "2b",
            title: "Responses made uniform",
            caption: format!(
                "The same readings, converted to indentation by each element's own response ({}) and scaled by the mean \
                 sensitivity of {} counts/mm.{scatter}",
                response.form.name(),
                digits(uniform_counts_per_mm(response), 4),
            ),
            sheet: recalibrated(response),
        },
    ]
}

pub(super) fn section(
    f: &mut fmt::Formatter<'_>,
    report: &CalibrationReport<'_>,
    figures: FigurePlacement,
) -> fmt::Result {
    writeln!(
        f,
        "<section>\n<h2>Response of the elements</h2>\n<p class=\"lead\">Rise of each sound element above its rest, in presses near its \
         centre with the reference tool under the reference covering, against indentation u: s u, or s (u + k u&#178;).</p>"
    )?;
    match &report.calibration.response {
        None => writeln!(f, "<p>Not determined.</p>")?,
        Some(response) => {
            if figures == FigurePlacement::Inline {
                writeln!(f, "<div class=\"pair\">")?;
                drawings(response).iter().try_for_each(|drawing| figure(f, drawing))?;
                writeln!(f, "</div>")?;
            }
            writeln!(f, "<div class=\"pair\">\n<div>")?;
            forms(f, response)?;
            sensitivities(f, report, response)?;
            writeln!(
                f,
                "</div>\n<figure>\n{}\n<figcaption>Sensitivity of each element, row 0 at the bottom; blank where none was \
                 fitted.</figcaption>\n</figure>\n</div>",
                sensitivity_map(report.array, response)
            )?;
        }
    }
    elements(f, report)?;
    writeln!(f, "</section>")
}

/// Comparison of the response forms.
fn forms(f: &mut fmt::Formatter<'_>, response: &ResponseFit) -> fmt::Result {
    let mut table = Table::new(&[
        Column::Name("form"),
        Column::Number("rms / counts"),
        Column::Number("held out / counts"),
        Column::Name(""),
    ]);
    for trial in &response.trials {
        let heldout = trial.heldout_rms_counts.map_or_else(|| "\u{2013}".into(), |rms| digits(rms, 3));
        let wanted = match (trial.form == response.form, decided(response)) {
            (true, true) => "chosen",
            (true, false) => "default",
            (false, _) => "",
        };
        table.row([trial.form.name().to_owned(), digits(trial.rms_counts, 3), heldout, wanted.into()]);
    }
    writeln!(f, "{table}")?;
    if decided(response) {
        writeln!(
            f,
            "<p>Root mean square of the residuals; held out: each fifth of the dwells is predicted from the others. A form with more parameters is chosen if it beats the one before \
             by two standard errors over the elements.</p>"
        )
    } else {
        writeln!(
            f,
            "<p>There are too few depths to hold any out. The data do not determine the form; a line is used.</p>"
        )
    }
}

fn sensitivities(
    f: &mut fmt::Formatter<'_>,
    report: &CalibrationReport<'_>,
    response: &ResponseFit,
) -> fmt::Result {
    let values: Vec<f64> = response.elements.iter().map(|one| one.sensitivity_counts_per_mm.value).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviation = (values.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    let by_value = |one: &&tactus_calibrate::ElementResponse, other: &&tactus_calibrate::ElementResponse| {
        one.sensitivity_counts_per_mm.value.total_cmp(&other.sensitivity_counts_per_mm.value)
    };
    let least = response.elements.iter().min_by(by_value);
    let most = response.elements.iter().max_by(by_value);
    let (Some(least), Some(most)) = (least, most) else {
        return writeln!(f, "<p>No element was fitted.</p>");
    };
    let over = if values.len() > 1 {
        let share = if one_sign(response) {
            format!(" ({} %)", number(100.0 * deviation / mean.abs(), 1))
        } else {
            String::new()
        };
        format!(", mean {}, standard deviation {}{share}", digits(mean, 4), digits(deviation, 2))
    } else {
        String::new()
    };
    writeln!(
        f,
        "<p>Sensitivities s in counts/mm of {}{over}: from {} at {} to {} at {}.</p>",
        plural(values.len() as u64, "element"),
        estimate(&least.sensitivity_counts_per_mm),
        health::place(report.array, least.element),
        estimate(&most.sensitivity_counts_per_mm),
        health::place(report.array, most.element),
    )?;
    match (response.form, &response.shared_quadratic_per_mm) {
        (ResponseForm::SharedQuadratic, Some(curvature)) => writeln!(
            f,
            "<p>Curvature k of all elements: {} per mm (95 % interval {}).</p>",
            estimate(curvature),
            interval(curvature)
        ),
        _ => Ok(()),
    }
}

/// A collapsed table of every element.
fn elements(f: &mut fmt::Formatter<'_>, report: &CalibrationReport<'_>) -> fmt::Result {
    let (array, calibration) = (report.array, report.calibration);
    let mut table = Table::new(&[
        Column::Number("element"),
        Column::Name("(row, col)"),
        Column::Name("health"),
        Column::Number("at rest / counts"),
        Column::Number("s / (counts/mm)"),
        Column::Number("k / (1/mm)"),
        Column::Number("linear s / (counts/mm)"),
        Column::Number("own k / (1/mm)"),
        Column::Number("dwells"),
    ]);
    let response = calibration.response.as_ref();
    for element in 0..array.elements() {
        let fault = calibration.health.faults.iter().find(|fault| fault.element == element);
        let health = match fault {
            Some(fault) => health::kind(array, fault.kind),
            None if calibration.health.not_judged.contains(&element) => "not judged".into(),
            None => "sound".into(),
        };
        let rest = calibration.baseline_counts.get(element).copied().flatten();
        let fitted =
            response.and_then(|response| response.elements.iter().find(|one| one.element == element));
        let of = |found: Option<Estimate>| found.map_or_else(|| "\u{2013}".into(), |found| estimate(&found));
        let own = fitted.and_then(|one| one.quadratic).filter(|_| response.is_some_and(decided));
        let curvature =
            fitted.filter(|_| response.is_some_and(|response| response.form != ResponseForm::Linear));
        table.row([
            element.to_string(),
            health::place(array, element),
            health,
            rest.map_or_else(|| "\u{2013}".into(), |rest| with_error(rest.value, rest.standard_error)),
            of(fitted.map(|one| one.sensitivity_counts_per_mm)),
            of(curvature.map(|one| one.quadratic_per_mm)),
            of(fitted.map(|one| one.linear_counts_per_mm)),
            of(own.map(|[_, k]| k)),
            fitted.map_or_else(|| "0".into(), |one| one.points.len().to_string()),
        ]);
    }
    writeln!(
        f,
        "<details>\n<summary><h3>Every element</h3> {}</summary>\n<p class=\"lead\">After &#177;: standard error; at rest, the scatter between \
         rests.</p>\n{table}</details>",
        plural(array.elements() as u64, "element")
    )
}
