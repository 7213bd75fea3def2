//! Functions on a periodic grid, the same on both sides of the middle.

use std::f64::consts::PI;

use libm::cos;

/// Numbers on a periodic square grid that are the same at `-x`, and at `-y`; of the period, 0 to its half is kept.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Even {
    /// Along an axis: half a period and one.
    pub(super) nodes: usize,
    pub(super) values: Vec<f64>,
}

impl Even {
    pub(super) fn new(nodes: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let value = &value;
        Self { nodes, values: (0..nodes).flat_map(|y| (0..nodes).map(move |x| value(x, y))).collect() }
    }

    pub(super) fn at(&self, x: usize, y: usize) -> f64 {
        self.values[y * self.nodes + x]
    }

    /// The discrete Fourier transform, which is even again. Twice transformed, everything is as before, times the
    /// number of nodes of a period.
    pub(super) fn transformed(&self) -> Self {
        let half = self.nodes - 1;
        let cosines = |wave: usize| {
            let cosine = move |at: usize| cos(PI * ((wave * at) % (2 * half)) as f64 / half as f64);
            (0..self.nodes).map(move |at| times(at, half) * cosine(at))
        };
        let cosines: Vec<Vec<f64>> = (0..self.nodes).map(|wave| cosines(wave).collect()).collect();
        let along_x: Vec<Vec<f64>> = self
            .values
            .chunks(self.nodes)
            .map(|row| cosines.iter().map(|wave| dot(wave, row)).collect())
            .collect();
        let mut values = Vec::with_capacity(self.values.len());
        for wave in &cosines {
            let mut sums = vec![0.0; self.nodes];
            for (cosine, row) in wave.iter().zip(&along_x) {
                sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += cosine * value);
            }
            values.append(&mut sums);
        }
        Self { nodes: self.nodes, values }
    }

    /// The sum of all numbers kept, each times a weight for its column and one for its row.
    pub(super) fn weighted(&self, along_x: &[f64], along_y: &[f64]) -> f64 {
        self.values.chunks(self.nodes).zip(along_y).map(|(row, weight)| weight * dot(row, along_x)).sum()
    }
}

/// How often a period contains a node this many steps from the middle: twice, except the nodes in the middle and at the end.
pub(super) fn times(steps: usize, half: usize) -> f64 {
    if steps == 0 || steps == half { 1.0 } else { 2.0 }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
