//! Sums of products of many directions, from one pass over the data.
//!
//! A direction is the derivative of the prediction by one number: a free parameter of the model, an amplitude of a term that the
//! model does not have, or a column that belongs to no effect. All directions are computed together, a few hundred bins at a
//! time, and only their products are kept:
//!
//! ```text
//! A = sum over bins and elements of w x x'        x: all directions, and the residual as the last
//! ```
//!
//! Beside them stand the products with each element's baseline and gain, segment by segment of the time, which
//! [`super::elimination`] needs. Memory does not grow with the number of bins.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::DMatrix;

use super::parameters::Parameters;
use super::predictor::{Reached, Stream};
use super::problem::Problem;
use super::sparse::{Few, Sparse, SparseChunk, in_a_row};
use super::tiles::{Alone, Border, Crossed, Readings, Sums};
use super::totals::{Kept, Segments, Total};
use crate::data::DiscoverError;
use crate::numbers::parallel;

/// Least and greatest number of bins of which all directions are held at a time.
const CHUNK_BINS: [usize; 2] = [64, 256];
/// Directions times bins that are held at a time, between these.
const CHUNK_COLUMNS: usize = 32_768;
/// Bins of which products are computed together: those of some hundred directions stay near the processor.
const TILE_BINS: usize = 4;
/// Greatest number of blocks whose signs are flipped apart; more are joined.
pub(crate) const BLOCKS_MAX: usize = 400;
/// Step of the derivative by the gains.
const GAIN_SHARE: f64 = 1e-3;

/// A direction.
pub(crate) enum Direction<'a> {
    /// Finite difference towards a changed model, divided by a step; times a factor for each bin, if it has one.
    Towards { parameters: Parameters, step: f64, factor: Option<Arc<Vec<f64>>> },
    /// Relative change of all gains in a run.
    RunGain(usize),
    /// An earlier direction without its own factor, by its number, times a factor for each bin.
    Times { direction: usize, factor: Arc<Vec<f64>> },
    /// Values of any bins, bin by bin, element by element.
    Column(Box<dyn Fn(Range<usize>) -> Vec<f64> + Sync + 'a>),
    /// Values of any bins at one element, bin by bin; 0 at all others.
    OfElement(usize, Box<dyn Fn(Range<usize>) -> Vec<f64> + Sync + 'a>),
}

/// The directions of a pass, in the order of their numbers.
pub(crate) struct Directions<'a> {
    /// Those that are computed each by itself. Beside sparse columns there are those of a model's own parameters alone: products of directions of one
    /// element with sparse columns are not computed.
    pub(super) each: Vec<Direction<'a>>,
    /// Groups of sparse columns. Products of two groups are not computed, but for those with the first one.
    pub(super) sparse: Vec<Sparse<'a>>,
}

impl<'a> From<Vec<Direction<'a>>> for Directions<'a> {
    fn from(each: Vec<Direction<'a>>) -> Self {
        Self { each, sparse: Vec::new() }
    }
}

impl<'a> From<Vec<Sparse<'a>>> for Directions<'a> {
    fn from(sparse: Vec<Sparse<'a>>) -> Self {
        Self { each: Vec::new(), sparse }
    }
}

impl<'a> Direction<'a> {
    /// One of these values: at one element, or at all.
    pub(crate) fn computed(
        only: Option<usize>,
        values: impl Fn(Range<usize>) -> Vec<f64> + Sync + 'a,
    ) -> Self {
        match only {
            Some(element) => Self::OfElement(element, Box::new(values)),
            None => Self::Column(Box::new(values)),
        }
    }

    /// The same direction in a list with so many others before.
    pub(crate) fn after(self, others: usize) -> Self {
        if let Self::Times { direction, factor } = self {
            return Self::Times { direction: direction + others, factor };
        }
        self
    }
}

impl Direction<'static> {
    /// The values of all bins, bin by bin, element by element.
    pub(crate) fn of(values: Vec<f64>, elements: usize) -> Self {
        Self::Column(Box::new(move |bins| values[bins.start * elements..bins.end * elements].to_vec()))
    }
}

