//! The depth map that the camera sees.

use crate::facet::{Facet, SAMPLES, Window};
use crate::lattice::Lattice;

/// The z-buffer of a pose: depth of the tool's underside below the undeformed surface.
///
/// It covers only the cells that the tool can reach and that contribute to an element; elsewhere the depth is 0. The value
/// of a cell is the mean of 16 samples.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    /// Side of the square cells.
    pub cell_mm: f64,
    /// Corner of least x and y of the first cell, sensor frame.
    pub origin_mm: [f64; 2],
    /// Cells along x.
    pub cols: usize,
    /// Cells along y.
    pub rows: usize,
    /// Penetration `I` of each cell in mm, in [0, thickness of the covering], row by row.
    pub penetration_mm: Vec<f32>,
}

impl DepthMap {
    pub(crate) fn new(lattice: &Lattice, window: Window, facets: &[Facet]) -> Self {
        let cell_mm = lattice.cell_mm;
        let [cols, rows] = window.cells;
        let origin_mm = [0, 1].map(|axis| lattice.axes[axis].origin_mm + window.first[axis] as f64 * cell_mm);
        let mut penetration_mm = Vec::new();
        draw(window, facets, &mut Vec::new(), &mut penetration_mm);
        Self { cell_mm, origin_mm, cols, rows, penetration_mm }
    }
}

/// Draws facets: sets every sample of a window's cells to the depth of the deepest facet, or 0 where there is none, and
/// computes the mean of every cell.
pub(crate) fn draw(
    window: Window,
    facets: &[Facet],
    samples_mm: &mut Vec<[f32; SAMPLES]>,
    means_mm: &mut Vec<f32>,
) {
    let [cols, rows] = window.cells;
    samples_mm.clear();
    samples_mm.resize(cols * rows, [0.0; SAMPLES]);
    for facet in facets {
        facet.draw(window, samples_mm);
    }
    means_mm.clear();
    means_mm.extend(samples_mm.iter().map(mean));
}

/// Mean in four parallel sums.
fn mean(values: &[f32; SAMPLES]) -> f32 {
    let (rows, _) = values.as_chunks::<4>();
    let sums = rows.iter().fold([0.0; 4], |sums, row| std::array::from_fn(|k| sums[k] + row[k]));
    sums.iter().sum::<f32>() / SAMPLES as f32
}
