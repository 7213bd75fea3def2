//! The raster over the sensor, and the share of each cell that arrives at each column and row of elements.

use std::ops::Range;

use tactus_model::{Array, Blur};

use crate::RenderError;

/// Distance in `sigma` at which the blur's tail is cut; 1e-7 of the volume lies beyond.
const REACH_SIGMAS: f64 = 5.2;

/// Most cells along an axis: their number fits 16 bits in a facet.
const CELLS_MAX: f64 = 60_000.0;

/// Square cells fixed in the sensor frame, over the array and as far around it as the blur reaches.
#[derive(Debug, Clone)]
pub(crate) struct Lattice {
    pub(crate) cell_mm: f64,
    /// Along x and y.
    pub(crate) axes: [Axis; 2],
}

/// The cells along x with the columns of elements, or along y with the rows.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// Where the first cell begins.
    pub(crate) origin_mm: f64,
    pub(crate) cells: usize,
    /// For each column (or row), the length in mm of each cell that arrives in it.
    shares_mm: Vec<Vec<f32>>,
    /// For each column (or row), the cells from which anything arrives.
    reaches: Vec<Range<usize>>,
}

impl Lattice {
    /// `cell_mm`: positive; `sigma_mm`: positive.
    pub(crate) fn new(array: &Array, sigma_mm: f64, cell_mm: f64) -> Result<Self, RenderError> {
        let [width_mm, height_mm] = array.element_mm();
        Ok(Self {
            cell_mm,
            axes: [
                Axis::new(array.col_centres_mm(), width_mm, sigma_mm, cell_mm)?,
                Axis::new(array.row_centres_mm(), height_mm, sigma_mm, cell_mm)?,
            ],
        })
    }

    /// Length of the lattice along x and y.
    pub(crate) fn spans_mm(array: &Array, sigma_mm: f64) -> [f64; 2] {
        array.extent_mm().map(|[least, most]| most - least + 2.0 * REACH_SIGMAS * sigma_mm)
    }
}

impl Axis {
    fn new(centres_mm: &[f64], side_mm: f64, sigma_mm: f64, cell_mm: f64) -> Result<Self, RenderError> {
        let reach_mm = side_mm / 2.0 + REACH_SIGMAS * sigma_mm;
        let least_mm = centres_mm.iter().copied().fold(f64::INFINITY, f64::min) - reach_mm;
        let most_mm = centres_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max) + reach_mm;
        let finest_mm = (most_mm - least_mm) / CELLS_MAX;
        if !cell_mm.is_finite() || cell_mm < finest_mm {
            return Err(RenderError::Cell { cell_mm, least_mm: finest_mm });
        }
        let cells = whole(((most_mm - least_mm) / cell_mm).ceil());
        // The depth of a cell counts as uniform over it. On average over positions of the lattice this adds cell^2 / 6 to
        // the blur's variance, which is subtracted here.
        let variance_mm2 = sigma_mm * sigma_mm;
        let blur = Blur { sigma_mm: (variance_mm2 - cell_mm * cell_mm / 6.0).max(variance_mm2 / 2.0).sqrt() };
        let edge_mm = |cell: usize| least_mm + cell as f64 * cell_mm;
        let reach = |centre_mm: &f64| {
            let [from, to] = [centre_mm - reach_mm, centre_mm + reach_mm].map(|mm| (mm - least_mm) / cell_mm);
            whole(from.floor())..whole(to.ceil()).min(cells)
        };
        let reaches: Vec<_> = centres_mm.iter().map(reach).collect();
        let share = |centre_mm: &f64, cell: usize| {
            let side = [centre_mm - side_mm / 2.0, centre_mm + side_mm / 2.0];
            single(blur.of_line([edge_mm(cell), edge_mm(cell + 1)], side))
        };
        let shares_mm = centres_mm.iter().zip(&reaches).map(|(centre_mm, reach)| {
            (0..cells).map(|cell| if reach.contains(&cell) { share(centre_mm, cell) } else { 0.0 }).collect()
        });
        Ok(Self { origin_mm: least_mm, cells, shares_mm: shares_mm.collect(), reaches })
    }

    /// For each column (or row): which cells of a window reach it, counted from the window's first, and the share of
    /// each, in mm.
    pub(crate) fn shares_mm(
        &self,
        first: usize,
        cells: usize,
    ) -> impl Iterator<Item = (Range<usize>, &[f32])> {
        self.reaches.iter().zip(&self.shares_mm).map(move |(reach, shares_mm)| {
            let end = reach.end.clamp(first, first + cells);
            let start = reach.start.clamp(first, end);
            (start - first..end - first, &shares_mm[start..end])
        })
    }

    /// For each column (or row), the cells from which anything arrives.
    #[cfg(feature = "gpu")]
    pub(crate) fn reaches(&self) -> impl Iterator<Item = &Range<usize>> {
        self.reaches.iter()
    }

    /// All shares, one cell after the other, each for all columns (or rows).
    #[cfg(feature = "gpu")]
    pub(crate) fn by_cell_mm(&self) -> Vec<f32> {
        (0..self.cells).flat_map(|cell| self.shares_mm.iter().map(move |shares_mm| shares_mm[cell])).collect()
    }
}

/// A number of cells from a coordinate that is not negative, or 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, as it should"
)]
pub(crate) fn whole(coordinate: f64) -> usize {
    coordinate as usize
}

#[expect(clippy::cast_possible_truncation, reason = "images are single precision")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
#[path = "lattice_tests.rs"]
mod tests;
