//! Figure 3: impulse responses of coverings by finite elements, and the paper's Gaussians.

use std::f64::consts::PI;

use tactus_solid::{
    fem::{Bricks, BricksError, Reaction},
    layered::{BaseContact, Layer},
};

use super::{Drawing, FigureError};
use crate::{
    fit::Polynomial,
    plot::{Axis, Figure, Ink, Label, Series, Sheet, number},
};

/// Bricks along a side, and layers of them (paper, Fig. 3).
const ACROSS: u32 = 100;
const LAYERS: [u32; 6] = [5, 6, 7, 8, 9, 10];
/// Poisson's ratio of the drawn responses; the paper gives none.
const POISSON_RATIO: f64 = 0.45;
/// Range of Poisson's ratios of covering materials, and a value between.
const POISSON_RATIOS: [f64; 3] = [0.3, 0.45, 0.49];
/// The paper's spread in bricks: `0.5 t + 0.9` at `t` layers.
const PAPER: [f64; 2] = [0.9, 0.5];

/// Spread of the best-fitting Gaussian against thickness, in cubes of side 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Widening {
    /// Poisson's ratio of the covering.
    pub poisson_ratio: f64,
    /// Thickness in layers and spread in bricks.
    pub sigmas: Vec<[f64; 2]>,
    /// Intercept in bricks and slope of the fitted line.
    pub line: [f64; 2],
    /// Spread divided by thickness for a continuous elastic layer.
    pub of_layer: f64,
}

impl Widening {
    /// Computes the spreads of coverings of 5 to 10 layers.
    ///
    /// # Errors
    /// If Poisson's ratio is not in `[0, 0.5)`.
    pub fn new(poisson_ratio: f64) -> Result<Self, FigureError> {
        let sigma =
            |layers: &u32| Ok([f64::from(*layers), respond(*layers, poisson_ratio)?.gaussian_sigma_mm()]);
        let sigmas = LAYERS.iter().map(sigma).collect::<Result<Vec<_>, BricksError>>()?;
        let line =
            Polynomial::fit(1, &sigmas).map_or([0.0; 2], |line| [line.at(0.0), line.at(1.0) - line.at(0.0)]);
        let of_layer = Layer::new(1.0, poisson_ratio, BaseContact::Bonded)?.gaussian_sigma_mm();
        Ok(Self { poisson_ratio, sigmas, line, of_layer })
    }
}

/// Draws the forces along the middle of the base for coverings of several layers, the paper's Gaussians for them, and the
/// spread of the best Gaussians against thickness. Up to six responses and three widenings, in cubes of side 1.
pub fn impulse_responses(responses: &[(u32, Reaction)], widenings: &[Widening]) -> Sheet {
    const INKS: [Ink; 6] = [Ink::Red, Ink::Amber, Ink::Green, Ink::Blue, Ink::Muted, Ink::Text];
    const REACH: f64 = 20.0;
    const SIZE_PX: [f64; 2] = [466.0, 320.0];
    const BELOW_PX: f64 = 372.0;
    let panel = |name: &str| {
        let x = Axis::new("distance from the load", "bricks").spanning([-REACH, REACH]);
        Figure::new(name, x, Axis::new("force on a node", "load").spanning([0.0, 0.03])).size_px(SIZE_PX)
    };
    let (mut elastic, mut gaussian) = (panel("Finite elements"), panel("Gaussians"));
    for ((layers, reaction), ink) in responses.iter().zip(INKS) {
        let line: Vec<_> = reaction.centre_line().into_iter().filter(|[x, _]| x.abs() <= REACH).collect();
        let sigma = PAPER[0] + PAPER[1] * f64::from(*layers);
        let spread = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp() / (2.0 * PI * sigma * sigma);
        let values = line.iter().map(|[x, _]| [*x, spread(*x)]).collect();
        let label = if *layers == responses[0].0 { format!("{layers} layers") } else { layers.to_string() };
        elastic = elastic.with(Series::dots(line.clone()).ink(ink).width_px(3.0));
        elastic = elastic.with(Series::line(line).ink(ink).label(label.clone()));
        gaussian = gaussian.with(Series::line(values).ink(ink).label(label));
    }
    let mut widths = Figure::new(
        "Spread against thickness",
        Axis::new("thickness t", "layers").spanning([0.0, 10.5]),
        Axis::new("\u{3c3} of the best Gaussian", "bricks").from_zero(),
    )
    .size_px(SIZE_PX);
    let along = |[intercept, slope]: [f64; 2]| vec![[0.0, intercept], [10.5, intercept + 10.5 * slope]];
    widths = widths.with(Series::line(along(PAPER)).ink(Ink::Red).dashed().label("paper"));
    for (widening, ink) in widenings.iter().zip([Ink::Blue, Ink::Green, Ink::Amber]) {
        let label = format!("\u{3bd} = {}", number(widening.poisson_ratio, 2));
        widths = widths.with(Series::line(along(widening.line)).ink(ink).label(label));
        widths = widths.with(Series::dots(widening.sigmas.clone()).ink(ink).width_px(5.0));
    }

    let mut sheet = Sheet::new("Impulse responses of coverings", [946.0, BELOW_PX + SIZE_PX[1]]);
    let headings = [
        ([0.0, 10.0], "a", "Forces at the base, by finite elements", &elastic),
        ([480.0, 10.0], "b", "Gaussians of \u{3c3} = 0.5 t + 0.9", &gaussian),
        ([0.0, BELOW_PX], "c", "\u{3c3} of the Gaussians most like (a), against thickness", &widths),
    ];
    for ([x, y], letter, heading, figure) in headings {
        sheet.put([x + 8.0, y], &Label::new(format!("{letter}  {heading}")).heading());
        sheet.put([x, y + 8.0], figure);
    }
    table(&mut sheet, [508.0, BELOW_PX + 40.0], widenings);
    sheet
}

