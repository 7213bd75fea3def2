//! A finite element model of the covering: layers of bricks on a rigid base, solved exactly in the Fourier domain.
//!
//! The covering is a slab of `across x across x layers` trilinear 8-node bricks. Its bottom is bonded to the base,
//! its top is free, and a vertical force of 1 N acts on the node in the middle of the top, or evenly on a disc around
//! it. The result is what the elements of a sensor would measure: the vertical reaction force at every node of the
//! bottom (paper, Fig. 3).
//!
//! The slab's sides are on rollers: they may slide, but not move outwards. This is the same as an endless slab with a
//! load every `across` bricks, because each side acts as a mirror. The problem is therefore periodic, all bricks are
//! equal, and waves of nodal displacements do not affect each other. A discrete Fourier transform along x and y leaves
//! a chain of `layers` equal 6 x 6 matrices for each wave. From the top down, each layer's upper node is eliminated, and
//! its load is passed to the node below. The load that arrives at the fixed bottom is the reaction. This is no
//! approximation: up to rounding, the result is that of assembling the slab's equations and eliminating all unknowns.
//! A slab of 100 x 100 x 10 bricks, with some 300,000 unknowns, takes about half a millisecond.
//!
//! Free sides, which the paper may have used, would change no force of that slab by more than 0.4 % of the peak.
//!
//! The strain energy of a brick, with the strain `e`, its trace `t` and the mean of `t` over the brick, `t0`, is
//!
//! ```text
//! W = integral over the brick of [ mu (e:e - t^2/3) + K t0^2/2 ],    K/mu = 2 (1 + nu) / (3 (1 - 2 nu))
//! ```
//!
//! The mean of the volume change (mean dilatation, B-bar) prevents the bricks from locking as Poisson's ratio `nu`
//! nears 0.5. The deviatoric part is integrated in full. Forces depend neither on the modulus nor on the size.
//!
//! ```
//! use tactus_solid::fem::Bricks;
//!
//! let reaction = Bricks::cubes(100, 10, 0.1, 0.45)?.under_point();
//! assert!((reaction.forces().iter().sum::<f64>() - 1.0).abs() < 1e-12, "the base carries the load");
//! let sigma_mm = reaction.gaussian_sigma_mm();
//! assert!((0.4..0.5).contains(&sigma_mm), "a little less than half the thickness of 1 mm");
//! # Ok::<(), tactus_solid::fem::BricksError>(())
//! ```
//!
//! # Accuracy
//! Against the layered solution: see [`Reaction::pressure_per_mm2`]. Against other finite element programs on the same
//! mesh (`just fem-peers`): scikit-fem 12.0.2, with mean dilatation, 4e-15 of the peak, 1e-12 at a Poisson's ratio of
//! 0.4999; `CalculiX` 2.20, integrated in full, 7e-8, half of the last digit that it prints.
//!
//! # Source
//! The model: paper, Sec. 3. Mean dilatation: Nagtegaal, Parks and Rice, Comput. Methods Appl. Mech. Eng. 4 (1974);
//! Hughes, Int. J. Numer. Methods Eng. 15 (1980).

mod disc;
mod even;
mod reaction;

use std::f64::consts::PI;

use libm::{cos, sin};

use disc::force_of_disc;
use even::Even;

pub use reaction::Reaction;

/// Greatest number of bricks along a side of the slab, and of layers.
pub const BRICKS_MAX: u32 = 2_000;

/// A slab of equal elastic bricks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bricks {
    across: u32,
    layers: u32,
    width_mm: f64,
    height_mm: f64,
    poisson_ratio: f64,
    mean_dilatation: bool,
}

/// Why numbers do not make a slab of bricks, or a load does not fit on it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum BricksError {
    /// No node is in the middle, or there are too many bricks.
    #[error(
        "bricks across must be an even number from 2 to {BRICKS_MAX}, so that a node is in the middle, not {0}"
    )]
    Across(u32),
    /// There is no layer, or there are too many.
    #[error("layers must be from 1 to {BRICKS_MAX}, not {0}")]
    Layers(u32),
    /// A side of the bricks is not a positive, finite number.
    #[error("a brick's sides must be positive, finite numbers of mm, not {0}")]
    Side(f64),
    /// Poisson's ratio is out of range.
    #[error("Poisson's ratio must be in [0, 0.5), not {0}; for an incompressible covering take 0.4999")]
    PoissonRatio(f64),
    /// The disc's diameter is negative, or greater than the slab's width.
    #[error("a disc on these bricks must have a diameter from 0 to {width_mm} mm, not {diameter_mm}")]
    Disc { diameter_mm: f64, width_mm: f64 },
}

