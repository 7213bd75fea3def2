//! Sums of products over bins of one segment, tile by tile.

use nalgebra::{DMatrix, Scalar};

use super::sparse::SparseChunk;

/// Directions whose products are computed together.
const PANEL: usize = 128;

/// Products with each element's baseline and gain.
#[derive(Clone)]
pub(super) struct Border {
    /// Element by element, direction by direction.
    pub(super) by_baseline: DMatrix<f64>,
    pub(super) by_gain: DMatrix<f64>,
    /// Of each element: baseline with itself, with gain, and gain with itself.
    pub(super) own: Vec<[f64; 3]>,
}

/// Sums over bins of one segment.
pub(super) struct Sums {
    pub(super) segment: usize,
    /// The directions that do something there: first those of all elements, in order, then those of one element each, then sparse columns.
    pub(super) active: Vec<usize>,
    /// Products of those but the sparse columns, a row each, with all: in the rows of the pivots and of the residual, and on the diagonal.
    pub(super) products: DMatrix<f64>,
    /// Those of each sparse column with itself.
    pub(super) squares: Vec<f64>,
    /// Products of all that are active with baselines and gains.
    pub(super) border: Border,
}

/// A direction of one element that does something in a part of a chunk.
pub(super) struct Alone<'a> {
    pub(super) number: usize,
    pub(super) element: usize,
    /// The place of the element among those that are weighed.
    pub(super) place: usize,
    /// Bin by bin, of the whole chunk.
    pub(super) values: &'a [f64],
}

/// The weighed readings of some bins: bin by bin, element by element.
pub(super) struct Readings<'a> {
    pub(super) bins: &'a [usize],
    /// The first bin of the chunk.
    pub(super) first_bin: usize,
    pub(super) per_bin: usize,
    /// The roots of their weights, and the derivatives by the gains times those.
    pub(super) roots: &'a [f64],
    pub(super) gains: &'a [f64],
}

impl Readings<'_> {
    /// The readings at which a direction of one element acts, with its values times the roots of the weights.
    fn values(&self, of: &Alone<'_>) -> impl Iterator<Item = (usize, f64)> {
        let at = (of.place..self.roots.len()).step_by(self.per_bin);
        self.bins.iter().zip(at).map(|(bin, at)| (at, of.values[bin - self.first_bin] * self.roots[at]))
    }
}

/// Products of some sparse columns with some others, over the bins of a chunk.
pub(super) struct Crossed {
    /// The numbers of the first ones among all directions.
    pub(super) first: [usize; 2],
    pub(super) products: DMatrix<f64>,
}

impl Crossed {
    /// Products of each column of one group with each of another; within one group each pair once. Bins are counted from the chunk's first, each with
    /// its weight.
    pub(super) fn of([one, other]: [&SparseChunk; 2], bins: &[(usize, f64)], element_weight: &[f64]) -> Self {
        let is_one = one.first == other.first;
        let mut products = DMatrix::zeros(one.columns, other.columns);
        for (bin, of_bin) in bins {
            let (Some(of_one), Some(of_other)) = (one.at(*bin), other.at(*bin)) else { continue };
            for ((of_one, of_other), of_element) in of_one.iter().zip(of_other).zip(element_weight) {
                let weight = of_bin * of_element;
                for (column, value) in of_one.each().filter(|_| weight > 0.0) {
                    let value = weight * value;
                    for (another, with) in of_other.each() {
                        if !is_one || column < another {
                            products[(column, another)] += value * with;
                        }
                    }
                }
            }
        }
        Self { first: [one.first, other.first], products }
    }
}

impl Sums {
    /// The product with itself of the direction at a place among those that are active.
    pub(super) fn square(&self, place: usize) -> f64 {
        let rows = self.products.nrows();
        if place < rows { self.products[(place, place)] } else { self.squares[place - rows] }
    }

    /// Adds the products of sparse columns with the others of a tile, with themselves, and with baselines and gains. `places` has the place of
    /// each sparse column among those that are active.
    pub(super) fn take_sparse(
        &mut self,
        of: &Readings<'_>,
        tile: &DMatrix<f64>,
        sparse: &[SparseChunk],
        [weighed, places]: [&[usize]; 2],
    ) {
        let Some(first) = sparse.first().map(|of| of.first) else { return };
        let rows = self.products.nrows();
        let by_reading = tile.transpose();
        for group in sparse {
            for (nth, bin) in of.bins.iter().enumerate() {
                let Some(acting) = group.at(bin - of.first_bin) else { continue };
                for (among, element) in weighed.iter().enumerate() {
                    let at = nth * of.per_bin + among;
                    let (root, gain, with) = (of.roots[at], of.gains[at], by_reading.column(at));
                    for (column, value) in acting[*element].each() {
                        let (place, value) = (places[group.first + column - first], value * root);
                        self.border.by_baseline[(*element, place)] += value * root;
                        self.border.by_gain[(*element, place)] += value * gain;
                        self.squares[place - rows] += value * value;
                        let products = &mut self.products.as_mut_slice()[place * rows..(place + 1) * rows];
                        for (sum, with) in products.iter_mut().zip(with.iter()) {
                            *sum += value * with;
                        }
                    }
                }
            }
        }
    }

