//! Figures 2a, 2b, 5a and 5b of the paper for the calibrated sensor.

use tactus_calibrate::{ElementResponse, ResponseFit, SpreadFit, ThicknessFit};
use tactus_model::{DIGITACTS_PITCH_MM, Psf};

use crate::{
    figures::profiles,
    numbers::short,
    plot::{Axis, Figure, Ink, Series, Sheet, number},
};

/// Points along a curve.
const CURVE_POINTS: u32 = 60;
const INKS: [Ink; 4] = [Ink::Blue, Ink::Green, Ink::Amber, Ink::Red];
/// Size of one of two figures in a row.
const HALF_PX: [f64; 2] = [504.0, 380.0];

/// Figure 2a: response of each element to presses on its own centre, and the mean of the elements' fits.
///
/// The means are omitted if sensitivities have both signs; the quadratic one also if there are too few depths.
pub fn responses(response: &ResponseFit) -> Sheet {
    let mut figure = over_indentation("Response of the elements", "response above rest");
    figure = with_elements(figure, response, |_, point| point);
    let line = mean_linear(response);
    if one_sign(response) {
        let range_mm = range_mm(response);
        figure = figure
            .with(Series::line(curve(range_mm, |u| line * u)).ink(Ink::Red).width_px(2.2).label("linear"));
        if let Some([b, c]) = mean_quadratic(response) {
            let parabola = Series::line(curve(range_mm, |u| b * u + c * u * u));
            figure = figure.with(parabola.ink(Ink::Blue).dashed().width_px(2.2).label("quadratic"));
        }
    }
    alone("Figure 2a: response of the elements", HALF_PX, &figure)
}

/// Figure 2b: the same readings, converted to indentation by each element's own response and scaled by the mean
/// sensitivity. Readings beyond an element's turning point are left out.
pub fn recalibrated(response: &ResponseFit) -> Sheet {
    let uniform = uniform_counts_per_mm(response);
    let mut figure = over_indentation("Responses made uniform", "recalibrated response");
    figure = with_elements(figure, response, |element, point| recalibrate(element, uniform, point));
    let line = Series::line(curve(range_mm(response), |u| uniform * u));
    figure = figure.with(line.ink(Ink::Red).width_px(2.2).label("uniform response"));
    alone("Figure 2b: responses made uniform", HALF_PX, &figure)
}

