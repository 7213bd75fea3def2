//! Both panels of the paper's Fig. 6.

use anyhow::Result;
use tactus_calibrate::acuity::{Grid, OFFSETS};

use crate::{Growth, clock::timed};

/// Both panels on one grid, with the time they take.
#[derive(Debug, Clone)]
pub struct Acuity {
    /// Spreads and force resolutions.
    pub grid: Grid,
    /// Fig. 6a: number of locations, row-major.
    pub locations: Vec<usize>,
    /// Fig. 6b: mean separation, row-major.
    pub separations: Vec<Option<f64>>,
    /// Median time of each panel, on all cores that the program may use.
    pub panels_s: [f64; 2],
}

impl Acuity {
    /// Computes the panels `times` times.
    ///
    /// # Errors
    /// If a spread or a force resolution of the grid is out of range.
    pub fn measure(grid: Grid, times: usize) -> Result<Self> {
        let (locations, locations_s) = timed(times, || grid.map(|sensor| sensor.locations()))?;
        let (separations, separations_s) =
            timed(times, || grid.map(|sensor| sensor.mean_separation(&OFFSETS)))?;
        Ok(Self { grid, locations, separations, panels_s: [locations_s, separations_s] })
    }

    /// Growth of the time of both panels with their cells (25 x 25, 50 x 50 and 100 x 100 over the same ranges), and of the
    /// time of one row with its force steps.
    ///
    /// # Errors
    /// As [`Acuity::measure`].
    pub fn growth(times: usize) -> Result<[Growth; 2]> {
        let both = |grid: Grid| Self::measure(grid, times).map(|acuity| acuity.panels_s.iter().sum::<f64>());
        let of_cells = |count: usize| Ok([(count * count) as f64, both(Grid::even(count))?]);
        let of_steps = |steps: f64| {
            let grid = Grid { force_resolutions: vec![1.0 / steps], ..Grid::even(25) };
            Ok([steps, both(grid)?])
        };
        Ok([
            Growth {
                what: "both panels of Fig. 6".into(),
                size_of: "cells",
                points: [25, 50, 100].map(of_cells).into_iter().collect::<Result<_>>()?,
            },
            Growth {
                what: "a row of both panels".into(),
                size_of: "force steps",
                points: [256.0, 1024.0, 4096.0].map(of_steps).into_iter().collect::<Result<_>>()?,
            },
        ])
    }
}
