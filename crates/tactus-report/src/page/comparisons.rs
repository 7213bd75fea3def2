//! What the run was made for: held depths, loops, speeds, repeats, directions, maps of places, drift at rest.

use std::fmt;

use super::Element;
use crate::{
    numbers::{duration, plural, short},
    plot::{Axis, ColourBar, Figure, HeatMap, Ink, Mosaic, Scale, Series, Tile, extremes, number},
    run::{Comparisons, Directions, Ladder, PlaceMap, PressCurve, RunReport},
};

const INKS: [Ink; 6] = [Ink::Blue, Ink::Red, Ink::Green, Ink::Amber, Ink::Muted, Ink::Text];
const SIZE_PX: [f64; 2] = [680.0, 320.0];
/// Width and height of a map without its captions, at most.
const MAP_PX: f64 = 260.0;
/// Maps that are drawn at most.
const MAPS_MAX: usize = 24;

pub(super) fn sections(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    let Comparisons { holds, ladders, speeds, repeats, directions, maps, rest } = &report.comparisons;
    let cols = report.array.cols();
    self::maps(f, maps, cols)?;
    CREEP.write(f, holds, cols)?;
    self::ladders(f, ladders, cols)?;
    RATE.write(f, speeds, cols)?;
    REPEATS.write(f, repeats, cols)?;
    self::directions(f, directions, cols)?;
    drift(f, rest)
}

const CREEP: Curves = Curves {
    heading: "Held depth: creep",
    lead: "By how much the element under the tip reads more than in the first dwell, while one depth is held.",
    x: ("time held", "s"),
    from_first: true,
};

const RATE: Curves = Curves {
    heading: "Loading speed: rate dependence",
    lead: "One place and depth, pressed at several speeds. Each point is one press.",
    x: ("loading speed", "mm/s"),
    from_first: false,
};

const REPEATS: Curves = Curves {
    heading: "Repeats of one press",
    lead: "The same place and depth again and again. Each point is one press.",
    x: ("time in the run", "s"),
    from_first: false,
};

/// A section with one figure of curves, and by how much each changes.
struct Curves {
    heading: &'static str,
    lead: &'static str,
    /// Quantity and unit.
    x: (&'static str, &'static str),
    /// True if the curves are drawn from their first points on.
    from_first: bool,
}

impl Curves {
    fn write(&self, f: &mut fmt::Formatter<'_>, curves: &[PressCurve], cols: usize) -> fmt::Result {
        let Self { heading, lead, x: (quantity, unit), from_first } = self;
        if curves.is_empty() {
            return Ok(());
        }
        let response = if *from_first { "change of the response" } else { "response above baseline" };
        let mut figure = Figure::new(*heading, Axis::new(*quantity, *unit), Axis::new(response, "counts"))
            .size_px(SIZE_PX);
        for (nth, curve) in curves.iter().enumerate() {
            let zero = curve.points.first().filter(|_| *from_first).map_or(0.0, |first| first[1]);
            let points = curve.points.iter().map(|[x, counts]| [*x, counts - zero]).collect();
            let label = format!("element {}, {} mm", curve.element, short(curve.depth_mm, 3));
            let ink = INKS[nth % INKS.len()];
            figure = figure.with(Series::dots(points).ink(ink).width_px(4.5).label(label));
        }
        writeln!(
            f,
            "<section>\n<h2>{heading}</h2>\n<p class=\"lead\">{lead}</p>\n<div class=\"beside\">\n<div>{figure}</div>\n<div>"
        )?;
        for curve in curves {
            let [first, last] = ends(&curve.points);
            let rises: Vec<f64> = curve.points.iter().map(|point| point[1]).collect();
            let mean = rises.iter().sum::<f64>() / rises.len() as f64;
            let squares: f64 = rises.iter().map(|rise| (rise - mean).powi(2)).sum();
            writeln!(
                f,
                "<p>{}: {} counts at {} {unit}, {} at {} {unit}: {} counts ({} %). Standard deviation of all {}: {} counts.</p>",
                Element(curve.element, cols),
                number(first[1], 1),
                short(first[0], 2),
                number(last[1], 1),
                short(last[0], 2),
                signed(last[1] - first[1], 1),
                signed(100.0 * (last[1] - first[1]) / first[1].abs(), 1),
                rises.len(),
                number((squares / (rises.len() - 1).max(1) as f64).sqrt(), 1),
            )?;
        }
        writeln!(f, "</div>\n</div>\n</section>")
    }
}

/// Means of the points with the least and with the greatest x.
fn ends(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let of = |x: f64| {
        let there: Vec<f64> =
            points.iter().filter(|point| point[0].to_bits() == x.to_bits()).map(|point| point[1]).collect();
        [x, there.iter().sum::<f64>() / there.len() as f64]
    };
    let x = || points.iter().map(|point| point[0]);
    [of(x().fold(f64::INFINITY, f64::min)), of(x().fold(f64::NEG_INFINITY, f64::max))]
}

