//! The array in the rig file and the model file.

use serde::{Deserialize, Serialize};
use tactus_model::{Array, ArrayError};

use super::number::finite;
use super::{WrongField, wrong};

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawArray {
    /// Name of the array.
    name: String,
    /// Number of rows.
    rows: usize,
    /// Number of columns.
    cols: usize,
    /// Sides of an element's active rectangle along x and y.
    element_mm: [f64; 2],
    /// x of each column's centre, rising, in the sensor's frame.
    col_centres_mm: Vec<f64>,
    /// y of each row's centre, rising, in the sensor's frame.
    row_centres_mm: Vec<f64>,
    /// Frames per second of the device.
    rate_hz: f64,
    /// Least reading, below 0 where readings have a sign; 0 without this key.
    #[serde(default, skip_serializing_if = "is_zero")]
    least_counts: f64,
    /// Greatest reading.
    full_scale_counts: f64,
    /// Step of the converter.
    step_counts: f64,
}

impl RawArray {
    pub(crate) fn of(array: &Array) -> Self {
        Self {
            name: array.name().into(),
            rows: array.rows(),
            cols: array.cols(),
            element_mm: array.element_mm(),
            col_centres_mm: array.col_centres_mm().to_vec(),
            row_centres_mm: array.row_centres_mm().to_vec(),
            rate_hz: array.rate_hz(),
            least_counts: array.least_counts(),
            full_scale_counts: array.full_scale_counts(),
            step_counts: array.step_counts(),
        }
    }

    pub(crate) fn check<E>(self, field: &str) -> Result<Array, E>
    where
        E: From<WrongField> + From<ArrayError>,
    {
        for (name, stated, listed) in
            [("rows", self.rows, self.row_centres_mm.len()), ("cols", self.cols, self.col_centres_mm.len())]
        {
            if stated != listed {
                let problem = format!("says {stated}, but {listed} centres are listed");
                return Err(wrong(format!("{field}.{name}"), problem).into());
            }
        }
        let array = Array::new(
            self.name,
            self.element_mm,
            self.col_centres_mm,
            self.row_centres_mm,
            self.rate_hz,
            self.full_scale_counts,
            self.step_counts,
        )?;
        let least_counts = finite(format!("{field}.least_counts"), self.least_counts)?;
        Ok(array.with_least_counts(least_counts)?)
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_zero(counts: &f64) -> bool {
    *counts == 0.0
}
