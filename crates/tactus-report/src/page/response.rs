//! The response curves and the polynomials fitted to their mean: Fig. 2a of the paper.

use std::fmt;

use tactus_model::Array;

use crate::{
    fit::{Coefficient, Polynomial},
    markup::Text,
    numbers::{count, plural, with_error},
    plot::{Axis, ElementNumbers, Figure, HeatMap, Image, Ink, Scale, Series, Sheet, number},
    run::{RespondsTo, ResponseCurves},
};

/// Points along a fitted curve.
const CURVE_POINTS: u32 = 60;
/// Width of the array in the map of slopes.
const MAP_PX: f64 = 300.0;

pub(super) fn section(f: &mut fmt::Formatter<'_>, response: &ResponseCurves, array: &Array) -> fmt::Result {
    writeln!(f, "<section>\n<h2>Response of the elements</h2>")?;
    writeln!(
        f,
        "<p class=\"lead\">Reading of each element above the baseline, in presses at its own centre. Each point is the mean of one dwell. The polynomials are fitted to the mean of the curves.</p>"
    )?;
    writeln!(f, "<div class=\"beside\">\n<div>{}</div>\n<div>", figure(response))?;
    if let (Some(first), Some(last)) = (response.mean.first(), response.mean.last()) {
        writeln!(
            f,
            "<p>{} of {}; the mean rises from {} to {} counts between {:.3} and {:.3} mm.</p>",
            plural(response.curves.len() as u64, "curve"),
            plural(elements(response) as u64, "element"),
            number(first[1], 1),
            number(last[1], 1),
            first[0],
            last[0],
        )?;
    }
    unresponsive(f, response, array)?;
    spread(f, response)?;
    slopes(f, response, array)?;
    writeln!(f, "</div>\n</div>")?;
    table(f, response)?;
    writeln!(f, "</section>")
}

fn figure(response: &ResponseCurves) -> Figure {
    let x = Axis::new("indentation", "mm").from_zero();
    let y = Axis::new("response above baseline", "counts").from_zero();
    let mut figure =
        Figure::new("Response of every element against indentation, with fits", x, y).size_px([680.0, 440.0]);
    for (nth, curve) in response.curves.iter().enumerate() {
        let series = Series::line(curve.points.clone()).dotted().width_px(1.0).opacity(0.75);
        figure = figure.with(if nth == 0 { series.label("single elements") } else { series });
    }
    if let Some(line) = &response.linear {
        figure =
            figure.with(Series::line(along(line, response)).ink(Ink::Red).width_px(2.2).label("linear fit"));
    }
    if let Some(parabola) = &response.quadratic {
        let series = Series::line(along(parabola, response)).ink(Ink::Blue).dashed().width_px(2.2);
        figure = figure.with(series.label("quadratic fit"));
    }
    figure.with(Series::dots(response.mean.clone()).width_px(6.0).label("mean"))
}

/// A fitted curve over the range of depths.
fn along(fit: &Polynomial, response: &ResponseCurves) -> Vec<[f64; 2]> {
    let (Some([from, _]), Some([to, _])) = (response.mean.first(), response.mean.last()) else {
        return Vec::new();
    };
    let at = |step: u32| from + (to - from) * f64::from(step) / f64::from(CURVE_POINTS);
    (0..=CURVE_POINTS).map(|step| [at(step), fit.at(at(step))]).collect()
}

fn elements(response: &ResponseCurves) -> usize {
    let distinct: std::collections::BTreeSet<usize> =
        response.curves.iter().map(|curve| curve.element).collect();
    distinct.len()
}

fn unresponsive(f: &mut fmt::Formatter<'_>, response: &ResponseCurves, array: &Array) -> fmt::Result {
    if elements(response) < 2 && response.unresponsive.is_empty() {
        return Ok(());
    }
    untold(f, response)?;
    if response.unresponsive.is_empty() {
        let told = (elements(response) - response.untold.len()) as u64;
        let (all, unpressed) = (array.elements() as u64, (array.elements() - elements(response)) as u64);
        return match (told, unpressed) {
            (0, _) => Ok(()),
            (told, 0) if told == all => writeln!(f, "<p>Every element responds to its own press.</p>"),
            (told, 0) => {
                writeln!(f, "<p>The other {} respond to their own press.</p>", plural(told, "element"))
            }
            (told, unpressed) => writeln!(
                f,
                "<p>{} of {all} elements were seen to respond to their own press. {unpressed} were not pressed at their centre at several depths: of these this run says nothing.</p>",
                count(told)
            ),
        };
    }
    writeln!(
        f,
        "<p class=\"warn\">Left out, because they do not respond to their own press:</p>\n<table class=\"numbers\">"
    )?;
    writeln!(f, "<thead><tr><th>element</th><th>(row, col)</th><th>responds to</th></tr></thead>")?;
    for unresponsive in &response.unresponsive {
        let [row, col] = unresponsive.curve.place;
        let other = match unresponsive.answers_to {
            RespondsTo::Element([row, col]) => format!("({row}, {col})"),
            RespondsTo::Elsewhere => "a place that was not pressed".into(),
            RespondsTo::Nothing => "nothing".into(),
        };
        writeln!(
            f,
            "<tr><td>{}</td><td>({row}, {col})</td><td>{other}</td></tr>",
            unresponsive.curve.element
        )?;
    }
    writeln!(f, "</table>")
}

