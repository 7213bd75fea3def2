//! What a pass over the data leaves: sums over all data, and the part of each block of time.

use nalgebra::DMatrix;

use super::parameters::Parameters;
use super::problem::Problem;
use super::random_walk::is_random_walk;
use super::tiles::{Border, Crossed, Sums, add, add_columns};

/// Which products a pass keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kept {
    /// Those of all directions, for steps of a fit.
    All,
    /// Also the part of each block.
    AllAndBlocks,
    /// Those of each direction with itself, with the model's own and with the residual; and the part of each block.
    OwnAndBlocks,
}

/// Sums over all data.
pub(super) struct Total {
    /// Products of all directions, and of the residual as the last.
    pub(super) products: DMatrix<f64>,
    pub(super) segments: Vec<Border>,
    pub(super) blocks: Vec<Block>,
}

/// What is kept of a block, in single precision: parts of a test's statistic.
pub(super) struct Block {
    number: usize,
    /// Its first bin that is fitted.
    pub(super) first_bin: usize,
    pub(super) segment: usize,
    /// Products of the model's own directions and the residual with all directions.
    pub(super) rows: DMatrix<f32>,
    pub(super) diagonal: Vec<f32>,
    pub(super) by_baseline: DMatrix<f32>,
    pub(super) by_gain: DMatrix<f32>,
    pub(super) own: Vec<[f64; 3]>,
}

/// Stretches of time that have a baseline of their own: runs, or the parts of a walk.
pub(super) struct Segments {
    pub(super) of_bin: Vec<usize>,
    /// The run of each.
    pub(super) run: Vec<usize>,
    /// Precision of the difference between neighbours of one run, in counts^-2; 0 without a walk.
    pub(super) stiffness: f64,
}

impl Total {
    pub(super) fn new(count: usize, elements: usize, segments: usize) -> Self {
        Self {
            products: DMatrix::zeros(count, count),
            segments: vec![Border::new(count, elements); segments],
            blocks: Vec::new(),
        }
    }

    /// The sums over nothing, as many as these.
    pub(super) fn none(&self) -> Self {
        let elements = self.segments.first().map_or(0, |border| border.own.len());
        Self::new(self.products.nrows(), elements, self.segments.len())
    }

    /// The sums with those over other data, without the parts of blocks.
    pub(super) fn joined(mut self, other: &Self) -> Self {
        self.products += &other.products;
        self.segments.iter_mut().zip(&other.segments).for_each(|(to, of)| to.add(of));
        self
    }

    /// Adds products of sparse columns with each other.
    pub(super) fn add_crossed(&mut self, Crossed { first: [first, second], products }: &Crossed) {
        for (other, column) in products.column_iter().enumerate() {
            for (one, product) in column.iter().enumerate() {
                self.products[(first + one, second + other)] += product;
                self.products[(second + other, first + one)] += product;
            }
        }
    }

    /// Adds the sums over a part of a block; parts come in order of time.
    pub(super) fn add(&mut self, number: usize, first_bin: usize, own: usize, sums: &Sums, kept: Kept) {
        let rows = sums.products.nrows();
        for (place, column) in sums.active.iter().enumerate() {
            for (row, product) in sums.active.iter().zip(sums.products.column(place).iter()) {
                self.products[(*row, *column)] += product;
                if place >= rows {
                    self.products[(*column, *row)] += product;
                }
            }
        }
        for (column, square) in sums.active[rows..].iter().zip(&sums.squares) {
            self.products[(*column, *column)] += square;
        }
        self.segments[sums.segment].add_of(&sums.active, &sums.border);
        if kept == Kept::All {
            return;
        }
        let elements = sums.border.own.len();
        let is_other = |last: &Block| (last.number, last.segment) != (number, sums.segment);
        if self.blocks.last().is_none_or(is_other) {
            let of = Block::new([number, first_bin, sums.segment], own, self.products.ncols(), elements);
            self.blocks.push(of);
        }
        if let Some(block) = self.blocks.last_mut() {
            block.add(own, sums);
        }
    }
}

impl Block {
    fn new([number, first_bin, segment]: [usize; 3], own: usize, count: usize, elements: usize) -> Self {
        Self {
            number,
            first_bin,
            segment,
            rows: DMatrix::zeros(own + 1, count),
            diagonal: vec![0.0; count],
            by_baseline: DMatrix::zeros(elements, count),
            by_gain: DMatrix::zeros(elements, count),
            own: vec![[0.0; 3]; elements],
        }
    }

    fn add(&mut self, own: usize, sums: &Sums) {
        let Sums { active, products, border, .. } = sums;
        let residual = self.rows.ncols() - 1;
        #[expect(clippy::cast_possible_truncation, reason = "parts of a test's statistic")]
        let single = |value: f64| value as f32;
        let rows = |(_, number): &(usize, &usize)| **number < own || **number == residual;
        for (place, number) in active.iter().enumerate().filter(rows) {
            for (other, product) in active.iter().zip(products.row(place).iter()) {
                self.rows[((*number).min(own), *other)] += single(*product);
            }
        }
        for (place, number) in active.iter().enumerate() {
            self.diagonal[*number] += single(sums.square(place));
        }
        add_columns(&mut self.by_baseline, active, &border.by_baseline, |to, of| *to += single(of));
        add_columns(&mut self.by_gain, active, &border.by_gain, |to, of| *to += single(of));
        add(&mut self.own, &border.own);
    }
}

impl Segments {
    pub(super) fn of(problem: &Problem<'_>, at: &Parameters) -> Self {
        let bins = problem.predictor.bins;
        let walk =
            at.terms.iter().find(|term| is_random_walk(term)).map(|term| [term.values[0], term.values[1]]);
        let walk = walk.filter(|[rate, knot_s]| *rate > 0.0 && *knot_s > 0.0);
        let (mut of_bin, mut run) = (Vec::with_capacity(bins.len()), Vec::new());
        let mut key = None;
        for bin in 0..bins.len() {
            #[expect(clippy::cast_possible_truncation, reason = "a number of segments")]
            let part = walk.map_or(0, |[_, knot_s]| (bins.t_s[bin] / knot_s) as i64);
            // A block has one segment.
            let is_new = key.is_none_or(|(before_run, before)| before_run != bins.run[bin] || before != part);
            let starts = bin == 0 || bins.block[bin] != bins.block[bin - 1];
            if is_new && starts {
                key = Some((bins.run[bin], part));
                run.push(bins.run[bin]);
            }
            of_bin.push(run.len().saturating_sub(1));
        }
        let stiffness = walk.map_or(0.0, |[rate, knot_s]| 1.0 / (rate * rate * knot_s));
        Self { of_bin, run, stiffness }
    }
}
