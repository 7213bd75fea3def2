//! Reaction forces at the base.

use libm::exp;

use super::{
    Bricks,
    even::{Even, times},
};
use crate::search::peak;

/// Vertical reaction forces at the base of a slab under 1 N.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    pub(super) bricks: Bricks,
    /// By distance from the load's axis in bricks, in the slab that goes on for ever: half of the force at a side's
    /// node is the mirror image's.
    pub(super) forces: Even,
}

impl Reaction {
    /// Forces at the nodes of the bottom in N, row-major, `across + 1` rows and columns; their sum is 1.
    ///
    /// At the sides a node carries half a brick, in the corners a quarter.
    pub fn forces(&self) -> Vec<f64> {
        let half = self.bricks.half();
        let share = |steps: usize| if steps == half { 0.5 } else { 1.0 };
        let steps = || (0..=2 * half).map(move |node| node.abs_diff(half));
        steps().flat_map(|y| steps().map(move |x| share(x) * share(y) * self.forces.at(x, y))).collect()
    }

    /// Places in mm from the load's axis, and forces in N, of the nodes on the line along x through the middle of
    /// the bottom (paper, Fig. 3a).
    pub fn centre_line(&self) -> Vec<[f64; 2]> {
        let half = self.bricks.half();
        let line = self.forces().into_iter().skip(half * (2 * half + 1));
        line.take(2 * half + 1)
            .enumerate()
            .map(|(node, force)| [(node as f64 - half as f64) * self.bricks.width_mm, force])
            .collect()
    }

    /// Pressure in N/mm^2 at the bottom's node that is this many bricks from the load's axis along x and y: its force
    /// divided by the area of a brick. 0 beyond the slab.
    ///
    /// The greatest difference from the pressure under the elastic layer that the bricks represent, as a share of the
    /// peak, for Poisson's ratios of 0.3, 0.45 and 0.49: 10, 10 and 15 % with 5 layers of cubes, 3.4, 4.0 and 9.0 % with
    /// 10, 0.35, 0.38 and 0.40 % with 32. It is greatest right below the load, where the node forces of a coarse mesh
    /// alternate, and falls with the square of the brick's side.
    pub fn pressure_per_mm2(&self, steps: [u32; 2]) -> f64 {
        let [x, y] = steps.map(|steps| steps as usize);
        if x.max(y) > self.bricks.half() { 0.0 } else { self.forces.at(x, y) / self.bricks.width_mm.powi(2) }
    }

    /// Share of the force that arrives at the rectangle `[[x_min, x_max], [y_min, y_max]]`, in mm from the load's
    /// axis: what a sensor element there would measure. Each node's force counts as spread over a brick's square
    /// about it; beyond the slab there is none.
    pub fn force_on(&self, rectangle_mm: [[f64; 2]; 2]) -> f64 {
        let half = self.bricks.half();
        // The part of each node's square along an axis, both sides of the middle together.
        let [along_x, along_y] = rectangle_mm.map(|side_mm| {
            let [from, to] =
                side_mm.map(|end_mm| (end_mm / self.bricks.width_mm).clamp(-(half as f64), half as f64));
            let part = |node: f64| (to.min(node + 0.5) - from.max(node - 0.5)).max(0.0);
            let parts = (0..=half).map(|steps| steps as f64);
            parts
                .map(|node| if node > 0.0 { part(node) + part(-node) } else { part(node) })
                .collect::<Vec<_>>()
        });
        self.forces.weighted(&along_x, &along_y)
    }

    /// Standard deviation of the Gaussian that is most like the forces, in mm: the one whose values at the nodes,
    /// scaled to unit L2 norm, have the greatest inner product with them (the paper's Eq. 3).
    pub fn gaussian_sigma_mm(&self) -> f64 {
        let half = self.bricks.half();
        let likeness = |sigma: f64| {
            let values: Vec<f64> = (0..=half)
                .map(|steps| times(steps, half) * exp(-((steps * steps) as f64) / (2.0 * sigma * sigma)))
                .collect();
            let norm: f64 =
                values.iter().enumerate().map(|(steps, value)| value * value / times(steps, half)).sum();
            self.forces.weighted(&values, &values) / norm
        };
        self.bricks.width_mm * peak([0.1, half as f64], likeness)
    }
}
