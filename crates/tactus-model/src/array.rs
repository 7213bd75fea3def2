//! The array of elements: how many, how large, where.

/// A rectangular grid of equal, axis-parallel elements in the sensor frame.
///
/// Element `(row, col)` has index `row * cols + col`; row 0, column 0 stands at the origin corner,
/// columns run along x and rows along y. Centres need not be evenly spaced.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    name: String,
    element_mm: [f64; 2],
    col_centres_mm: Vec<f64>,
    row_centres_mm: Vec<f64>,
    rate_hz: f64,
    least_counts: f64,
    full_scale_counts: f64,
    step_counts: f64,
}

/// Why a description does not make an array.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ArrayError {
    /// No rows or no columns.
    #[error("an array needs at least one row and one column")]
    Empty,
    /// A size, rate or count is not a positive, finite number.
    #[error("{field} must be a positive, finite number, not {value}")]
    NotPositive {
        /// Name of the field in the rig description.
        field: &'static str,
        value: f64,
    },
    /// The least reading is no number below the greatest.
    #[error(
        "least_counts must be a finite number below full_scale_counts ({full_scale_counts}), not {least_counts}"
    )]
    LeastCounts { least_counts: f64, full_scale_counts: f64 },
    /// Centres do not rise, or elements overlap.
    #[error("{field}[{index}] must exceed its predecessor by at least one element size ({element_mm} mm)")]
    Overlap {
        /// Name of the field in the rig description.
        field: &'static str,
        index: usize,
        element_mm: f64,
    },
}