impl Bricks {
    /// A slab of cubes with sides of `side_mm`: `across x across` bricks in `layers` layers. Poisson's ratio must be in
    /// `[0, 0.5)`.
    ///
    /// # Errors
    /// [`BricksError`] names the number that is out of range.
    pub fn cubes(across: u32, layers: u32, side_mm: f64, poisson_ratio: f64) -> Result<Self, BricksError> {
        Self::new(across, layers, [side_mm, side_mm], poisson_ratio)
    }

    /// As [`cubes`](Self::cubes), with bricks of any width and height.
    ///
    /// # Errors
    /// [`BricksError`] names the number that is out of range.
    pub fn new(
        across: u32,
        layers: u32,
        [width_mm, height_mm]: [f64; 2],
        poisson_ratio: f64,
    ) -> Result<Self, BricksError> {
        if !(2..=BRICKS_MAX).contains(&across) || across % 2 == 1 {
            return Err(BricksError::Across(across));
        }
        if !(1..=BRICKS_MAX).contains(&layers) {
            return Err(BricksError::Layers(layers));
        }
        if let Some(side) = [width_mm, height_mm].into_iter().find(|side| !(side.is_finite() && *side > 0.0))
        {
            return Err(BricksError::Side(side));
        }
        if !(0.0..0.5).contains(&poisson_ratio) {
            return Err(BricksError::PoissonRatio(poisson_ratio));
        }
        Ok(Self { across, layers, width_mm, height_mm, poisson_ratio, mean_dilatation: true })
    }

    /// Takes the volume change at every point of a brick (`t` instead of `t0` in `W`), as plain bricks do: the C3D8 of
    /// `CalculiX`, and perhaps those of the paper. This is for comparison only, because such bricks lock near a Poisson's
    /// ratio of 0.5: with 10 layers at 0.49, the force below the load is 1.5 times the true one.
    #[must_use]
    pub fn integrated_in_full(mut self) -> Self {
        self.mean_dilatation = false;
        self
    }

    /// Number of bricks along a side of the slab.
    pub fn across(&self) -> u32 {
        self.across
    }

    /// Number of layers.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Thickness of the slab.
    pub fn thickness_mm(&self) -> f64 {
        f64::from(self.layers) * self.height_mm
    }

    /// Reaction at the base to 1 N on the node in the middle of the top.
    pub fn under_point(&self) -> Reaction {
        let nodes = self.half() + 1;
        self.under(&Even { nodes, values: vec![1.0; nodes * nodes] })
    }

    /// Reaction at the base to 1 N spread evenly over a disc around the middle of the top. The bricks' shape functions
    /// distribute the pressure to the nodes; for a diameter of 0 this is [`under_point`](Self::under_point).
    ///
    /// # Errors
    /// [`BricksError::Disc`] if the diameter is negative or greater than the slab's width.
    pub fn under_disc(&self, diameter_mm: f64) -> Result<Reaction, BricksError> {
        let width_mm = f64::from(self.across) * self.width_mm;
        if !(0.0..=width_mm).contains(&diameter_mm) {
            return Err(BricksError::Disc { diameter_mm, width_mm });
        }
        if diameter_mm == 0.0 {
            return Ok(self.under_point());
        }
        let radius = diameter_mm / 2.0 / self.width_mm;
        let half = self.half();
        // At a side, the mirror image's disc adds the same force again.
        let discs = |steps: usize| if steps == half { 2.0 } else { 1.0 };
        let force = |x: usize, y: usize| discs(x) * discs(y) * force_of_disc(radius, [x as f64, y as f64]);
        let load = Even::new(half + 1, force);
        Ok(self.under(&load.transformed()))
    }

    /// Share of a load wave that arrives at the base: the ratio of the vertical forces on the bottom nodes to those on
    /// the top nodes, if both vary as `cos(x . wave)` from node to node. `wave` is in radians per brick, from `-pi` to
    /// `pi`. An even load arrives completely: `transfer([0.0, 0.0]) = 1`.
    ///
    /// In finer meshes it converges to that of the elastic [`Layer`](crate::layered::Layer::transfer); the error is
    /// proportional to the square of the brick's side.
    pub fn transfer(&self, wave: [f64; 2]) -> f64 {
        arriving(&self.layer_stiffness(wave), self.layers)
    }

