//! Point spread of the coverings.

use std::fmt;

use tactus_calibrate::{Curve, SpreadFit, ThicknessFit};
use tactus_model::{DIGITACTS_PITCH_MM, Psf};

use super::{
    CalibrationReport, Drawing, FigurePlacement, figure,
    figures::{point_spreads, spread_against_thickness},
};
use crate::{
    document::{Column, Table},
    numbers::{digits, estimate, interval, probability, short, with_error},
    plot::number,
};

pub(super) fn drawings(report: &CalibrationReport<'_>) -> Vec<Drawing> {
    let Some((spreads, thickness)) = found(report) else { return Vec::new() };
    let pitch_mm = report.array.pitch_mm();
    let below = if thickness.linear.is_some() {
        " Below: their distances from the line, with the depths drawn side by side. The errors within one covering are largely common, so \
         its depths may scatter by less than their bars."
    } else {
        ""
    };
    vec![
        Drawing {
            number: "5a",
            title: "Spread against thickness",
            caption: format!(
                "The spread of each covering at each depth with its 95 % interval, where that is wider than the point; the line and the \
                 parabola through them, and Eq. 4 of the paper. Lengths are in pitches of {} mm.{below}",
                short(pitch_mm, 3)
            ),
            sheet: spread_against_thickness(spreads, thickness, pitch_mm),
        },
        Drawing {
            number: "5b",
            title: "Point spread functions of the coverings",
            caption: "Left: profiles of each covering's Gaussian of unit volume, with the mean spread over its depths; a wider one is \
                      lower. Right: the same from above, each on its own scale; the ring is one \u{3c3} from the press."
                .into(),
            sheet: point_spreads(thickness, pitch_mm),
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
        "<section>\n<h2>Spread of the coverings</h2>\n<p class=\"lead\">The \u{3c3}+ that maximises the sum of inner products between \
         measured and modelled images, both of unit L2 norm (Eq. 3). Its standard error includes those of the responses and of the \
         registration.</p>"
    )?;
    match found(report) {
        None => writeln!(f, "<p>Not determined.</p>")?,
        Some((spreads, thickness)) => {
            let pitch_mm = report.array.pitch_mm();
            by_depth(f, spreads, pitch_mm)?;
            writeln!(f, "</section>\n<section>\n<h2>Spread against thickness</h2>")?;
            if figures == FigurePlacement::Inline {
                drawings(report).iter().try_for_each(|drawing| figure(f, drawing))?;
            }
            by_covering(f, thickness, pitch_mm)?;
            curves(f, report, thickness)?;
        }
    }
    writeln!(f, "</section>")
}

fn found<'a>(report: &CalibrationReport<'a>) -> Option<(&'a [SpreadFit], &'a ThicknessFit)> {
    let calibration = report.calibration;
    let thickness = calibration.thickness.as_ref()?;
    (!calibration.spreads.is_empty()).then_some((&calibration.spreads, thickness))
}

fn by_depth(f: &mut fmt::Formatter<'_>, spreads: &[SpreadFit], pitch_mm: f64) -> fmt::Result {
    let mut table = Table::new(&[
        Column::Number("covering / mm"),
        Column::Number("depth / mm"),
        Column::Number("\u{3c3}+ / mm"),
        Column::Number("95 % interval / mm"),
        Column::Number("\u{3c3}+ / pitches"),
        Column::Number("likeness"),
        Column::Number("presses"),
    ]);
    for fit in spreads {
        table.row([
            short(fit.covering_mm, 3),
            format!("{} ({} %)", number(fit.depth_mm, 3), number(100.0 * fit.depth_mm / fit.covering_mm, 0)),
            estimate(&fit.sigma_mm),
            interval(&fit.sigma_mm),
            estimate(&fit.sigma_mm.in_units_of(pitch_mm)),
            likeness(fit.likeness),
            presses(fit),
        ]);
    }
    let scatters = spreads.iter().map(|fit| fit.scatter_mm);
    let [least, most] =
        scatters.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], mm| [least.min(mm), most.max(mm)]);
    writeln!(
        f,
        "{table}\n<p class=\"lead\">Depth: also as a share of the thickness. Likeness: mean cosine between measured and modelled images, \
         1 for a perfect fit. The part of the standard errors that more presses would reduce is {} to {} \
         mm.</p>",
        digits(least, 2),
        digits(most, 2)
    )
}

