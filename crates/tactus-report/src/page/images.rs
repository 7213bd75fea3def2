//! The mean image of each dwell, all with one colour scale.

use std::{collections::BTreeMap, fmt};

use super::WIDTH_PX;
use crate::{
    plot::{ColourBar, HeatMap, Mosaic, Scale, Tile},
    run::{DwellSummary, PressSummary, RunReport},
};

/// Limit of drawn cells, which bounds the size of the page.
const CELLS_MAX: usize = 40_000;
/// Limit of drawn images.
const IMAGES_MAX: usize = 300;
/// What stands above an image without a place of its own.
const LABELS: &str = "above each the element under the tip, if it was at a centre, and the depth in mm.";
/// Height of a caption above an image.
const CAPTION_PX: f64 = 13.0;

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    let dwells: usize = report.presses.iter().map(|press| press.dwells.len()).sum();
    if dwells == 0 {
        return Ok(());
    }
    let values = report.presses.iter().flat_map(|press| &press.dwells).flat_map(|dwell| &dwell.rise_counts);
    let scale = Scale::of(values.map(|rise| f64::from(*rise)));
    let (mosaic, lead) =
        laid_out_like_the_array(report, scale).unwrap_or_else(|| in_order(report, scale, dwells));
    writeln!(
        f,
        "<section>\n<h2>Mean image of each dwell</h2>\n<p class=\"lead\">{lead} Row 0 is at the bottom and column 0 at the left of each image; one colour scale for all.</p>"
    )?;
    writeln!(f, "{}", ColourBar { scale, title: "counts above baseline".into() })?;
    writeln!(f, "<div class=\"scroll\">{mosaic}</div>\n</section>")
}

/// Puts each press at the position of its element; `None` unless at least half of the elements were pressed, each once.
fn laid_out_like_the_array(report: &RunReport, scale: Scale) -> Option<(Mosaic<'_>, String)> {
    const GAP_PX: [f64; 2] = [12.0, 12.0];
    const BETWEEN_PX: f64 = 2.0;
    let array = &report.array;
    let mut pressed: BTreeMap<usize, &PressSummary> = BTreeMap::new();
    for press in &report.presses {
        if pressed.insert(press.element?, press).is_some() {
            return None;
        }
    }
    let dwells: usize = pressed.values().map(|press| press.dwells.len()).sum();
    if 2 * pressed.len() < array.elements() || dwells > IMAGES_MAX || dwells * array.elements() > CELLS_MAX {
        return None;
    }
    let (rows, cols) = (array.rows(), array.cols());
    let most = pressed.values().map(|press| press.dwells.len()).max()?;
    // The images of a press make a block, a little wider than high.
    let across = (1..=most).find(|n| n * n >= most)?;
    let block_px = (WIDTH_PX - (cols - 1) as f64 * GAP_PX[0]) / cols as f64;
    let cell_px =
        ((block_px - (across - 1) as f64 * BETWEEN_PX) / (across * cols) as f64).floor().clamp(1.0, 10.0);
    let image_px = [cell_px * cols as f64 + BETWEEN_PX, cell_px * rows as f64 + BETWEEN_PX];
    let step_px = [
        across as f64 * image_px[0] - BETWEEN_PX + GAP_PX[0],
        CAPTION_PX + most.div_ceil(across) as f64 * image_px[1] - BETWEEN_PX + GAP_PX[1],
    ];
    let (mut tiles, mut captions) = (Vec::new(), Vec::new());
    for (element, press) in pressed {
        let (row, col) = (element / cols, element % cols);
        let corner = [col as f64 * step_px[0], (rows - 1 - row) as f64 * step_px[1]];
        captions.push(([corner[0], corner[1] + CAPTION_PX - 4.0], format!("{element} ({row}, {col})")));
        for (nth, dwell) in press.dwells.iter().enumerate() {
            let at_px = [
                corner[0] + (nth % across) as f64 * image_px[0],
                corner[1] + CAPTION_PX + (nth / across) as f64 * image_px[1],
            ];
            tiles.push(tile(at_px, press, dwell, nth, [rows, cols]));
        }
    }
    let lead = format!(
        "{dwells} dwells. The presses are laid out like the array. Above each press is the element at whose centre it was, with its (row, column); below are its {most} images, row by row from the first dwell to the last."
    );
    let size_px = [cols as f64 * step_px[0] - GAP_PX[0], rows as f64 * step_px[1]];
    Some((Mosaic { name: "Mean image of each dwell".into(), size_px, cell_px, scale, tiles, captions }, lead))
}