/// A direction during a pass.
enum Running<'a> {
    Towards {
        stream: Box<Mutex<Stream<'a>>>,
        per_step: f64,
        factor: Option<Arc<Vec<f64>>>,
    },
    /// Taken from the derivative by all gains.
    RunGain(usize),
    /// Taken from another direction.
    Times {
        direction: usize,
        factor: Arc<Vec<f64>>,
    },
    Column(Box<dyn Fn(Range<usize>) -> Vec<f64> + Sync + 'a>),
    OfElement(usize, Box<dyn Fn(Range<usize>) -> Vec<f64> + Sync + 'a>),
}

/// The directions' values at the bins of a chunk, and the gains'.
struct Chunk {
    bins: Range<usize>,
    columns: Vec<Column>,
    sparse: Vec<SparseChunk>,
    by_gain: Vec<f64>,
}

/// The sums over the bins of a chunk: of each part of a block, with the block's number and the part's first bin; and those of sparse columns with
/// each other.
struct Summed {
    parts: Vec<(usize, usize, Sums)>,
    crossed: Vec<Crossed>,
}

/// A direction's values at the bins of a chunk.
enum Column {
    /// Bin by bin, element by element.
    Every(Vec<f64>),
    /// Those at one element, bin by bin.
    One(usize, Vec<f64>),
}

impl Problem<'_> {
    /// Sums over all data at a model, of which the first `own` directions are its own.
    pub(super) fn sums<'a>(
        &self,
        at: &Parameters,
        predicted: &[f64],
        directions: impl Into<Directions<'a>>,
        own: usize,
        kept: Kept,
        segments: &Segments,
    ) -> Result<Total, DiscoverError> {
        let Directions { each, sparse } = directions.into();
        let bins = self.predictor.bins;
        let standing = self.standing(at, predicted);
        let joined = bins.blocks.div_ceil(BLOCKS_MAX).max(1);
        let count = each.len() + 1;
        let all = count + sparse.iter().map(|of| of.columns).sum::<usize>();
        let mut total = Total::new(all, bins.elements, segments.run.len());
        let mut running: Vec<Running<'_>> =
            each.into_iter().map(|one| self.running(one, at)).collect::<Result<_, DiscoverError>>()?;
        let (parameters, step) = with_more_gain(at);
        running.push(self.running(Direction::Towards { parameters, step, factor: None }, at)?);
        let mut trunk = self.predictor.stream(at.clone())?;
        let pivots = if kept == Kept::OwnAndBlocks { own } else { count };
        let [least, most] = CHUNK_BINS;
        let held = count + size_of::<Few>() / size_of::<f64>() * sparse.len();
        let chunk_bins = (CHUNK_COLUMNS / held).clamp(least, most);
        let chunks =
            (0..bins.len()).step_by(chunk_bins).map(|first| first..(first + chunk_bins).min(bins.len()));
        let mut computed: Option<Chunk> = None;
        // The products of a chunk are summed while the next one is computed.
        for range in chunks.map(Some).chain([None]) {
            let (next, summed) = rayon::join(
                || range.map(|range| self.chunk(range, &running, &sparse, &mut trunk, predicted)).transpose(),
                || {
                    computed.as_ref().map(|chunk| Summed {
                        parts: self.sums_of_chunk(chunk, &standing, segments, joined, pivots),
                        crossed: if pivots == count { self.crossed(chunk) } else { Vec::new() },
                    })
                },
            );
            if let Some(Summed { parts, crossed }) = summed {
                for (number, first_bin, sums) in parts {
                    total.add(number, first_bin, own, &sums, kept);
                }
                for crossed in &crossed {
                    total.add_crossed(crossed);
                }
            }
            computed = next?;
        }
        Ok(total)
    }

    /// The values of all directions, the last of which is that of the gains, at the bins of a chunk.
    fn chunk(
        &self,
        range: Range<usize>,
        running: &[Running<'_>],
        sparse: &[Sparse<'_>],
        trunk: &mut Stream<'_>,
        predicted: &[f64],
    ) -> Result<Chunk, DiscoverError> {
        let reached = trunk.reach(range.len())?;
        let wanted = |bin: usize| self.train[bin] > 0.0;
        let values = |direction: &Running<'_>| direction.values(range.clone(), &reached, &wanted, predicted);
        let mut values: Vec<Vec<f64>> =
            parallel::map(running, values).into_iter().collect::<Result<_, DiscoverError>>()?;
        let by_gain = values.pop().unwrap_or_default();
        for (number, direction) in running.iter().enumerate().take(values.len()) {
            match direction {
                Running::RunGain(run) => values[number] = self.of_run(*run, range.start, &by_gain),
                Running::Times { direction, factor } => {
                    values[number] = times(&values[*direction], &factor[range.clone()]);
                }
                Running::Towards { .. } | Running::Column(_) | Running::OfElement(..) => {}
            }
        }
        let column = |(values, direction): (Vec<f64>, &Running<'_>)| match direction {
            Running::Towards { factor: Some(factor), .. } => {
                Column::Every(times(&values, &factor[range.clone()]))
            }
            Running::OfElement(element, _) => Column::One(*element, values),
            Running::Towards { .. } | Running::RunGain(_) | Running::Times { .. } | Running::Column(_) => {
                Column::Every(values)
            }
        };
        let columns: Vec<Column> = values.into_iter().zip(running).map(column).collect();
        let numbers = in_a_row(columns.len(), sparse.iter().map(|of| of.columns));
        let groups: Vec<_> = numbers.into_iter().zip(sparse).collect();
        let elements = self.predictor.bins.elements;
        let sparse = parallel::map(&groups, |(numbers, of)| {
            SparseChunk::of(numbers.start, of, range.clone(), elements)
        });
        Ok(Chunk { columns, sparse, bins: range, by_gain })
    }

    /// Products of the columns of each sparse group of a chunk with each other, and with those of the first group.
    fn crossed(&self, chunk: &Chunk) -> Vec<Crossed> {
        let used = chunk.bins.clone().filter(|bin| self.train[*bin] > 0.0);
        let bins: Vec<(usize, f64)> = used.map(|bin| (bin - chunk.bins.start, self.train[bin])).collect();
        let groups = chunk.sparse.len();
        let pairs: Vec<[usize; 2]> =
            (0..groups).map(|one| [one, one]).chain((1..groups).map(|one| [0, one])).collect();
        parallel::map(&pairs, |pair| {
            Crossed::of(pair.map(|one| &chunk.sparse[one]), &bins, &self.element_weight)
        })
    }

    /// Sums over each part of a chunk that belongs to one block and one segment, with the block's number and the part's first bin.
    fn sums_of_chunk(
        &self,
        chunk: &Chunk,
        standing: &[f64],
        segments: &Segments,
        joined: usize,
        pivots: usize,
    ) -> Vec<(usize, usize, Sums)> {
        let block = &self.predictor.bins.block;
        let key = |bin: usize| (block[bin] / joined, segments.of_bin[bin]);
        let used: Vec<usize> = chunk.bins.clone().filter(|bin| self.train[*bin] > 0.0).collect();
        let parts: Vec<&[usize]> = used.chunk_by(|one, next| key(*one) == key(*next)).collect();
        parallel::map(&parts, |part| {
            (block[part[0]] / joined, part[0], self.sums_of(chunk, part, standing, segments, pivots))
        })
    }

    fn running<'a>(
        &'a self,
        direction: Direction<'a>,
        trunk: &Parameters,
    ) -> Result<Running<'a>, DiscoverError> {
        Ok(match direction {
            Direction::Towards { parameters, step, factor } => Running::Towards {
                stream: Box::new(Mutex::new(self.predictor.branch(parameters, trunk)?)),
                // A parameter that cannot move has no derivative.
                per_step: if step == 0.0 { 0.0 } else { 1.0 / step },
                factor,
            },
            Direction::RunGain(run) => Running::RunGain(run),
            Direction::Times { direction, factor } => Running::Times { direction, factor },
            Direction::Column(values) => Running::Column(values),
            Direction::OfElement(element, values) => Running::OfElement(element, values),
        })
    }

    /// Values of the bins from `first` on, and 0 for those of other runs.
    fn of_run(&self, run: usize, first: usize, values: &[f64]) -> Vec<f64> {
        let bins = self.predictor.bins;
        let is_there = |place: usize| bins.run[first + place / bins.elements] == run;
        values.iter().enumerate().map(|(place, value)| if is_there(place) { *value } else { 0.0 }).collect()
    }

    /// Sums over the bins of a chunk that belong to one block. The products are those of the first `pivots` directions and of the
    /// residual with all, and of each with itself.
    fn sums_of(
        &self,
        chunk: &Chunk,
        part: &[usize],
        standing: &[f64],
        segments: &Segments,
        pivots: usize,
    ) -> Sums {
        let elements = self.predictor.bins.elements;
        let count = chunk.columns.len() + 1;
        let residual = chunk.sparse.last().map_or(count - 1, |last| last.numbers().end);
        let weighed: Vec<usize> =
            (0..elements).filter(|element| self.element_weight[*element] > 0.0).collect();
        let per_bin = weighed.len();
        let standing = &standing[chunk.bins.start * elements..chunk.bins.end * elements];
        let column = |number: usize| match chunk.columns.get(number) {
            Some(Column::Every(values)) => values.as_slice(),
            Some(Column::One(..)) => &[],
            None => standing,
        };
        let readings_of = |bin: &usize| {
            let start = (bin - chunk.bins.start) * elements;
            start..start + elements
        };
        // Directions that do nothing here, such as those of contact far from it, take no part.
        let acts = |number: &usize| match column(*number) {
            [] => false,
            column => part.iter().any(|bin| column[readings_of(bin)].iter().any(|value| *value != 0.0)),
        };
        let of_all: Vec<usize> = (0..count).filter(acts).collect();
        let of_one = chunk.of_one(part, &weighed);
        let first = of_all.iter().take_while(|number| **number < pivots).count();
        let has_residual = of_all.last() == Some(&(count - 1));
        let (sparse, places) = chunk.acting(part, &weighed, of_all.len() + of_one.len());
        let number = |number: &usize| if *number == count - 1 { residual } else { *number };
        let mut active: Vec<usize> =
            of_all.iter().map(number).chain(of_one.iter().map(|alone| alone.number)).collect();
        let rows = active.len();
        active.extend(&sparse);
        let mut sums = Sums {
            segment: segments.of_bin[part[0]],
            products: DMatrix::zeros(rows, active.len()),
            squares: vec![0.0; sparse.len()],
            border: Border::new(active.len(), elements),
            active,
        };
        // Weighed readings of a column in some bins, times the roots of their weights: bin by bin, element by element.
        let rooted = |column: &[f64], bins: &[usize], roots: &[f64], to: &mut Vec<f64>| {
            for (bin, roots) in bins.iter().zip(roots.chunks_exact(per_bin.max(1))) {
                let of_bin = &column[readings_of(bin)];
                if per_bin == elements {
                    to.extend(of_bin.iter().zip(roots).map(|(value, root)| value * root));
                } else {
                    to.extend(weighed.iter().zip(roots).map(|(element, root)| of_bin[*element] * root));
                }
            }
        };
        let (mut roots, mut gains, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for bins in part.chunks(TILE_BINS) {
            roots.clear();
            roots.extend(bins.iter().flat_map(|bin| {
                let of_bin = self.train[*bin];
                weighed.iter().map(move |element| (of_bin * self.element_weight[*element]).sqrt())
            }));
            gains.clear();
            rooted(&chunk.by_gain, bins, &roots, &mut gains);
            values.clear();
            for number in &of_all {
                rooted(column(*number), bins, &roots, &mut values);
            }
            sums.border.take(&weighed, [&roots, &gains], &values);
            let tile = DMatrix::from_vec(roots.len(), of_all.len(), std::mem::take(&mut values));
            sums.take(&tile, first, has_residual);
            let readings =
                Readings { bins, first_bin: chunk.bins.start, per_bin, roots: &roots, gains: &gains };
            sums.take_alone(&readings, &tile, first, has_residual, &of_one, pivots == count);
            sums.take_sparse(&readings, &tile, &chunk.sparse, [&weighed, &places]);
            values = tile.data.into();
        }
        // What is the same below the diagonal.
        sums.products.view_mut((0, 0), (rows, rows)).fill_lower_triangle_with_upper_triangle();
        sums
    }
}