fn ladders(f: &mut fmt::Formatter<'_>, ladders: &[Ladder], cols: usize) -> fmt::Result {
    if ladders.is_empty() {
        return Ok(());
    }
    let axes = (Axis::new("depth", "mm").from_zero(), Axis::new("loading minus unloading", "counts"));
    let mut figure = Figure::new("Depths up and down: hysteresis", axes.0, axes.1).size_px(SIZE_PX);
    for (nth, ladder) in ladders.iter().enumerate() {
        let ink = INKS[nth % INKS.len()];
        figure = figure.with(Series::line(ladder.widths.clone()).ink(ink).width_px(1.2)).with(
            Series::dots(ladder.widths.clone())
                .ink(ink)
                .width_px(5.0)
                .label(Element(ladder.element, cols).to_string()),
        );
    }
    writeln!(
        f,
        "<section>\n<h2>Depths up and down: hysteresis</h2>\n<p class=\"lead\">Depths that one press held on the way down and on the way up: how much more the element under the tip read on the way down.</p>\n<div class=\"beside\">\n<div>{figure}</div>\n<div>"
    )?;
    for ladder in ladders {
        let Some(widest) = ladder.widths.iter().max_by(|a, b| a[1].abs().total_cmp(&b[1].abs())) else {
            continue;
        };
        let most = ladder.loading.last().map_or(f64::NAN, |deepest| deepest[1]);
        writeln!(
            f,
            "<p>{}: at most {} counts, at {} mm; {} % of its deepest reading.</p>",
            Element(ladder.element, cols),
            signed(widest[1], 1),
            short(widest[0], 3),
            number(100.0 * widest[1].abs() / most.abs(), 1),
        )?;
    }
    writeln!(f, "</div>\n</div>\n</section>")
}

fn directions(f: &mut fmt::Formatter<'_>, directions: &[Directions], cols: usize) -> fmt::Result {
    if directions.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "<section>\n<h2>Directions of approach: backlash and friction</h2>\n<p class=\"lead\">One place and depth, where the tip came from another side.</p>\n<table class=\"numbers\">\n<thead><tr><th>element</th><th class=\"n\">depth / mm</th><th class=\"n\">from x, y / mm</th><th class=\"n\">presses</th><th class=\"n\">mean / counts</th></tr></thead>"
    )?;
    for Directions { element, depth_mm, ways } in directions {
        for ([x_mm, y_mm], mean, presses) in ways {
            writeln!(
                f,
                "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}, {}</td><td class=\"n\">{presses}</td><td class=\"n\">{}</td></tr>",
                Element(*element, cols),
                short(*depth_mm, 3),
                signed(*x_mm, 1),
                signed(*y_mm, 1),
                number(*mean, 1),
            )?;
        }
    }
    writeln!(f, "</table>\n</section>")
}

fn maps(f: &mut fmt::Formatter<'_>, maps: &[PlaceMap], cols: usize) -> fmt::Result {
    if maps.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "<section>\n<h2>Maps of places</h2>\n<p class=\"lead\">What one element read in presses at the places of a grid. Each square is one place; y points up. Each map has its own colours.</p>\n<div class=\"multiples\">"
    )?;
    for map in maps.iter().take(MAPS_MAX) {
        let PlaceMap { element, covering_mm, depth_mm, x_mm, y_mm, rise_counts } = map;
        let finite = || rise_counts.iter().copied().map(f64::from).filter(|rise| rise.is_finite());
        let [least, most] =
            [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
        let scale = Scale::new(least, most);
        let cell_px = (MAP_PX / x_mm.len().max(y_mm.len()) as f64).floor().clamp(1.0, 32.0);
        let heat = HeatMap { values: rise_counts, rows: y_mm.len(), cols: x_mm.len() };
        let size_px = [cell_px * x_mm.len() as f64, cell_px * y_mm.len() as f64];
        let name = format!(
            "{} at {} mm under {} mm",
            Element(*element, cols),
            short(*depth_mm, 3),
            short(*covering_mm, 3)
        );
        let tiles = vec![Tile { at_px: [0.0, 0.0], heat, title: name.clone() }];
        let mosaic = Mosaic { name, size_px, cell_px, scale, tiles, captions: Vec::new() };
        let range = |places: &[f64]| match places {
            [first, .., last] => format!("{} to {} mm", short(*first, 3), short(*last, 3)),
            _ => String::new(),
        };
        writeln!(
            f,
            "<figure>{mosaic}<figcaption><b>{}</b>, depth {} mm, covering {} mm: {} to {} counts; x {}, y {}</figcaption></figure>",
            Element(*element, cols),
            short(*depth_mm, 3),
            short(*covering_mm, 3),
            number(least, 0),
            number(most, 0),
            range(x_mm),
            range(y_mm),
        )?;
    }
    writeln!(
        f,
        "</div>\n{}",
        ColourBar { scale: Scale::new(0.0, 1.0), title: "from the least to the greatest of each map".into() }
    )?;
    if maps.len() > MAPS_MAX {
        writeln!(f, "<p>The first {MAPS_MAX} of {} are drawn.</p>", plural(maps.len() as u64, "map"))?;
    }
    writeln!(f, "</section>")
}

fn drift(f: &mut fmt::Formatter<'_>, rest: &[[f64; 2]]) -> fmt::Result {
    let (Some(first), Some(last)) = (rest.first(), rest.last()) else { return Ok(()) };
    let figure =
        Figure::new("Drift at rest", Axis::new("time", "s"), Axis::new("mean of all elements", "counts"));
    let figure = figure.size_px(SIZE_PX);
    let columns = figure.columns();
    let figure = figure.with(Series::dots(extremes(rest, columns)).ink(Ink::Blue).width_px(3.0));
    writeln!(
        f,
        "<section>\n<h2>Drift at rest</h2>\n<p class=\"lead\">The mean of all elements while the tip was up, above that of the first second. Each point is the mean of a second.</p>\n<div class=\"beside\">\n<div>{figure}</div>\n<div><p>{} counts over {}.</p></div>\n</div>\n</section>",
        signed(last[1], 2),
        duration(last[0] - first[0]),
    )
}

/// A number with its sign.
fn signed(value: f64, decimals: usize) -> String {
    let text = number(value, decimals);
    if value > 0.0 { format!("+{text}") } else { text }
}