/// Images in order of time; an even selection if there are too many.
fn in_order(report: &RunReport, scale: Scale, dwells: usize) -> (Mosaic<'_>, String) {
    const IMAGE_PX: f64 = 52.0;
    const GAP_PX: [f64; 2] = [8.0, 7.0];
    let (rows, cols) = (report.array.rows(), report.array.cols());
    let shown = (CELLS_MAX / (rows * cols)).clamp(1, IMAGES_MAX).min(dwells);
    let cell_px = (IMAGE_PX / cols as f64).floor().clamp(1.0, 10.0);
    let image_px = [cell_px * cols as f64, cell_px * rows as f64];
    let step_px = [image_px[0] + GAP_PX[0], CAPTION_PX + image_px[1] + GAP_PX[1]];
    let across = (1..=shown).take_while(|n| *n as f64 * step_px[0] <= WIDTH_PX + GAP_PX[0]).count().max(1);
    let all: Vec<(&PressSummary, usize, &DwellSummary)> = report
        .presses
        .iter()
        .flat_map(|press| press.dwells.iter().enumerate().map(move |(nth, dwell)| (press, nth, dwell)))
        .collect();
    let (mut tiles, mut captions) = (Vec::new(), Vec::new());
    for n in 0..shown {
        // A varying offset, because experiments repeat depths at fixed strides.
        let offset = (n as f64 * 0.618_034).fract();
        let Some(&(press, nth, dwell)) = all.get(chosen(n as f64 + offset, dwells, shown)) else { continue };
        let corner = [(n % across) as f64 * step_px[0], (n / across) as f64 * step_px[1]];
        let element = press.element.map_or_else(|| "\u{2013}".to_owned(), |element| element.to_string());
        let caption = format!("{element}: {:.3}", dwell.depth_mm);
        captions.push(([corner[0], corner[1] + CAPTION_PX - 3.0], caption));
        tiles.push(tile([corner[0], corner[1] + CAPTION_PX], press, dwell, nth, [rows, cols]));
    }
    let lead = if shown < dwells {
        format!("{shown} of {dwells} dwells, evenly chosen, in order of time; {LABELS}")
    } else {
        format!("All {dwells} dwells in order of time; {LABELS}")
    };
    let size_px = [across.min(shown) as f64 * step_px[0], shown.div_ceil(across) as f64 * step_px[1]];
    (Mosaic { name: "Mean image of each dwell".into(), size_px, cell_px, scale, tiles, captions }, lead)
}

/// Index among all `dwells` of a position among the `shown` ones.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index into the dwells")]
fn chosen(place: f64, dwells: usize, shown: usize) -> usize {
    if shown == dwells { place.floor() as usize } else { (place * dwells as f64 / shown as f64) as usize }
}

fn tile<'a>(
    at_px: [f64; 2],
    press: &PressSummary,
    dwell: &'a DwellSummary,
    nth: usize,
    [rows, cols]: [usize; 2],
) -> Tile<'a> {
    let title = format!(
        "press {}, dwell {nth}: ({:.3}, {:.3}) mm, depth {:.3} mm, {} frames, {:.0} counts in all",
        press.index,
        press.at_mm[0],
        press.at_mm[1],
        dwell.depth_mm,
        dwell.frames,
        dwell.total_counts()
    );
    Tile { at_px, heat: HeatMap { values: &dwell.rise_counts, rows, cols }, title }
}
