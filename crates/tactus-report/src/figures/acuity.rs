//! Figures 6a and 6b: spatial acuity against spread and force resolution.

use std::fmt;

use tactus_calibrate::acuity::{DiscretisingSensor, Grid, NYQUIST_SIGMA, OFFSETS, OFFSETS_BETWEEN};

use super::{Drawing, FigureError};
use crate::plot::{Axis, ColourBar, Figure, HeatMap, Image, Ink, Label, Panel, Scale, Series, Sheet, number};

const CELL_PX: f64 = 9.0;
// Positions of the panels and of the plots beside them.
const TOP_PX: f64 = 42.0;
const PANELS_PX: [f64; 2] = [52.0, 344.0];
const BESIDE_PX: f64 = 596.0;

/// The paper's panel; the same for force steps that are mostly not whole; and profiles of both against the spread.
pub(super) fn draw_locations() -> Result<Drawing, FigureError> {
    let panel = |heading, below, grid: Grid| {
        let counts = grid.map(|sensor| Some(sensor.locations() as f64))?;
        Ok::<_, FigureError>(LogPanel::new([heading, below], grid, &counts, |one, other| one > other))
    };
    let whole = panel("whole 1/f", "as a converter has: the paper's ridge", Grid::whole())?;
    let even = panel("any 1/f", "whole at 4, 8, 16, ..., 256 only", Grid::even(25))?;
    let scale = Scale::new(0.0, 3.0);
    let mut sheet = sheet(
        "Distinct readings of a point",
        [&whole, &even],
        scale,
        "log\u{2081}\u{2080} of distinct readings",
    );

    let mut profiles = beside("Distinct readings in units of 1/f", "distinct readings times f");
    let steps = [(20.0, Ink::Blue), (100.0, Ink::Green), (20.37, Ink::Red), (100.37, Ink::Amber)];
    for (force_steps, ink) in steps {
        let counts = fine_sigmas(force_steps)
            .map(|sensor| [sensor.sigma(), sensor.locations() as f64 / force_steps])?;
        let line = Series::line(counts).ink(ink).label(format!("{force_steps}"));
        profiles = profiles.with(if force_steps.fract() > 0.0 { line.dashed() } else { line });
    }
    sheet.put(
        [BESIDE_PX, TOP_PX - 20.0],
        &profiles
            .with(nyquist_line([0.0, 2.5]).label(format!("3/\u{3c0} = {NYQUIST_SIGMA:.3}")))
            .size_px([474.0, 290.0]),
    );
    sheet.put([BESIDE_PX + 70.0, TOP_PX - 32.0], &Label::new("readings \u{d7} f, by 1/f").heading());

    let at_ridge: Vec<f64> =
        whole.best().map(|(row, _, count)| count * whole.grid.force_resolutions[row]).collect();
    let ridge = span(whole.best().map(|(_, sigma, _)| sigma));
    let caption = format!(
        "Distinct readings of five elements as a point moves over the middle one in steps of 0.02 f, against the spread \u{3c3} \
         (in element widths) and the force resolution f: an upper bound of the positions that can be distinguished. The paper \
         gives no ranges; here \u{3c3} is {} to {} and 1/f is {} to {}, 25 values each. Dots: the least spread with the most \
         readings. Left: 1/f is a whole number, as for a converter with so many steps. There is a ridge at \u{3c3} = {ridge}, near the \
         paper's 0.3 at all resolutions, with {} readings times f. Its cause: with a small spread a point loads only two \
         elements, whose shares sum to 1; with a whole 1/f both readings change at once, and half of the readings are lost. \
         Middle and right: for other 1/f they change separately, and there is a plateau of about 2/f readings from \u{3c3} = 0.05 to 0.2 \
         and no ridge. Dashed line: the least spread without aliasing, 3/\u{3c0} = {NYQUIST_SIGMA:.3}, which the paper \
         rounds to 1.0. Eq. 6 as printed rounds to at most two values; here it rounds to multiples of f, as the paper's text says.",
        Grid::SIGMAS[0],
        Grid::SIGMAS[1],
        Grid::FORCE_STEPS[0],
        Grid::FORCE_STEPS[1],
        span(at_ridge.into_iter()),
    );
    Ok(Drawing { sheet, caption })
}

