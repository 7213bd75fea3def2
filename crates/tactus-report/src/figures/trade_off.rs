//! Costs and benefits of a covering's thickness; derived from the paper's Figure 6.

use tactus_calibrate::design::{Covered, Design};

use crate::plot::{Axis, Figure, Ink, Label, Series, Sheet, number};

/// Draws spread, locations, separation and the amplitude passed at the Nyquist frequency against a covering's thickness,
/// and marks the recommended covering.
pub fn trade_off(design: &Design) -> Sheet {
    const SIZE_PX: [f64; 2] = [500.0, 250.0];
    let Design { pitch_mm, force_steps, min_sigma, recommended, curve, .. } = design;
    let thickest = curve.last().map_or(0.0, |covered| covered.thickness_mm);
    let plot = |quantity: &str, unit: &str, of: fn(&Covered) -> f64, limit: Option<Series>| {
        let point = |covered: &Covered| [covered.thickness_mm, of(covered)];
        let papers = curve.iter().filter(|covered| covered.of_the_paper).map(point);
        let x = Axis::new("thickness of the covering", "mm").spanning([0.0, thickest]);
        let figure = Figure::new(quantity, x, Axis::new(quantity, unit).from_zero()).size_px(SIZE_PX);
        limit
            .into_iter()
            .fold(figure, Figure::with)
            .with(Series::line(curve.iter().map(point).collect()).ink(Ink::Blue))
            .with(Series::dots(papers.collect()).ink(Ink::Blue).width_px(7.0).label("the paper's coverings"))
            .with(Series::dots(vec![point(recommended)]).ink(Ink::Red).width_px(11.0).label("recommended"))
    };
    let wanted = Series::line(vec![[0.0, *min_sigma], [thickest, *min_sigma]]);
    let wanted = wanted.ink(Ink::Muted).dashed().label("least wanted");
    let panels = [
        plot("spread", "pitches", |covered| covered.acuity.sigma, Some(wanted)),
        plot("distinct locations in an element", "", |covered| covered.acuity.locations as f64, None),
        plot(
            "separation of two points",
            "mm",
            |covered| covered.acuity.separation_mm.unwrap_or(f64::NAN),
            None,
        ),
        plot("passes at the Nyquist frequency", "%", |covered| 100.0 * covered.nyquist_passed, None),
    ];
    let mut sheet = Sheet::new("Which covering", [2.0 * SIZE_PX[0] + 24.0, 2.0 * SIZE_PX[1] + 72.0]);
    let heading = format!(
        "Covering for elements {pitch_mm} mm apart and {force_steps} force steps: {} mm, spread {} pitches",
        number(recommended.thickness_mm, 3),
        number(recommended.acuity.sigma, 2)
    );
    sheet.put([0.0, 12.0], &Label::new(heading).heading());
    let below = "computed for five elements in a row without noise, so these are bounds; spread by Eq. 4";
    sheet.put([0.0, 29.0], &Label::new(below).muted());
    for (nth, panel) in panels.iter().enumerate() {
        let [col, row] = [nth % 2, nth / 2];
        sheet.put([col as f64 * (SIZE_PX[0] + 24.0), 48.0 + row as f64 * (SIZE_PX[1] + 12.0)], panel);
    }
    sheet
}
