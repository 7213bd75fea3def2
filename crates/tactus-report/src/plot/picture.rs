//! An image of the array as a PNG file.

use tactus_model::Array;

use super::Scale;
use super::colour::rgb;

/// Background colour.
const GROUND: [u8; 3] = [24, 24, 27];
/// Margin around the array.
const MARGIN_MM: f64 = 0.5;

/// Draws one value per element, row-major, over the element's active area; y points up.
///
/// `width_px` is the picture's width; its height follows from the array's extent. NaN is not drawn.
///
/// # Errors
/// Those of the PNG encoder.
pub fn png(
    array: &Array,
    values: &[f64],
    scale: Scale,
    width_px: u32,
) -> Result<Vec<u8>, png::EncodingError> {
    let [[x0, x1], [y0, y1]] = array.extent_mm();
    let px_per_mm = f64::from(width_px) / (x1 - x0 + 2.0 * MARGIN_MM);
    let height_px = whole((y1 - y0 + 2.0 * MARGIN_MM) * px_per_mm);
    let mut pixels: Vec<u8> = GROUND.repeat(width_px as usize * height_px as usize);
    for (index, value) in values.iter().enumerate() {
        let (Some([x, y]), Some(level)) = (array.centre_mm(index), scale.level(*value)) else { continue };
        let [half_x, half_y] = array.element_mm().map(|side| side / 2.0);
        let columns = whole((x - half_x - x0 + MARGIN_MM) * px_per_mm)
            ..whole((x + half_x - x0 + MARGIN_MM) * px_per_mm);
        let rows = whole((y1 + MARGIN_MM - y - half_y) * px_per_mm)
            ..whole((y1 + MARGIN_MM - y + half_y) * px_per_mm);
        for row in rows {
            for column in columns.clone() {
                let first = 3 * (row as usize * width_px as usize + column as usize);
                if let Some(pixel) = pixels.get_mut(first..first + 3) {
                    pixel.copy_from_slice(&rgb(level));
                }
            }
        }
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width_px, height_px);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(file)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the picture")]
fn whole(place_px: f64) -> u32 {
    place_px.round().max(0.0) as u32
}

#[cfg(test)]
#[path = "picture_tests.rs"]
mod tests;
