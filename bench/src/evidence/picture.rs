//! The evidence as pictures.

use std::collections::BTreeMap;
use std::fmt;

use tactus_hidden::CATALOGUE;
use tactus_report::plot::{Axis, Figure, Ink, Label, Panel, Series, Sheet};

use super::rate::Rate;
use super::score::{Cell, PowerPoint, Scores, Z_DETECTABLE, oracle};

/// File name and SVG of each picture.
pub fn pictures(scores: &Scores) -> [(&'static str, String); 2] {
    [
        ("discovery-confusion.svg", confusion(&scores.confusion).to_string()),
        ("discovery-power.svg", power(&scores.power).to_string()),
    ]
}

const CELL_PX: f64 = 26.0;
const NAMES_PX: f64 = 170.0;
const HEADS_PX: f64 = 150.0;

/// Rows are hidden effects, columns named ones. A cell's colour and number are its share of the row, in percent.
fn confusion(cells: &[Cell]) -> Sheet {
    let effects = effects();
    let rows: Vec<&str> = effects.iter().copied().chain(["outside the library", "nothing"]).collect();
    let columns: Vec<&str> = effects.iter().copied().chain(["several", "unexplained", "nothing"]).collect();
    let size = [NAMES_PX + CELL_PX * columns.len() as f64 + 60.0, HEADS_PX + CELL_PX * rows.len() as f64];
    let mut sheet = Sheet::new("Hidden effects against named effects", size);
    sheet.put([0.0, HEADS_PX - 12.0], &Label::new("hidden").heading());
    let beside = NAMES_PX + CELL_PX * columns.len() as f64 + 8.0;
    sheet.put([beside, HEADS_PX - 12.0], &Label::new("sets").heading());
    for (column, name) in columns.iter().enumerate() {
        let x = NAMES_PX + CELL_PX * (column as f64 + 0.65);
        sheet.put([x, HEADS_PX - 8.0], &Slanted(name));
    }
    for (row, truth) in rows.iter().enumerate() {
        let y = HEADS_PX + CELL_PX * row as f64;
        let of: usize = cells.iter().filter(|cell| cell.truth == *truth).map(|cell| cell.count).sum();
        sheet.put([NAMES_PX - 8.0, y + 17.0], &Label::new(*truth).right());
        sheet.put([beside, y + 17.0], &Label::new(of.to_string()).muted());
        for (column, named) in columns.iter().enumerate() {
            let found = cells.iter().find(|cell| cell.truth == *truth && cell.named == *named);
            let share = found.map_or(0.0, |cell| cell.count as f64 / of as f64);
            let is_right = truth == named || (*truth == "outside the library" && *named == "unexplained");
            sheet.put([NAMES_PX + CELL_PX * column as f64, y], &Share { share, is_right });
        }
    }
    sheet
}

const PANEL_PX: [f64; 2] = [280.0, 190.0];
const ACROSS: usize = 4;

/// Range of `lg(z / Z_DETECTABLE)`; points outside are left out.
const PLACES: [f64; 2] = [-0.5, 2.0];

/// A panel for each effect: the shares detected and named exactly against separation, and the power of the oracle.
fn power(effects: &BTreeMap<String, Vec<PowerPoint>>) -> Sheet {
    let down = effects.len().div_ceil(ACROSS);
    let height = PANEL_PX[1] + 28.0;
    let mut sheet =
        Sheet::new("Power against separation", [PANEL_PX[0] * ACROSS as f64, height * down as f64 + 30.0]);
    sheet.put(
        [70.0, 10.0],
        &Label::new(
            "green: detected; blue: named exactly; grey: a test that knows the effect; bars: 95 % intervals",
        ),
    );
    for (index, (effect, points)) in effects.iter().enumerate() {
        let [x, y] = [PANEL_PX[0] * (index % ACROSS) as f64, 30.0 + height * (index / ACROSS) as f64];
        sheet.put([x + 70.0, y + 14.0], &Label::new(effect).heading());
        sheet.put([x, y + 14.0], &power_of(effect, points));
    }
    sheet
}

fn power_of(effect: &str, points: &[PowerPoint]) -> Figure {
    let place = |z: f64| (z / Z_DETECTABLE).log10();
    let points: Vec<&PowerPoint> =
        points.iter().filter(|point| (PLACES[0]..PLACES[1]).contains(&place(point.z))).collect();
    let points = &points;
    let line = |of: fn(&PowerPoint) -> f64| points.iter().map(|point| [place(point.z), of(point)]).collect();
    let bars = |of: fn(&PowerPoint) -> Rate, aside: f64| {
        let bars = points.iter().map(move |point| {
            let [least, most] = of(point).interval;
            [place(point.z) + aside, least, most]
        });
        Series::bars(bars).opacity(0.4)
    };
    let curve = (0..=60).map(|step| {
        let place = PLACES[0] + (PLACES[1] - PLACES[0]) * f64::from(step) / 60.0;
        [place, oracle(Z_DETECTABLE * 10_f64.powf(place))]
    });
    Figure::new(
        format!("Power, {effect}"),
        Axis::new("lg(z / 4)", "").spanning(PLACES),
        Axis::new("share", "").spanning([0.0, 1.0]),
    )
    .size_px(PANEL_PX)
    .with(Series::line(curve.collect()).ink(Ink::Muted).dashed())
    .with(bars(|point| point.detected, 0.0).ink(Ink::Green))
    .with(bars(|point| point.exact, 0.02).ink(Ink::Blue))
    .with(Series::line(line(|point| point.detected.share)).ink(Ink::Green))
    .with(Series::dots(line(|point| point.detected.share)).ink(Ink::Green))
    .with(Series::line(line(|point| point.exact.share)).ink(Ink::Blue))
    .with(Series::dots(line(|point| point.exact.share)).ink(Ink::Blue))
}

/// The library's effects, in the order of the catalogue.
fn effects() -> Vec<&'static str> {
    let mut effects: Vec<&str> = CATALOGUE.iter().filter_map(|definition| definition.effect).collect();
    effects.dedup();
    effects
}

/// The head of a column.
struct Slanted<'a>(&'a str);

impl Panel for Slanted<'_> {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(r#"<g transform="rotate(-60)">"#)?;
        Label::new(self.0).draw(f)?;
        f.write_str("</g>")
    }
}

/// A cell: blue where the name is right, red where it is not.
struct Share {
    share: f64,
    is_right: bool,
}

impl Panel for Share {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ink = if self.is_right { "--blue" } else { "--red" };
        let side = CELL_PX - 1.0;
        // A path is styled by the sheet's classes; these are squares of their own.
        write!(f, r#"<rect width="{side}" height="{side}" style="fill: var(--grid); fill-opacity: 0.5"/>"#)?;
        if self.share <= 0.0 {
            return Ok(());
        }
        let opacity = 0.15 + 0.85 * self.share;
        write!(
            f,
            r#"<rect width="{side}" height="{side}" style="fill: var({ink}); fill-opacity: {opacity:.2}"/>"#
        )?;
        let [x, y] = [side / 2.0, side / 2.0 + 4.0];
        let colour = if self.share > 0.45 { "#fff" } else { "var(--ink)" };
        write!(
            f,
            r#"<text class="x" x="{x}" y="{y}" style="fill: {colour}; font-size: 10px">{:.0}</text>"#,
            100.0 * self.share
        )
    }
}
