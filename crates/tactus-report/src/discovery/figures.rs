//! Figures of a discovery.

use std::fmt;

use tactus_discover::{Curve, Discovery, ElementGap, FittedCurve, Point, Stair};
use tactus_model::Array;
use tactus_model::effect::{Draft, Law};

use crate::{
    numbers::digits,
    plot::{
        Axis, ColourBar, ElementNumbers, Figure, HeatMap, Image, Ink, Label, Panel, Scale, Series, Sheet,
    },
};

/// Names of the two models.
const BEFORE: &str = "base model";
const AFTER: &str = "grown model";
/// Size of one of three curves in a row.
const CURVE_PX: [f64; 2] = [344.0, 240.0];
/// Size of a draft's curve.
const DRAFT_PX: [f64; 2] = [720.0, 300.0];
/// Straight pieces of a drawn law.
const CURVE_STEPS: u16 = 400;
/// Drawn periods of a tone.
const PERIODS: f64 = 3.0;
/// Width between two maps.
const GUTTER_PX: f64 = 40.0;
/// Width of the bars' names, and of the longest bar.
const BARS_PX: [f64; 2] = [220.0, 480.0];
/// Height of a bar and the space below it.
const BAR_PX: f64 = 26.0;

/// Mean residual against a covariate, with standard errors: base model and, if different, grown model.
pub fn residual_against(curve: &Curve) -> Figure {
    let x = along(curve.covariate, curve.unit);
    let y = Axis::new("residual", curve.of).from_zero();
    let ends = [curve.points.first(), curve.points.last()].into_iter().flatten();
    let zero = Series::line(ends.map(|end| [end.at, 0.0]).collect()).ink(Ink::Muted).width_px(1.0);
    let [bars, dots] = means(curve, |point| point.before);
    let figure = Figure::new(format!("Residual against {}", curve.covariate), x, y)
        .size_px(CURVE_PX)
        .with(zero)
        .with(bars.ink(Ink::Red))
        .with(dots.ink(Ink::Red).label(BEFORE));
    if curve.points.iter().all(|point| (point.after - point.before).abs() <= 0.0) {
        return figure;
    }
    let [bars, dots] = means(curve, |point| point.after);
    figure.with(bars.ink(Ink::Blue)).with(dots.ink(Ink::Blue).label(AFTER))
}

/// The axis of a covariate: of a time that begins with an event logarithmic.
fn along(covariate: &str, unit: &str) -> Axis {
    let axis = Axis::new(covariate, unit).tight();
    if covariate.starts_with("time since") { axis.logarithmic() } else { axis }
}

/// A free curve or a table with the standard errors of its knots, beside the formula that it replaces.
pub fn free_curve(effect: &str, curve: &FittedCurve) -> Figure {
    let of = Axis::new(curve.of.replace('_', " "), "");
    let (kind, label, x, y) = if curve.is_table() {
        let (name, unit) = curve.at.rsplit_once('_').unwrap_or((curve.at, ""));
        ("Table", "table", Axis::new(name, unit.to_owned()).tight(), of)
    } else {
        let unit = curve.at.trim_start_matches("at_").replace("_per_", "/");
        ("Free curve", "knots", Axis::new("place", unit).tight(), of.from_zero())
    };
    let formula = curve.formula.iter().map(|formula| {
        let points = curve.knots.iter().zip(&formula.values).map(|(knot, value)| [knot.at, *value]);
        let line = Series::line([[0.0; 2]].into_iter().chain(points).collect());
        line.ink(Ink::Muted).dashed().label("formula")
    });
    let bars = curve.knots.iter().filter_map(|knot| {
        let error = knot.standard_error?;
        Some([knot.at, knot.value - error, knot.value + error])
    });
    let dots = curve.knots.iter().map(|knot| [knot.at, knot.value]).collect();
    let figure = Figure::new(format!("{kind} of {effect}"), x, y).size_px(CURVE_PX);
    formula
        .fold(figure, Figure::with)
        .with(Series::bars(bars).width_px(1.2).ink(Ink::Blue))
        .with(Series::dots(dots).width_px(4.5).ink(Ink::Blue).label(label))
}