/// Values bin by bin, each bin's times its factor.
fn times(values: &[f64], factors: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    let each = values.len() / factors.len();
    for (of_bin, factor) in values.chunks_exact_mut(each).zip(factors) {
        for value in of_bin {
            *value *= factor;
        }
    }
    values
}

/// A model whose gains are greater by a small share.
pub(super) fn with_more_gain(at: &Parameters) -> (Parameters, f64) {
    let mut more = at.clone();
    more.sensitivity.iter_mut().for_each(|gain| *gain *= 1.0 + GAIN_SHARE);
    (more, GAIN_SHARE)
}

impl Running<'_> {
    /// Its values at the next bins.
    fn values(
        &self,
        bins: Range<usize>,
        reached: &Reached,
        wanted: &impl Fn(usize) -> bool,
        predicted: &[f64],
    ) -> Result<Vec<f64>, DiscoverError> {
        let (stream, per_step) = match self {
            Self::Column(values) | Self::OfElement(_, values) => return Ok(values(bins)),
            Self::RunGain(_) | Self::Times { .. } => return Ok(Vec::new()),
            Self::Towards { stream, per_step, .. } => (stream, per_step),
        };
        let mut stream = stream.lock().unwrap_or_else(PoisonError::into_inner);
        let mut column = Vec::new();
        stream.take_on(bins.len(), reached, wanted, &mut column)?;
        let now = &predicted[column.len() / bins.len() * bins.start..];
        column.iter_mut().zip(now).for_each(|(value, now)| *value = (*value - now) * per_step);
        Ok(column)
    }
}