    /// Stiffness of one layer of bricks against a wave, in shear moduli times brick widths.
    ///
    /// Unknowns are the displacements `(u, v, w)` of the upper node and of the lower node, with z down. Horizontal
    /// displacements lag by a quarter of a wave (`-i u`), which makes the matrix real. The integrals of shape functions
    /// and their slopes are then numbers along x and y, and 2 x 2 matrices along z.
    fn layer_stiffness(&self, wave: [f64; 2]) -> [[f64; 6]; 6] {
        let height = self.height_mm / self.width_mm;
        let bulk = 2.0 * (1.0 + self.poisson_ratio) / (3.0 * (1.0 - 2.0 * self.poisson_ratio));
        // The factors of t0 t0 and of t t.
        let (mean, point) = if self.mean_dilatation { (bulk, -2.0 / 3.0) } else { (0.0, bulk - 2.0 / 3.0) };

        // Integrals of shape times shape, slope times slope, slope times shape.
        let [mx, my] = wave.map(|wave| (2.0 + cos(wave)) / 3.0);
        let [sx, sy] = wave.map(|wave| 2.0 * (1.0 - cos(wave)));
        let [gx, gy] = wave.map(sin);
        let mz = [[height / 3.0, height / 6.0], [height / 6.0, height / 3.0]];
        let sz = [[1.0 / height, -1.0 / height], [-1.0 / height, 1.0 / height]];
        let gz = [[-0.5, -0.5], [0.5, 0.5]];

        // Mean change of volume, for each unknown.
        let [[sin_x, sin_y], [cos_x, cos_y]] = [sin, cos].map(|of| wave.map(|wave| of(wave / 2.0)));
        let rise = cos_x * cos_y / height;
        let side = [sin_x * cos_y, cos_x * sin_y];
        let volume = [side[0], side[1], -rise, side[0], side[1], rise];

        let mut stiffness = [[0.0; 6]; 6];
        for (upper, lower) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (m, s) = (mz[upper][lower], sz[upper][lower]);
            let (g, g_transposed) = (gz[upper][lower], gz[lower][upper]);
            // 2 e:e + point t t
            let (along, across) = (2.0 + point, 1.0 + point);
            let block = [
                [
                    along * sx * my * m + mx * (sy * m + my * s),
                    across * gx * gy * m,
                    gx * my * (point * g_transposed - g),
                ],
                [
                    across * gx * gy * m,
                    along * mx * sy * m + my * (sx * m + mx * s),
                    mx * gy * (point * g_transposed - g),
                ],
                [
                    gx * my * (point * g - g_transposed),
                    mx * gy * (point * g - g_transposed),
                    along * mx * my * s + (sx * my + mx * sy) * m,
                ],
            ];
            for (row, block) in block.iter().enumerate() {
                for (col, at_points) in block.iter().enumerate() {
                    let [row, col] = [3 * upper + row, 3 * lower + col];
                    stiffness[row][col] = at_points + mean * height * volume[row] * volume[col];
                }
            }
        }
        stiffness
    }

    /// The reaction to a load given by its waves.
    fn under(&self, load: &Even) -> Reaction {
        let step = 2.0 * PI / f64::from(self.across);
        let transfer = |x: usize, y: usize| self.transfer([x, y].map(|waves| step * waves as f64));
        // x and y are interchangeable.
        let transfer = Even::new(load.nodes, |x, y| if x < y { 0.0 } else { transfer(x, y) });
        let nodes = f64::from(self.across * self.across);
        let waves = Even::new(load.nodes, |x, y| transfer.at(x.max(y), x.min(y)) * load.at(x, y) / nodes);
        Reaction { bricks: *self, forces: waves.transformed() }
    }

    fn half(&self) -> usize {
        self.across as usize / 2
    }
}

/// Vertical force at the fixed bottom of a chain of equal layers, under a vertical force of 1 on the top node.
///
/// This is Gauss elimination down the chain: the equations of a node include the stiffness and the load that the layers
/// above it contribute.
fn arriving(layer: &[[f64; 6]; 6], layers: u32) -> f64 {
    let (mut stiffness, mut load) = ([[0.0; 3]; 3], [0.0, 0.0, 1.0]);
    for _ in 0..layers {
        // The upper node's equations, then the lower node's; the last column is the load.
        let mut rows = [[0.0; 7]; 6];
        for (row, layer) in rows.iter_mut().zip(layer) {
            row[..6].copy_from_slice(layer);
        }
        for ((row, stiffness), load) in rows.iter_mut().zip(stiffness).zip(load) {
            row.iter_mut().zip(stiffness).for_each(|(sum, above)| *sum += above);
            row[6] = load;
        }
        for pivot in 0..3 {
            let (above, below) = rows.split_at_mut(pivot + 1);
            let above = &above[pivot];
            for row in below {
                let share = row[pivot] / above[pivot];
                row.iter_mut().zip(above).for_each(|(sum, above)| *sum -= share * above);
            }
        }
        for ([.., x, y, z, force], (stiffness, load)) in
            rows[3..].iter().zip(stiffness.iter_mut().zip(&mut load))
        {
            *stiffness = [*x, *y, *z];
            *load = *force;
        }
    }
    load[2]
}

#[cfg(test)]
#[path = "fem_tests.rs"]
mod tests;