impl Array {
    /// An array from its description; all lengths in mm.
    ///
    /// # Errors
    /// [`ArrayError`] names the field that is wrong.
    pub fn new(
        name: impl Into<String>,
        element_mm: [f64; 2],
        col_centres_mm: Vec<f64>,
        row_centres_mm: Vec<f64>,
        rate_hz: f64,
        full_scale_counts: f64,
        step_counts: f64,
    ) -> Result<Self, ArrayError> {
        if col_centres_mm.is_empty() || row_centres_mm.is_empty() {
            return Err(ArrayError::Empty);
        }
        for (field, value) in [
            ("element_mm[0]", element_mm[0]),
            ("element_mm[1]", element_mm[1]),
            ("rate_hz", rate_hz),
            ("full_scale_counts", full_scale_counts),
            ("step_counts", step_counts),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(ArrayError::NotPositive { field, value });
            }
        }
        for (field, centres, size) in [
            ("col_centres_mm", &col_centres_mm, element_mm[0]),
            ("row_centres_mm", &row_centres_mm, element_mm[1]),
        ] {
            // Centres are written in decimal: allow for the rounding of their difference.
            let least_mm = size * (1.0 - 1e-9);
            let apart = |pair: &[f64]| matches!(pair, [a, b] if b - a >= least_mm && b.is_finite());
            if let Some(index) = centres.windows(2).position(|pair| !apart(pair)) {
                return Err(ArrayError::Overlap { field, index: index + 1, element_mm: size });
            }
        }
        Ok(Self {
            name: name.into(),
            element_mm,
            col_centres_mm,
            row_centres_mm,
            rate_hz,
            least_counts: 0.0,
            full_scale_counts,
            step_counts,
        })
    }

    /// The same array, whose readings begin at another count than 0, such as those of a signed converter.
    ///
    /// # Errors
    /// [`ArrayError::LeastCounts`] if that is no finite number below full scale.
    pub fn with_least_counts(self, least_counts: f64) -> Result<Self, ArrayError> {
        let full_scale_counts = self.full_scale_counts;
        if !(least_counts.is_finite() && least_counts < full_scale_counts) {
            return Err(ArrayError::LeastCounts { least_counts, full_scale_counts });
        }
        Ok(Self { least_counts, ..self })
    }

    /// The DigiTacts array of the paper (Fig. 1): two sensors of 6 x 4 elements side by side.
    ///
    /// Elements are 1.8 mm squares 0.2 mm apart, except at the middle column gap of each sensor,
    /// which is 0.4 mm; 30 Hz, 12 bit.
    pub fn digitacts() -> Self {
        Self {
            name: "digitacts".into(),
            element_mm: [1.8, 1.8],
            col_centres_mm: vec![0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3],
            row_centres_mm: vec![0.9, 2.9, 4.9, 6.9, 8.9, 10.9],
            rate_hz: 30.0,
            least_counts: 0.0,
            full_scale_counts: 4095.0,
            step_counts: 1.0,
        }
    }

    /// The resolution of the human fingertip (paper, Fig. 10): 14 rows of 20 at 70 per cm2.
    ///
    /// Touch receptors have no edges. The elements here fill the same share of their pitch as those of the `DigiTacts`.
    pub fn fingertip() -> Self {
        Self::even("fingertip", [14, 20], 70.0)
    }

    /// The resolution of the Tekscan sensor 5027 (paper, Fig. 10): 26 rows of 36 at 248 per cm2.
    pub fn tekscan_5027() -> Self {
        Self::even("tekscan-5027", [26, 36], 248.0)
    }

    /// The shipped arrays: `digitacts`, `fingertip` and `tekscan-5027`.
    pub fn shipped() -> [Self; 3] {
        [Self::digitacts(), Self::fingertip(), Self::tekscan_5027()]
    }

    /// Evenly spaced elements, as many on each cm2 as stated, 0.9 of their pitch wide; 30 Hz, 12 bit.
    fn even(name: &str, [rows, cols]: [u32; 2], per_cm2: f64) -> Self {
        let pitch_mm = 10.0 / per_cm2.sqrt();
        let centres = |count: u32| (0..count).map(|place| (f64::from(place) + 0.45) * pitch_mm).collect();
        Self {
            name: name.into(),
            element_mm: [0.9 * pitch_mm; 2],
            col_centres_mm: centres(cols),
            row_centres_mm: centres(rows),
            rate_hz: 30.0,
            least_counts: 0.0,
            full_scale_counts: 4095.0,
            step_counts: 1.0,
        }
    }

    /// Name of the array's kind, such as `digitacts`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of rows (along y).
    pub fn rows(&self) -> usize {
        self.row_centres_mm.len()
    }

    /// Number of columns (along x).
    pub fn cols(&self) -> usize {
        self.col_centres_mm.len()
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.rows() * self.cols()
    }

    /// Size of an element's active square along x and y.
    pub fn element_mm(&self) -> [f64; 2] {
        self.element_mm
    }

    /// Centres of the columns along x, sensor frame.
    pub fn col_centres_mm(&self) -> &[f64] {
        &self.col_centres_mm
    }

    /// Centres of the rows along y, sensor frame.
    pub fn row_centres_mm(&self) -> &[f64] {
        &self.row_centres_mm
    }

    /// Centre of element `index` in the sensor frame, or `None` past the last element.
    pub fn centre_mm(&self, index: usize) -> Option<[f64; 2]> {
        let (row, col) = (index / self.cols(), index % self.cols());
        Some([*self.col_centres_mm.get(col)?, *self.row_centres_mm.get(row)?])
    }

    /// Frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Least reading; 0 unless said otherwise.
    pub fn least_counts(&self) -> f64 {
        self.least_counts
    }

    /// True if both are the same, but for a least reading that one of them does not say.
    pub fn is_like(&self, other: &Self) -> bool {
        let is_unsaid = self.least_counts == 0.0 || other.least_counts == 0.0;
        self == other || is_unsaid && Self { least_counts: other.least_counts, ..self.clone() } == *other
    }

    /// Largest reading.
    pub fn full_scale_counts(&self) -> f64 {
        self.full_scale_counts
    }

    /// Smallest difference of two readings.
    pub fn step_counts(&self) -> f64 {
        self.step_counts
    }

    /// Median distance between the centres of neighbours along x: the "sensor element width" in which the
    /// paper states lengths; the element's size where there is one column only.
    pub fn pitch_mm(&self) -> f64 {
        let mut steps_mm: Vec<f64> = self.col_centres_mm.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps_mm.sort_by(f64::total_cmp);
        steps_mm.get(steps_mm.len() / 2).copied().unwrap_or(self.element_mm[0])
    }

    /// Least and greatest x and y of the active area: `[[x_min, x_max], [y_min, y_max]]`.
    pub fn extent_mm(&self) -> [[f64; 2]; 2] {
        let along = |centres: &[f64], size: f64| {
            let least = centres.first().copied().unwrap_or_default();
            let most = centres.last().copied().unwrap_or_default();
            [least - size / 2.0, most + size / 2.0]
        };
        [along(&self.col_centres_mm, self.element_mm[0]), along(&self.row_centres_mm, self.element_mm[1])]
    }

    /// Least and greatest x of each column, and y of each row.
    pub(crate) fn sides_mm(&self) -> [Vec<[f64; 2]>; 2] {
        let sides = |centres: &[f64], size: f64| {
            centres.iter().map(|centre| [centre - size / 2.0, centre + size / 2.0]).collect()
        };
        [sides(&self.col_centres_mm, self.element_mm[0]), sides(&self.row_centres_mm, self.element_mm[1])]
    }
}

#[cfg(test)]
#[path = "array_tests.rs"]
mod tests;