impl Chunk {
    /// The sparse columns that act in some bins; and for each one its place among them, after so many other directions.
    fn acting(&self, bins: &[usize], weighed: &[usize], others: usize) -> (Vec<usize>, Vec<usize>) {
        let (Some(first), Some(last)) = (self.sparse.first(), self.sparse.last()) else {
            return (Vec::new(), Vec::new());
        };
        let mut acts = vec![false; last.numbers().end - first.first];
        for group in &self.sparse {
            let of_group = &mut acts[group.first - first.first..];
            for of_bin in bins.iter().filter_map(|bin| group.at(bin - self.bins.start)) {
                let each = weighed.iter().flat_map(|element| of_bin[*element].each());
                each.for_each(|(column, _)| of_group[column] = true);
            }
        }
        let mut active = Vec::new();
        let place = |(column, acts): (usize, bool)| {
            let place = others + active.len();
            if acts {
                active.push(first.first + column);
            }
            place
        };
        let places = acts.into_iter().enumerate().map(place).collect();
        (active, places)
    }

    /// The directions of one element each that do something in some bins.
    fn of_one(&self, bins: &[usize], weighed: &[usize]) -> Vec<Alone<'_>> {
        let mut found = Vec::new();
        for (number, column) in self.columns.iter().enumerate() {
            let Column::One(element, values) = column else { continue };
            let Some(place) = weighed.iter().position(|one| one == element) else { continue };
            if bins.iter().any(|bin| values[bin - self.bins.start] != 0.0) {
                found.push(Alone { number, element: *element, place, values });
            }
        }
        found
    }
}