/// Figure 5a: the spread of each covering at each depth against the covering's thickness, both in pitches, with 95 %
/// intervals, the fitted curves and the paper's Eq. 4; below, the distances from the fitted line.
pub fn spread_against_thickness(spreads: &[SpreadFit], thickness: &ThicknessFit, pitch_mm: f64) -> Sheet {
    const WIDTH_PX: f64 = 640.0;
    const ABOVE_PX: f64 = 350.0;
    const BELOW_PX: f64 = 210.0;
    let thickest_mm = spreads.iter().map(|fit| fit.covering_mm).fold(pitch_mm, f64::max);
    let along = Axis::new("covering thickness", "pitches").spanning([0.0, 1.06 * thickest_mm / pitch_mm]);
    let over = |spread_mm: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
        curve([0.0, 1.06 * thickest_mm], spread_mm).into_iter().map(|at| at.map(|mm| mm / pitch_mm)).collect()
    };
    // Eq. 4 is in units of the pitch.
    let paper = |covering_mm: f64| {
        Psf::PAPER.sigma_intercept_mm / DIGITACTS_PITCH_MM * pitch_mm + Psf::PAPER.sigma_per_mm * covering_mm
    };
    let mut above = Figure::new("Spread against thickness", along.clone(), Axis::new("\u{3c3}+", "pitches"))
        .size_px([WIDTH_PX, ABOVE_PX])
        .with(Series::line(over(&paper)).ink(Ink::Muted).dotted().width_px(1.6).label("paper, Eq. 4"));
    if let Some(line) = &thickness.linear {
        above = above.with(Series::line(over(&|mm| line.at(mm))).ink(Ink::Red).width_px(2.0).label("linear"));
    }
    if let Some(parabola) = &thickness.quadratic {
        let series = Series::line(over(&|mm| parabola.at(mm))).ink(Ink::Green).dashed();
        above = above.with(series.width_px(2.0).label("quadratic"));
    }
    let bars = spreads.iter().map(|fit| {
        let [lo, hi] = fit.sigma_mm.interval();
        [fit.covering_mm, lo, hi].map(|mm| mm / pitch_mm)
    });
    let points = spreads.iter().map(|fit| [fit.covering_mm, fit.sigma_mm.value].map(|mm| mm / pitch_mm));
    above = above
        .with(Series::bars(bars).width_px(1.2))
        .with(Series::dots(points.collect()).width_px(6.0).label("measured"));
    let Some(line) = &thickness.linear else {
        return alone("Figure 5a: spread against thickness", [WIDTH_PX, ABOVE_PX], &above);
    };

    let mut below =
        Figure::new("Distance from the line", along, Axis::new("distance from the line", "\u{b5}m"))
            .size_px([WIDTH_PX, BELOW_PX])
            .with(
                Series::line(curve([0.0, 1.06 * thickest_mm / pitch_mm], |_| 0.0))
                    .ink(Ink::Red)
                    .width_px(2.0),
            );
    let depths = by_depth(spreads);
    for (nth, (name, fits)) in depths.iter().enumerate() {
        let ink = INKS[nth % INKS.len()];
        // Side by side, so that none hides the others.
        let aside = 0.012 * (nth as f64 - 0.5 * (depths.len() - 1) as f64) * thickest_mm / pitch_mm;
        let off_um = |covering_mm: f64, sigma_mm: f64| 1e3 * (sigma_mm - line.at(covering_mm));
        let at = |fit: &SpreadFit| fit.covering_mm / pitch_mm + aside;
        let bars = fits.iter().map(|fit| {
            let [lo, hi] = fit.sigma_mm.interval().map(|end| off_um(fit.covering_mm, end));
            [at(fit), lo, hi]
        });
        let points = fits.iter().map(|fit| [at(fit), off_um(fit.covering_mm, fit.sigma_mm.value)]);
        below = below
            .with(Series::bars(bars).ink(ink).width_px(1.4))
            .with(Series::dots(points.collect()).ink(ink).width_px(5.5).label(name));
    }
    let mut sheet = Sheet::new("Figure 5a: spread against thickness", [WIDTH_PX, ABOVE_PX + 16.0 + BELOW_PX]);
    sheet.put([0.0, 0.0], &above);
    sheet.put([0.0, ABOVE_PX + 16.0], &below);
    sheet
}

/// Figure 5b: the point spread function of each covering, with the mean spread over its depths; lengths in pitches.
pub fn point_spreads(thickness: &ThicknessFit, pitch_mm: f64) -> Sheet {
    let of = |covering: &tactus_calibrate::CoveringSpread| {
        (format!("{} mm", short(covering.covering_mm, 3)), covering.sigma_mm.value / pitch_mm)
    };
    profiles(&thickness.coverings.iter().map(of).collect::<Vec<_>>())
}

/// Mean absolute sensitivity of the elements, which is the sensitivity of the uniform response.
pub(super) fn uniform_counts_per_mm(response: &ResponseFit) -> f64 {
    mean(response, |element| element.sensitivity_counts_per_mm.value.abs())
}

/// Root mean square distance of all readings from one curve for all: the mean line before recalibration, the uniform
/// response after it. `None` if sensitivities have both signs.
pub(super) fn scatter_counts(response: &ResponseFit) -> Option<[f64; 2]> {
    if !one_sign(response) {
        return None;
    }
    let (line, uniform) = (mean_linear(response), uniform_counts_per_mm(response));
    let readings =
        || response.elements.iter().flat_map(|element| element.points.iter().map(move |at| (element, *at)));
    let before = rms(readings().map(|(_, [u, rise])| rise - line * u));
    let after = rms(readings().map(|(element, at)| recalibrate(element, uniform, at)[1] - uniform * at[0]));
    Some([before?, after?])
}

/// True if all sensitivities have one sign, so that their mean is meaningful.
pub(super) fn one_sign(response: &ResponseFit) -> bool {
    let signs = || response.elements.iter().map(|element| element.sensitivity_counts_per_mm.value);
    signs().all(|s| s > 0.0) || signs().all(|s| s < 0.0)
}

/// True if the data could distinguish a curve from a line.
pub(super) fn decided(response: &ResponseFit) -> bool {
    response.trials.iter().any(|trial| trial.heldout_rms_counts.is_some())
}

/// The same indentation with the rise of a uniform element.
fn recalibrate(element: &ElementResponse, uniform: f64, [u_mm, rise]: [f64; 2]) -> [f64; 2] {
    [u_mm, element.indentation_mm(rise).map_or(f64::NAN, |indentation_mm| uniform * indentation_mm)]
}