/// The panel for the paper's offsets; the same for offsets between them; a profile of both; and their optima.
pub(super) fn draw_two_points() -> Result<Drawing, FigureError> {
    const ROW_STEPS: f64 = 64.0;
    let panel = |heading, below, offsets: &[f64]| {
        let grid = Grid::whole();
        let means = grid.map(|sensor| sensor.mean_separation(offsets))?;
        Ok::<_, FigureError>(LogPanel::new([heading, below], grid, &means, |one, other| one < other))
    };
    let paper = panel("offsets 0, 0.1, ..., 0.9", "the paper's", &OFFSETS)?;
    let between = panel("offsets 0.05, 0.15, ..., 0.95", "between the paper's", &OFFSETS_BETWEEN)?;
    let title = "log\u{2081}\u{2080} of the separation in element widths; blank: none";
    let mut sheet = sheet("Separation of two points", [&paper, &between], Scale::new(-1.5, 1.0), title);

    let mut profiles = beside("Mean separation against spread", "separation");
    let mut optima = Figure::new(
        "Optimum against force steps",
        Axis::new("log\u{2082} of the force steps 1/f", "").spanning([2.0, 8.0]),
        Axis::new("best \u{3c3}", "").spanning([0.0, 0.6]),
    );
    for (panel, offsets, ink, name) in [
        (&paper, &OFFSETS, Ink::Blue, "0, 0.1, ..."),
        (&between, &OFFSETS_BETWEEN, Ink::Red, "0.05, 0.15, ..."),
    ] {
        let mean = |sensor: DiscretisingSensor| {
            [sensor.sigma(), sensor.mean_separation(offsets).unwrap_or(f64::NAN)]
        };
        let means = fine_sigmas(ROW_STEPS).map(mean)?;
        profiles = profiles.with(Series::line(means).ink(ink).label(format!("offsets {name}")));
        let best = panel.best().map(|(row, sigma, _)| [-panel.grid.force_resolutions[row].log2(), sigma]);
        optima = optima.with(Series::dots(best.collect()).ink(ink).width_px(6.0));
    }
    let profiles = profiles.with(nyquist_line([0.0, 1.0])).size_px([474.0, 176.0]);
    sheet.put([BESIDE_PX, TOP_PX - 26.0], &profiles);
    sheet.put([BESIDE_PX + 70.0, TOP_PX - 32.0], &Label::new("1/f = 64").heading());
    sheet.put([BESIDE_PX, TOP_PX + 150.0], &optima.size_px([474.0, 140.0]));

    let optimum = |panel: &LogPanel| {
        let mut sigmas: Vec<f64> = panel.best().map(|(_, sigma, _)| sigma).collect();
        sigmas.sort_unstable_by(f64::total_cmp);
        // The middle four fifths.
        let [low, middle, high] = [2, sigmas.len() / 2, sigmas.len().saturating_sub(3)];
        [low, middle, high].map(|nth| sigmas.get(nth).map_or_else(String::new, |sigma| format!("{sigma:.2}")))
    };
    let [[p10, p50, p90], [b10, b50, b90]] = [&paper, &between].map(optimum);
    let caption = format!(
        "Separation at which two points first read differently from one point of twice the force at their middle, in steps of \
         0.02 f, mean over ten positions of the middle; ranges as in Figure 6a, with 1/f whole. Dots: the least separation of each row. \
         Left: for the paper's positions the optimum is mostly {p10} to {p90}, with median {p50}, as the paper's 0.35. Next to it: for \
         as many positions between those it is {b10} to {b90}, with median {b50}. So the optimum depends on the positions 0 and 0.5, an \
         element's edge and middle: with a small spread, two points must separate from there by two elements or one before any \
         reading changes. The optimum also jumps from row to row (lower right), because the curves are flat and irregular (upper right). \
         Blank cells: no reading reaches half a step, so no separation can be detected. Dashed line: the least spread without \
         aliasing, {NYQUIST_SIGMA:.3}."
    );
    Ok(Drawing { sheet, caption })
}

