//! Columns of which few act on each reading, such as the hats of a curve's knots: at any value two of them are not 0, and four of those of two
//! curves' products. What their products cost depends on how many act, and not on how many there are.

use std::ops::Range;

/// Greatest number of columns that act on a reading: those at the knots around a value, of two covariates.
const FEW_MAX: usize = 4;

/// Columns of which at most four act on a reading.
pub(crate) struct Sparse<'a> {
    /// How many there are.
    pub(super) columns: usize,
    /// Those that act on each reading of any bins: bin by bin, element by element.
    pub(super) acting: Box<dyn Fn(Range<usize>) -> Vec<Few> + Sync + 'a>,
}

/// The columns that act on a reading, each with its value; the value is 0 where there are fewer.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Few {
    columns: [u32; FEW_MAX],
    values: [f64; FEW_MAX],
}

/// Sparse columns during a pass: what they are at the bins of a chunk.
pub(super) struct SparseChunk {
    /// The number of the first column among all directions.
    pub(super) first: usize,
    pub(super) columns: usize,
    elements: usize,
    /// Bin by bin, element by element.
    acting: Vec<Few>,
    /// For each bin whether any acts.
    acts: Vec<bool>,
}

/// The numbers of some groups of so many directions each, which follow each other from the `first` on.
pub(crate) fn in_a_row(first: usize, counts: impl IntoIterator<Item = usize>) -> Vec<Range<usize>> {
    let mut end = first;
    let numbers = |count: usize| {
        let first = end;
        end += count;
        first..end
    };
    counts.into_iter().map(numbers).collect()
}

impl<'a> Sparse<'a> {
    /// So many columns, of which these act on the readings of any bins.
    pub(crate) fn of(columns: usize, acting: impl Fn(Range<usize>) -> Vec<Few> + Sync + 'a) -> Self {
        Self { columns, acting: Box::new(acting) }
    }
}

impl Few {
    /// These columns with these values: different ones, four at most. What has the value 0 counts as none.
    pub(crate) fn of(columns: impl IntoIterator<Item = (usize, f64)>) -> Self {
        let mut acting = Self::default();
        let places = acting.columns.iter_mut().zip(&mut acting.values);
        for ((to, to_value), (column, value)) in places.zip(columns) {
            // There is no memory for so many columns.
            (*to, *to_value) = (u32::try_from(column).unwrap_or(u32::MAX), value);
        }
        acting
    }

    /// The columns that are so many after these, with their values times a factor.
    pub(crate) fn after(mut self, first: usize, factor: f64) -> Self {
        for (column, value) in self.columns.iter_mut().zip(&mut self.values) {
            *column = column.saturating_add(u32::try_from(first).unwrap_or(u32::MAX));
            *value *= factor;
        }
        self
    }

    /// Each column that acts, with its value.
    pub(crate) fn each(&self) -> impl Iterator<Item = (usize, f64)> {
        let each = self.columns.into_iter().zip(self.values);
        each.filter(|(_, value)| *value != 0.0).map(|(column, value)| (column as usize, value))
    }
}

impl SparseChunk {
    /// Of an array of so many elements, from the `first` direction on.
    pub(super) fn of(first: usize, sparse: &Sparse<'_>, bins: Range<usize>, elements: usize) -> Self {
        let acting = (sparse.acting)(bins);
        let acts = |of_bin: &[Few]| of_bin.iter().any(|few| few.each().next().is_some());
        let acts = acting.chunks_exact(elements).map(acts).collect();
        Self { first, columns: sparse.columns, elements, acting, acts }
    }

    /// What acts on the elements at a bin, counted from the chunk's first; `None` if nothing does.
    pub(super) fn at(&self, bin: usize) -> Option<&[Few]> {
        self.acts[bin].then(|| &self.acting[bin * self.elements..(bin + 1) * self.elements])
    }

    /// Numbers of all its columns among all directions.
    pub(super) fn numbers(&self) -> Range<usize> {
        self.first..self.first + self.columns
    }
}