fn with_elements(
    mut figure: Figure,
    response: &ResponseFit,
    of: impl Fn(&ElementResponse, [f64; 2]) -> [f64; 2],
) -> Figure {
    for (nth, element) in response.elements.iter().enumerate() {
        let mut points: Vec<[f64; 2]> = element.points.iter().map(|point| of(element, *point)).collect();
        points.sort_by(|one, other| one[0].total_cmp(&other[0]));
        let line = Series::line(points.clone()).dotted().width_px(1.0).opacity(0.8);
        figure = figure
            .with(if nth == 0 { line.label("single elements") } else { line })
            .with(Series::dots(points).width_px(2.4).opacity(0.5));
    }
    figure
}

fn over_indentation(name: &str, what: &str) -> Figure {
    let x = Axis::new("equivalent indentation", "mm").from_zero();
    Figure::new(name, x, Axis::new(what, "counts").from_zero()).size_px(HALF_PX)
}

/// Range of indentations, which includes 0.
fn range_mm(response: &ResponseFit) -> [f64; 2] {
    let all = response.elements.iter().flat_map(|element| element.points.iter().map(|point| point[0]));
    all.fold([0.0, 0.0], |[lo, hi], u: f64| [lo.min(u), hi.max(u)])
}

fn mean_linear(response: &ResponseFit) -> f64 {
    mean(response, |element| element.linear_counts_per_mm.value)
}

/// Mean coefficients of `u` and `u^2` over the elements' own parabolas; `None` if not all elements have one.
fn mean_quadratic(response: &ResponseFit) -> Option<[f64; 2]> {
    let all = response.elements.iter().all(|element| element.quadratic.is_some());
    let of = |power: fn([f64; 2]) -> f64| {
        mean(response, |element| element.quadratic.map_or(f64::NAN, |[s, k]| power([s.value, k.value])))
    };
    (all && decided(response)).then(|| [of(|[s, _]| s), of(|[s, k]| s * k)])
}

fn mean(response: &ResponseFit, of: impl Fn(&ElementResponse) -> f64) -> f64 {
    response.elements.iter().map(of).sum::<f64>() / response.elements.len().max(1) as f64
}

/// Root mean square of the finite distances; `None` without any.
fn rms(distances: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, number) = distances
        .filter(|distance| distance.is_finite())
        .fold((0.0, 0.0), |(sum, number), distance| (sum + distance * distance, number + 1.0));
    (number > 0.0).then(|| f64::sqrt(sum / number))
}

fn curve([from, to]: [f64; 2], of: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let at = |step: u32| from + (to - from) * f64::from(step) / f64::from(CURVE_POINTS);
    (0..=CURVE_POINTS).map(|step| [at(step), of(at(step))]).collect()
}

/// Groups of fits: the shallowest depth of each covering, then the second, and so on; each with a name.
fn by_depth(spreads: &[SpreadFit]) -> Vec<(String, Vec<&SpreadFit>)> {
    let mut sorted: Vec<&SpreadFit> = spreads.iter().collect();
    sorted.sort_by(|one, other| {
        one.covering_mm.total_cmp(&other.covering_mm).then(one.depth_mm.total_cmp(&other.depth_mm))
    });
    let mut depths: Vec<Vec<&SpreadFit>> = Vec::new();
    for of_covering in sorted.chunk_by(|one, other| (one.covering_mm - other.covering_mm).abs() < 5e-4) {
        for (nth, fit) in of_covering.iter().enumerate() {
            if nth == depths.len() {
                depths.push(Vec::new());
            }
            depths[nth].push(fit);
        }
    }
    let name = |nth: usize, fits: &[&SpreadFit]| {
        let share = |fit: &&SpreadFit| 100.0 * fit.depth_mm / fit.covering_mm;
        let [lo, hi] = fits
            .iter()
            .map(share)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], share| [lo.min(share), hi.max(share)]);
        if hi - lo < 2.0 {
            format!("{} % deep", number(f64::midpoint(lo, hi), 0))
        } else {
            format!("depth {}", nth + 1)
        }
    };
    depths.into_iter().enumerate().map(|(nth, fits)| (name(nth, &fits), fits)).collect()
}

/// A figure as a separate sheet.
fn alone(name: &str, size_px: [f64; 2], figure: &Figure) -> Sheet {
    let mut sheet = Sheet::new(name, size_px);
    sheet.put([0.0, 0.0], figure);
    sheet
}