/// The curve of a draft: the law, with the fitted knots and their standard errors where they are given; of two covariates a line for each knot
/// of the second one. `None` of a constant.
pub fn draft_curve(draft: &Draft, knots: &[[f64; 3]]) -> Option<Figure> {
    let (covariate, [from, to]) = (*draft.covariates.first()?, *draft.ranges.first()?);
    let to = match draft.law {
        Law::Linear { slope: 0.0, .. } => return None,
        Law::Periodic { per_unit, .. } => to.min(from + PERIODS / per_unit),
        Law::Linear { .. }
        | Law::Power { .. }
        | Law::Exponential { .. }
        | Law::Saturating { .. }
        | Law::Threshold { .. }
        | Law::Logarithm { .. }
        | Law::Table { .. } => to,
    };
    let x = along(covariate.name(), covariate.unit());
    let y = Axis::new(draft.carrier.name(), draft.carrier.unit()).from_zero();
    let figure = Figure::new(format!("Curve of {}", draft.name), x, y).size_px(DRAFT_PX);
    let line = |others: &[f64]| {
        let places =
            (0..=CURVE_STEPS).map(|step| from + (to - from) * f64::from(step) / f64::from(CURVE_STEPS));
        let point = |at: f64| [at, draft.law.value(&[&[at], others].concat())];
        Series::line(places.map(point).collect())
    };
    if let (Law::Table { at, .. }, [_, second]) = (&draft.law, &draft.covariates[..]) {
        let seconds = at
            .get(1)
            .into_iter()
            .flatten()
            .zip([Ink::Blue, Ink::Green, Ink::Amber, Ink::Red].into_iter().cycle());
        let lines = seconds.map(|(value, ink)| {
            let label = format!("{} {} {}", second.name(), digits(*value, 2), second.unit());
            line(&[*value]).ink(ink).label(label.trim_end())
        });
        return Some(lines.fold(figure, Figure::with));
    }
    let known = || knots.iter().filter(|[.., error]| error.is_finite());
    let bars = known().map(|[at, value, error]| [*at, value - error, value + error]);
    let dots: Vec<[f64; 2]> = knots.iter().map(|[at, value, _]| [*at, *value]).collect();
    let figure = figure.with(line(&[]).ink(Ink::Muted).label(draft.law.name()));
    if dots.is_empty() {
        return Some(figure);
    }
    let figure = figure.with(Series::bars(bars).width_px(1.2).ink(Ink::Blue));
    Some(figure.with(Series::dots(dots).width_px(4.5).ink(Ink::Blue).label("knots")))
}

/// The curve of a draft as a picture of its own; `None` of a constant.
pub fn draft_picture(draft: &Draft) -> Option<Sheet> {
    let mut sheet = Sheet::new(format!("Curve of {}", draft.name), DRAFT_PX);
    sheet.put([0.0, 0.0], &draft_curve(draft, &[])?);
    Some(sheet)
}

/// The weight that a draft has for each element; `None` if it acts on all alike.
pub fn draft_weights(array: &Array, draft: &Draft) -> Option<Sheet> {
    let (rows, cols) = (array.rows(), array.cols());
    #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
    let weights: Vec<f32> = draft.weights.as_ref()?.iter().map(|weight| *weight as f32).collect();
    let scale = Scale::of(weights.iter().map(|weight| f64::from(*weight)));
    let cell_px = cell_px(rows, cols);
    let height = cell_px * rows as f64;
    let mut sheet =
        Sheet::new("Weights of the elements", [(cell_px * cols as f64).max(420.0), height + 48.0]);
    let heat = HeatMap { values: &weights, rows, cols };
    sheet.put([0.0, 0.0], &Image { heat, cell_px, scale, title: "weights".into() });
    sheet.put([0.0, 0.0], &ElementNumbers { heat, cell_px, scale });
    sheet.put([-12.0, height + 12.0], &ColourBar { scale, title: "weight".into() });
    Some(sheet)
}

/// Side of an element's square on a map.
fn cell_px(rows: usize, cols: usize) -> f64 {
    (500.0 / cols as f64).min(300.0 / rows as f64).clamp(1.0, 44.0)
}