/// Table of the fitted lines and the paper's.
fn table(sheet: &mut Sheet, [x, y]: [f64; 2], widenings: &[Widening]) {
    const COLUMNS_PX: [f64; 4] = [0.0, 138.0, 206.0, 330.0];
    const ROW_PX: f64 = 24.0;
    let mut rows = vec![
        ["Poisson's ratio \u{3bd}", "slope", "intercept / bricks", "layer, no bricks"].map(String::from),
    ];
    rows.extend(widenings.iter().map(|widening| {
        let [intercept, slope] = widening.line;
        [
            number(widening.poisson_ratio, 2),
            number(slope, 3),
            number(intercept, 2),
            format!("{} t", number(widening.of_layer, 3)),
        ]
    }));
    rows.push(["paper: not given".into(), number(PAPER[1], 1), number(PAPER[0], 1), String::new()]);
    for (row, texts) in rows.into_iter().enumerate() {
        for (text, column_px) in texts.into_iter().zip(COLUMNS_PX) {
            let label = Label::new(text);
            let label = if row == 0 { label.muted() } else { label };
            sheet.put([x + column_px, y + ROW_PX * row as f64], &label);
        }
    }
    let notes = [
        "Slope: elasticity. An elastic layer has one length, its thickness,",
        "and its response can widen only in proportion to it.",
        "Intercept: about 0.2 bricks come from the mesh, whose load and",
        "nodes are each one brick wide. The other 0.7 of the paper's 0.9",
        "come neither from the covering nor from the mesh.",
    ];
    for (line, note) in notes.into_iter().enumerate() {
        sheet.put([x, y + ROW_PX * 6.0 + 18.0 * line as f64], &Label::new(note).muted());
    }
}

pub(super) fn draw() -> Result<Drawing, FigureError> {
    let response = |layers| Ok((layers, respond(layers, POISSON_RATIO)?));
    let responses = LAYERS.into_iter().map(response).collect::<Result<Vec<_>, BricksError>>()?;
    let widenings = POISSON_RATIOS.into_iter().map(Widening::new).collect::<Result<Vec<_>, _>>()?;
    let [least, most] = widenings.iter().fold([f64::INFINITY, 0.0], |[least, most], widening| {
        [widening.line[1].min(least), widening.line[1].max(most)]
    });
    let caption = format!(
        "(a) Vertical forces on the nodes along the middle of the base under a force of 1 on the node at the middle of the \
         top: {ACROSS} x {ACROSS} bricks in 5 to 10 layers, linear elastic, bonded to the base, sides on rollers. The paper \
         gives neither units, nor the bricks' shape, nor Poisson's ratio; here the bricks are cubes of side 1 with a ratio of \
         {POISSON_RATIO} and mean dilatation, which prevents locking. Directly below the load the forces differ from those of \
         an elastic layer by 10 % of the peak with 5 layers and 4 % with 10. (b) The same force convolved with the paper's \
         Gaussian of \u{3c3} = 0.5 t + 0.9, t in layers, each of unit volume. It is lower and wider than (a). (c) The spread \
         of the Gaussian most similar to all forces of the base (Eq. 3), and lines fitted to the spreads. The slope is {} \
         to {}, near the paper's 0.5, for Poisson's ratios from 0.30 to 0.49. The intercept of 0.9 is not reproduced, and no \
         elastic covering gives it.",
        number(least, 2),
        number(most, 2),
    );
    Ok(Drawing { sheet: impulse_responses(&responses, &widenings), caption })
}

/// Forces at the base of cubes of side 1 with a force at the middle of the top.
fn respond(layers: u32, poisson_ratio: f64) -> Result<Reaction, BricksError> {
    Ok(Bricks::cubes(ACROSS, layers, 1.0, poisson_ratio)?.under_point())
}