/// Names the elements of which the presses show too little.
fn untold(f: &mut fmt::Formatter<'_>, response: &ResponseCurves) -> fmt::Result {
    if response.untold.is_empty() {
        return Ok(());
    }
    let elements: Vec<String> = response.untold.iter().map(ToString::to_string).collect();
    writeln!(
        f,
        "<p>Too few of their neighbours were pressed as deep to tell whether these elements respond to their own press: {}.</p>",
        elements.join(", ")
    )
}

fn spread(f: &mut fmt::Formatter<'_>, response: &ResponseCurves) -> fmt::Result {
    if elements(response) < 2 {
        return Ok(());
    }
    let Some([mean, deviation]) = response.slope_spread() else { return Ok(()) };
    let slope = |curve: &&crate::run::ElementCurve| curve.slope_counts_per_mm().unwrap_or(f64::NAN);
    let least = response.curves.iter().min_by(|a, b| slope(a).total_cmp(&slope(b)));
    let most = response.curves.iter().max_by(|a, b| slope(a).total_cmp(&slope(b)));
    let (Some(least), Some(most)) = (least, most) else { return Ok(()) };
    writeln!(
        f,
        "<p>Slopes of the elements: mean {} counts/mm, standard deviation {} counts/mm ({} %), from {} at ({}, {}) to {} at ({}, {}).</p>",
        number(mean, 0),
        number(deviation, 0),
        number(100.0 * deviation / mean.abs(), 1),
        number(slope(&least), 0),
        least.place[0],
        least.place[1],
        number(slope(&most), 0),
        most.place[0],
        most.place[1],
    )
}

/// The array with the slope of each element and its number.
fn slopes(f: &mut fmt::Formatter<'_>, response: &ResponseCurves, array: &Array) -> fmt::Result {
    let (rows, cols) = (array.rows(), array.cols());
    let cell_px = (MAP_PX / cols as f64).floor();
    if elements(response) < 2 || cell_px < 1.0 {
        return Ok(());
    }
    let mut values = vec![f32::NAN; array.elements()];
    for curve in &response.curves {
        if let (Some(value), Some(slope)) = (values.get_mut(curve.element), curve.slope_counts_per_mm()) {
            #[expect(clippy::cast_possible_truncation, reason = "a colour")]
            let slope = slope as f32;
            *value = slope;
        }
    }
    let finite = || values.iter().copied().filter(|slope| slope.is_finite()).map(f64::from);
    let [least, most] = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
    let (scale, heat) = (Scale::new(least, most), HeatMap { values: &values, rows, cols });
    let title = "slope of each element".to_owned();
    let mut sheet = Sheet::new("Slope of each element", [cell_px * cols as f64, cell_px * rows as f64]);
    sheet.put([0.0, 0.0], &Image { heat, cell_px, scale, title });
    sheet.put([0.0, 0.0], &ElementNumbers { heat, cell_px, scale });
    writeln!(
        f,
        "<figure>{sheet}<figcaption>The elements with their numbers; brighter is steeper, from {} to {} counts/mm.</figcaption></figure>",
        number(least, 0),
        number(most, 0)
    )
}

fn table(f: &mut fmt::Formatter<'_>, response: &ResponseCurves) -> fmt::Result {
    if response.linear.is_none() {
        return writeln!(f, "<p>Too few depths for a fit.</p>");
    }
    writeln!(
        f,
        "<div class=\"scroll\"><table class=\"numbers\">\n<thead><tr><th>response = a + b x + c x&#178;, x in mm</th><th class=\"n\">a / counts</th><th class=\"n\">b / (counts/mm)</th><th class=\"n\">c / (counts/mm&#178;)</th><th class=\"n\">residual / counts</th><th class=\"n\">degrees of freedom</th></tr></thead>"
    )?;
    for (name, fit) in [("linear", &response.linear), ("quadratic", &response.quadratic)] {
        let Some(fit) = fit else { continue };
        write!(f, "<tr><td>{name}</td>")?;
        for k in 0..3 {
            let text = fit.coefficients.get(k).map(coefficient).unwrap_or_default();
            write!(f, "<td class=\"n\">{}</td>", Text(text))?;
        }
        let residual = fit.residual.map_or_else(|| "\u{2013}".into(), |residual| number(residual, 2));
        writeln!(f, "<td class=\"n\">{residual}</td><td class=\"n\">{}</td></tr>", fit.degrees_of_freedom)?;
    }
    writeln!(
        f,
        "</table></div>\n<p class=\"lead\">After &#177;: standard error, from the residuals of the fit.</p>"
    )
}

/// Value and, where known, standard error.
fn coefficient(found: &Coefficient) -> String {
    found.standard_error.map_or_else(|| number(found.value, 2), |error| with_error(found.value, error))
}