/// Root mean square residual of each element, of the base model and, if different, of the grown model, on one scale: in
/// units of the noise if that is known, else in counts.
pub fn element_maps(array: &Array, elements: &[ElementGap], noise_rms_counts: Option<f64>) -> Sheet {
    let (rows, cols) = (array.rows(), array.cols());
    let unit_counts = noise_rms_counts.unwrap_or(1.0);
    #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
    let values = |of: fn(&ElementGap) -> f64| -> Vec<f32> {
        elements.iter().map(|element| (of(element) / unit_counts) as f32).collect()
    };
    let before = values(|element| element.before_rms_counts);
    let after = values(|element| element.after_rms_counts);
    let greatest = before.iter().chain(&after).map(|value| f64::from(*value)).fold(0.0, f64::max);
    // Noise alone is not drawn in bright colours.
    let scale = Scale::new(0.0, if noise_rms_counts.is_some() { greatest.max(2.0) } else { greatest });
    let maps = [(BEFORE, &before), (AFTER, &after)];
    let is_same = before.iter().zip(&after).all(|(before, after)| before.to_bits() == after.to_bits());
    let maps = if is_same { &maps[..1] } else { &maps[..] };
    let cell_px = cell_px(rows, cols);
    let (width, height) = (cell_px * cols as f64, cell_px * rows as f64);
    let size_px = [(2.0 * width + GUTTER_PX).max(560.0), height + 70.0];
    let mut sheet = Sheet::new("Residual of the elements", size_px);
    for (nth, (name, values)) in maps.iter().enumerate() {
        let x = (width + GUTTER_PX) * nth as f64;
        sheet.put([x, 12.0], &Label::new(*name).heading());
        let heat = HeatMap { values, rows, cols };
        sheet.put([x, 22.0], &Image { heat, cell_px, scale, title: (*name).into() });
        sheet.put([x, 22.0], &ElementNumbers { heat, cell_px, scale });
    }
    let title = if noise_rms_counts.is_some() { "rms in units of the noise" } else { "rms in counts" };
    sheet.put([-12.0, height + 34.0], &ColourBar { scale, title: title.into() });
    sheet
}

/// Held-out residuals as the grown model is built up, from the base model; and the noise.
pub fn staircase(found: &Discovery) -> Sheet {
    let last = found.staircase.len().saturating_sub(1);
    let stair = |(nth, stair): (usize, &Stair)| {
        let ink = match nth {
            0 => Ink::Red,
            nth if nth == last => Ink::Blue,
            _ => Ink::Amber,
        };
        let name = if nth == 0 { format!("{BEFORE}, recalibrated") } else { format!("with {}", stair.with) };
        LevelBar::new(name, stair.heldout_rms_counts, ink)
    };
    let mut bars: Vec<LevelBar> = found.staircase.iter().enumerate().map(stair).collect();
    if bars.is_empty() {
        bars.push(LevelBar::new(BEFORE, found.base.heldout_rms_counts, Ink::Red));
    }
    bars.extend(found.floor.rms_counts().map(|rms| LevelBar::new("noise", rms, Ink::Muted)));
    let longest = bars.iter().map(|bar| bar.rms_counts).filter(|rms| rms.is_finite()).fold(0.0, f64::max);
    let size_px = [BARS_PX[0] + BARS_PX[1] + 140.0, BAR_PX * bars.len() as f64];
    let mut sheet = Sheet::new("Held-out residual, rms in counts", size_px);
    for (nth, bar) in bars.into_iter().enumerate() {
        let length_px = if longest > 0.0 { BARS_PX[1] * bar.rms_counts / longest } else { 0.0 };
        let y = BAR_PX * (nth as f64 + 0.5);
        sheet.put([BARS_PX[0] - 12.0, y + 4.0], &Label::new(bar.name).right());
        sheet.put([BARS_PX[0], y], &HorizontalBar { length_px, ink: bar.ink });
        let in_noise = found
            .floor
            .rms_counts()
            .map(|noise| format!(", {} \u{d7} noise", digits(bar.rms_counts / noise, 3)));
        let counts = format!("{}{}", digits(bar.rms_counts, 3), in_noise.unwrap_or_default());
        sheet.put([BARS_PX[0] + length_px.max(0.0) + 8.0, y + 4.0], &Label::new(counts));
    }
    sheet
}

/// Means with their standard errors.
fn means(curve: &Curve, of: fn(&Point) -> f64) -> [Series; 2] {
    let bars = curve.points.iter().map(|point| {
        let (mean, error) = (of(point), point.standard_error);
        [point.at, mean - error, mean + error]
    });
    let dots = curve.points.iter().map(|point| [point.at, of(point)]);
    [Series::bars(bars).width_px(1.2), Series::dots(dots.collect()).width_px(4.5)]
}

struct LevelBar {
    name: String,
    rms_counts: f64,
    ink: Ink,
}

impl LevelBar {
    fn new(name: impl Into<String>, rms_counts: f64, ink: Ink) -> Self {
        Self { name: name.into(), rms_counts, ink }
    }
}

/// A bar from its origin to the right.
struct HorizontalBar {
    length_px: f64,
    ink: Ink,
}

impl Panel for HorizontalBar {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.length_px > 0.0 {
            write!(
                f,
                r#"<path class="line {}" stroke-width="14" d="M0 0h{:.1}"/>"#,
                self.ink.class(),
                self.length_px
            )?;
        }
        Ok(())
    }
}