    /// Adds the products of a tile, a row a reading and a column a direction: of the first directions with those after them, panel by
    /// panel, and of each other with itself and with the residual, which is the last if it is there. Of those that are the same both ways the
    /// ones above the diagonal are computed.
    pub(super) fn take(&mut self, tile: &DMatrix<f64>, first: usize, has_residual: bool) {
        let count = tile.ncols();
        for start in (0..first).step_by(PANEL) {
            let (rows, after) = (PANEL.min(first - start), count - start);
            self.products.view_mut((start, start), (rows, after)).gemm(
                1.0,
                &tile.columns(start, rows).transpose(),
                &tile.columns(start, after),
                1.0,
            );
        }
        for (place, column) in tile.column_iter().enumerate().skip(first) {
            self.products[(place, place)] += column.norm_squared();
            if has_residual && place + 1 < count {
                self.products[(place, count - 1)] += column.dot(&tile.column(count - 1));
            }
        }
    }

    /// Adds the products of directions of one element each with those that are the first of a tile, with the residual and with themselves; also
    /// those of one element with each other, if they are asked for.
    pub(super) fn take_alone(
        &mut self,
        of: &Readings<'_>,
        tile: &DMatrix<f64>,
        first: usize,
        has_residual: bool,
        of_one: &[Alone<'_>],
        with_each_other: bool,
    ) {
        let of_all = tile.ncols();
        let residual = has_residual.then(|| of_all - 1).filter(|residual| *residual >= first);
        for (nth, alone) in of_one.iter().enumerate() {
            let with = |others: &[f64]| of.values(alone).map(|(at, value)| value * others[at]).sum::<f64>();
            let place = of_all + nth;
            self.border.by_baseline[(alone.element, place)] += with(of.roots);
            self.border.by_gain[(alone.element, place)] += with(of.gains);
            for other in (0..first).chain(residual) {
                let start = other * tile.nrows();
                self.products[(other, place)] += with(&tile.as_slice()[start..start + tile.nrows()]);
            }
            for (other, another) in of_one.iter().enumerate().take(nth + 1) {
                if other == nth || with_each_other && another.place == alone.place {
                    let pairs = of.values(alone).zip(of.values(another));
                    self.products[(of_all + other, place)] +=
                        pairs.map(|((_, a), (_, b))| a * b).sum::<f64>();
                }
            }
        }
    }
}

impl Border {
    /// Adds readings of a tile: of each, the root of its weight, and the derivative by the gain and the first directions, times that root.
    pub(super) fn take(&mut self, weighed: &[usize], [roots, gains]: [&[f64]; 2], values: &[f64]) {
        let per_bin = weighed.len().max(1);
        let of_bins = || roots.chunks_exact(per_bin).zip(gains.chunks_exact(per_bin));
        for (roots, gains) in of_bins() {
            for ((element, root), gain) in weighed.iter().zip(roots).zip(gains) {
                let [one, mixed, square] = &mut self.own[*element];
                *one += root * root;
                *mixed += root * gain;
                *square += gain * gain;
            }
        }
        let (mut by_baseline, mut by_gain) = (vec![0.0; per_bin], vec![0.0; per_bin]);
        for (place, values) in values.chunks_exact(roots.len().max(1)).enumerate() {
            by_baseline.fill(0.0);
            by_gain.fill(0.0);
            for (values, (roots, gains)) in values.chunks_exact(per_bin).zip(of_bins()) {
                for ((sum, value), root) in by_baseline.iter_mut().zip(values).zip(roots) {
                    *sum += value * root;
                }
                for ((sum, value), gain) in by_gain.iter_mut().zip(values).zip(gains) {
                    *sum += value * gain;
                }
            }
            for ((element, of_baseline), of_gain) in weighed.iter().zip(&by_baseline).zip(&by_gain) {
                self.by_baseline[(*element, place)] += *of_baseline;
                self.by_gain[(*element, place)] += *of_gain;
            }
        }
    }

    pub(super) fn new(count: usize, elements: usize) -> Self {
        let zeros = || DMatrix::zeros(elements, count);
        Self { by_baseline: zeros(), by_gain: zeros(), own: vec![[0.0; 3]; elements] }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.by_baseline += &other.by_baseline;
        self.by_gain += &other.by_gain;
        add(&mut self.own, &other.own);
    }

    /// Adds that of some directions.
    pub(super) fn add_of(&mut self, active: &[usize], other: &Self) {
        add_columns(&mut self.by_baseline, active, &other.by_baseline, |to, of| *to += of);
        add_columns(&mut self.by_gain, active, &other.by_gain, |to, of| *to += of);
        add(&mut self.own, &other.own);
    }
}

/// Adds to the columns of some directions those of a matrix that has these alone.
pub(super) fn add_columns<T: Scalar>(
    to: &mut DMatrix<T>,
    active: &[usize],
    of: &DMatrix<f64>,
    add: impl Fn(&mut T, f64),
) {
    for (number, of) in active.iter().zip(of.column_iter()) {
        to.column_mut(*number).zip_apply(&of, &add);
    }
}

pub(super) fn add(to: &mut [[f64; 3]], of: &[[f64; 3]]) {
    for (to, of) in to.iter_mut().flatten().zip(of.iter().flatten()) {
        *to += of;
    }
}
