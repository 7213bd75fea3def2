//! Image files.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use tactus_model::Array;
use tactus_report::plot::{Scale, png};

/// Width of a picture.
const WIDTH_PX: u32 = 860;

/// Writes each image as PNG (scaled from least to greatest, as in the paper's Fig. 8) or CSV (counts, row 0 first). From
/// the second on, file names end in the image's number.
pub(super) fn write(out: &Path, array: &Array, images: &[Vec<f64>]) -> anyhow::Result<()> {
    for (place, image) in images.iter().enumerate() {
        let path = if place == 0 { out.to_owned() } else { numbered(out, place + 1) };
        let file = match out.extension().and_then(|extension| extension.to_str()) {
            Some("png") => {
                let ends = image.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], counts| {
                    [least.min(*counts), most.max(*counts)]
                });
                png(array, image, Scale::new(ends[0], ends[1]), WIDTH_PX)?
            }
            Some("csv") => csv(array, image).into_bytes(),
            _ => bail!("{}: an image is written as .png or .csv", out.display()),
        };
        std::fs::write(&path, file).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(())
}

fn numbered(out: &Path, number: usize) -> PathBuf {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let extension = out.extension().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}-{number}.{extension}"))
}

fn csv(array: &Array, image: &[f64]) -> String {
    let mut text = String::new();
    for row in image.chunks(array.cols()) {
        let cells: Vec<_> = row.iter().map(f64::to_string).collect();
        // Writing to a string cannot fail.
        let _written = writeln!(text, "{}", cells.join(","));
    }
    text
}