/// A quantity over spread and force resolution, both on logarithmic scales; the origin is the cells' upper left corner.
struct LogPanel {
    headings: [&'static str; 2],
    grid: Grid,
    /// Row-major, the coarsest force resolution first; NaN for missing values.
    log10: Vec<f32>,
    /// Best column and its value, for each row.
    best: Vec<Option<(usize, f64)>>,
}

impl LogPanel {
    fn new(
        headings: [&'static str; 2],
        grid: Grid,
        values: &[Option<f64>],
        better: fn(f64, f64) -> bool,
    ) -> Self {
        let best_of = |row: &[Option<f64>]| {
            let there = row.iter().enumerate().filter_map(|(col, value)| value.map(|value| (col, value)));
            there.reduce(|best, one| if better(one.1, best.1) { one } else { best })
        };
        #[expect(clippy::cast_possible_truncation, reason = "a colour needs no more digits")]
        let log10 = values.iter().map(|value| value.map_or(f32::NAN, |value| value.log10() as f32)).collect();
        let best = values.chunks(grid.sigmas.len().max(1)).map(best_of).collect();
        Self { headings, grid, log10, best }
    }

    /// Row, spread and value of the best cell of each row.
    fn best(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        let rows = self.best.iter().enumerate();
        rows.filter_map(|(row, best)| best.map(|(col, value)| (row, self.grid.sigmas[col], value)))
    }

    fn size_px(&self) -> [f64; 2] {
        [self.grid.sigmas.len(), self.grid.force_resolutions.len()].map(|cells| CELL_PX * cells as f64)
    }

    /// Centre of a cell.
    fn place_px(&self, row: usize, col: usize) -> [f64; 2] {
        [CELL_PX * (col as f64 + 0.5), self.size_px()[1] - CELL_PX * (row as f64 + 0.5)]
    }
}

impl Panel for LogPanel {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size_px();
        let across = |sigma: f64| along(&self.grid.sigmas, sigma, width);
        for sigma in [0.03, 0.1, 0.3, 1.0, 3.0, 10.0] {
            let x = across(sigma);
            write!(
                f,
                r#"<path class="axis" d="M{x:.1} {height}v4"/><text class="x" x="{x:.1}" y="{:.1}">{sigma}</text>"#,
                height + 17.0
            )?;
        }
        for force_steps in [4, 8, 16, 32, 64, 128, 256] {
            let y = height - along(&self.grid.force_resolutions, 1.0 / f64::from(force_steps), height);
            write!(
                f,
                r#"<path class="axis" d="M0 {y:.1}h-4"/><text class="y" x="-7" y="{:.1}">{force_steps}</text>"#,
                y + 4.0
            )?;
        }
        for (row, best) in self.best.iter().enumerate() {
            let Some((col, _)) = best else { continue };
            let [x, y] = self.place_px(row, *col);
            write!(f, r##"<circle cx="{x:.1}" cy="{y:.1}" r="2.6" fill="#ffffff" stroke="#1b1d21"/>"##)?;
        }
        let x = across(NYQUIST_SIGMA);
        write!(
            f,
            r##"<path stroke="#ffffff" stroke-width="1.4" stroke-dasharray="5 3" d="M{x:.1} 0V{height}"/>"##
        )?;
        write!(
            f,
            r#"<text class="x name" x="{}" y="{}">spread σ</text><text class="x name" transform="translate(-38 {}) rotate(-90)">force steps 1/f</text>"#,
            width / 2.0,
            height + 35.0,
            height / 2.0
        )
    }
}

/// Position of a value on the logarithmic scale of `values`, from the outer edge of the first cell.
fn along(values: &[f64], value: f64, length_px: f64) -> f64 {
    let [Some(first), Some(last)] = [values.first(), values.last()] else { return 0.0 };
    CELL_PX / 2.0 + (length_px - CELL_PX) * (value / first).ln() / (last / first).ln()
}

/// Two panels side by side with headings and colour scale.
fn sheet(name: &str, panels: [&LogPanel; 2], scale: Scale, bar: &str) -> Sheet {
    let mut sheet = Sheet::new(name, [1070.0, 374.0]);
    for (panel, x) in panels.into_iter().zip(PANELS_PX) {
        let [heading, below] = panel.headings;
        sheet.put([x, TOP_PX - 26.0], &Label::new(heading).heading());
        sheet.put([x, TOP_PX - 10.0], &Label::new(below).muted());
        let [rows, cols] = [panel.grid.force_resolutions.len(), panel.grid.sigmas.len()];
        let heat = HeatMap { values: &panel.log10, rows, cols };
        sheet.put([x, TOP_PX], &Image { heat, cell_px: CELL_PX, scale, title: format!("{name}, {heading}") });
        sheet.put([x, TOP_PX], panel);
    }
    sheet.put([PANELS_PX[0] - 12.0, 336.0], &ColourBar { scale, title: bar.into() });
    sheet
}

/// Axes for a plot against the spread, beside the panels.
fn beside(name: &str, quantity: &str) -> Figure {
    Figure::new(
        name,
        Axis::new("spread \u{3c3}", "element widths").spanning([0.0, 1.2]),
        Axis::new(quantity, "").from_zero(),
    )
}

fn nyquist_line(range: [f64; 2]) -> Series {
    Series::line(range.map(|y| [NYQUIST_SIGMA, y]).to_vec()).ink(Ink::Muted).dotted()
}

/// A fine grid of spreads for one force resolution.
fn fine_sigmas(force_steps: f64) -> Grid {
    Grid {
        sigmas: (2..=120).map(|hundredths| f64::from(hundredths) / 100.0).collect(),
        force_resolutions: vec![1.0 / force_steps],
    }
}

/// Least and greatest value as text.
fn span(values: impl Iterator<Item = f64>) -> String {
    let [least, most] =
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], value| [a.min(value), b.max(value)]);
    format!("{} to {}", number(least, 2), number(most, 2))
}