fn by_covering(f: &mut fmt::Formatter<'_>, thickness: &ThicknessFit, pitch_mm: f64) -> fmt::Result {
    let mut table = Table::new(&[
        Column::Number("covering / mm"),
        Column::Number("\u{3c3}+ / mm"),
        Column::Number("95 % interval / mm"),
        Column::Number("\u{3c3}+ / pitches"),
        Column::Number("Eq. 4 / pitches"),
        Column::Number("between depths / mm"),
        Column::Number("p"),
    ]);
    for covering in &thickness.coverings {
        table.row([
            short(covering.covering_mm, 3),
            estimate(&covering.sigma_mm),
            interval(&covering.sigma_mm),
            estimate(&covering.sigma_mm.in_units_of(pitch_mm)),
            number(PAPER_PITCHES + Psf::PAPER.sigma_per_mm * covering.covering_mm / pitch_mm, 3),
            digits(covering.range_mm, 2),
            covering.p_value.map_or_else(|| "\u{2013}".into(), probability),
        ]);
    }
    writeln!(
        f,
        "{table}\n<p class=\"lead\">Mean over the depths of each covering; the greatest difference between two depths; p: the probability of such a \
         difference if the spread does not depend on depth.</p>"
    )
}

/// The intercept of Eq. 4.
const PAPER_PITCHES: f64 = Psf::PAPER.sigma_intercept_mm / DIGITACTS_PITCH_MM;

fn curves(
    f: &mut fmt::Formatter<'_>,
    report: &CalibrationReport<'_>,
    thickness: &ThicknessFit,
) -> fmt::Result {
    let (pitch_mm, declared) = (report.array.pitch_mm(), report.declared_psf);
    let mut table = Table::new(&[
        Column::Name("\u{3c3}+ = a + b t (+ c t\u{b2})"),
        Column::Number("found"),
        Column::Number("95 % interval"),
        Column::Number("declared"),
        Column::Number("Eq. 4 of the paper"),
    ]);
    if let Some(Curve { coefficients: [a, b], .. }) = &thickness.linear {
        for (name, found, declared, paper) in [
            (
                "linear: a / pitches",
                a.in_units_of(pitch_mm),
                declared.sigma_intercept_mm / pitch_mm,
                PAPER_PITCHES,
            ),
            ("linear: a / mm", *a, declared.sigma_intercept_mm, PAPER_PITCHES * pitch_mm),
            ("linear: b", *b, declared.sigma_per_mm, Psf::PAPER.sigma_per_mm),
        ] {
            table.row([name.into(), estimate(&found), interval(&found), short(declared, 6), short(paper, 6)]);
        }
    }
    if let Some(Curve { coefficients: [a, b, c], .. }) = &thickness.quadratic {
        for (name, found) in [
            ("quadratic: a / pitches", a.in_units_of(pitch_mm)),
            ("quadratic: b", *b),
            ("quadratic: c / (1/mm)", *c),
        ] {
            table.row([name.into(), estimate(&found), interval(&found), String::new(), String::new()]);
        }
    }
    if thickness.linear.is_some() {
        writeln!(f, "{table}")?;
    }
    let scatter = |name: &str, rms_mm: f64, p_value: Option<f64>| {
        let p_value =
            p_value.map_or_else(String::new, |p| format!(" (p-value if it holds: {})", probability(p)));
        format!(
            "<p>The points lie {} mm rms off the {name}{}.</p>\n",
            digits(rms_mm, 2),
            p_value.replace('<', "&lt;")
        )
    };
    if let Some(line) = &thickness.linear {
        f.write_str(&scatter("line", line.rms_mm, line.p_value))?;
    }
    if let Some(parabola) = &thickness.quadratic {
        f.write_str(&scatter("parabola", parabola.rms_mm, parabola.p_value))?;
    }
    match (report.calibration.psf(declared), &thickness.linear) {
        (Some(_), Some(_)) => Ok(()),
        (Some((psf, [error, _])), None) => writeln!(
            f,
            "<p>One covering does not determine a line. With the declared slope of {}, its spread gives an intercept of {} mm.</p>",
            short(psf.sigma_per_mm, 6),
            with_error(psf.sigma_intercept_mm, error.unwrap_or(0.0))
        ),
        (None, _) => writeln!(
            f,
            "<p class=\"warn\">A model cannot have this spread: its intercept must be positive and its slope not negative. The declared \
             spread is kept.</p>"
        ),
    }
}

/// Number of presses used and left out.
fn presses(fit: &SpreadFit) -> String {
    match fit.left_out {
        0 => fit.presses.to_string(),
        left_out => format!("{} ({left_out} left out)", fit.presses),
    }
}

/// To two significant digits of its difference from 1.
fn likeness(likeness: f64) -> String {
    let lacks = (1.0 - likeness).abs().max(1e-9);
    let decimals = digits(lacks, 2).split_once('.').map_or(2, |(_, decimals)| decimals.len());
    number(likeness, decimals)
}
