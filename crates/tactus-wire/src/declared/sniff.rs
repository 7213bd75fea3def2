//! Analyses bytes of an unknown format.

use std::cmp::Reverse;

/// Longest frame that is searched for.
pub const MAX_STRIDE_BYTES: usize = 4096;

/// Length of the part of a capture that is analysed.
const MAX_LOOKED_AT_BYTES: usize = 1 << 16;

/// Number of strides that are analysed further.
const CANDIDATES: usize = 64;

/// Share of frames that must have the same byte for a constant, or a byte increased by one for a counter.
const NEARLY_ALL: f64 = 0.97;

/// A shorter stride is preferred to the best one if its likeness is at least this share of the best.
const AS_GOOD: f64 = 0.8;

/// Number of runs of constant bytes that are tried as sync bytes, most distinctive first.
const RUNS_LOOKED_FOR: usize = 16;

/// Longest sync that is proposed.
const MAX_SYNC_BYTES: usize = 8;

/// A possible format of the frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Length of a frame in bytes.
    pub stride: usize,
    /// Share of bytes that are equal one stride later, in excess of chance; up to 1.
    pub likeness: f64,
    /// Bytes that occur once in every stride at the same place: probably the sync bytes, or a part of them.
    pub sync: Vec<u8>,
    /// Offset of the first occurrence of `sync`.
    pub first_at: usize,
    /// Offsets from the sync of bytes that are the same in every frame.
    pub constant: Vec<usize>,
    /// Offsets from the sync of bytes that increase by one from frame to frame: probably the low byte of a frame count.
    pub counters: Vec<usize>,
}

/// Searches for frames of one length in bytes of an unknown format.
///
/// The bytes are compared with themselves one stride later, for all strides up to [`MAX_STRIDE_BYTES`] and a third of the
/// capture. A stride is proposed if constant bytes occur once in each frame. The best proposal comes first; there is none if
/// nothing repeats. The first 64 KiB are analysed. One second of recording is usually enough, best without any contact with
/// the array. Lost bytes or frames of different lengths prevent a result.
pub fn propose(capture: &[u8]) -> Vec<Proposal> {
    let bytes = capture.get(..MAX_LOOKED_AT_BYTES).unwrap_or(capture);
    let chance = chance(bytes);
    let mut likenesses: Vec<(usize, f64)> = (2..=MAX_STRIDE_BYTES.min(bytes.len() / 3))
        .map(|stride| (stride, likeness(bytes, stride, chance)))
        .filter(|(_, likeness)| *likeness > 0.0)
        .collect();
    likenesses.sort_by(|(a_stride, a), (b_stride, b)| b.total_cmp(a).then(a_stride.cmp(b_stride)));
    likenesses.truncate(CANDIDATES);
    let mut proposals: Vec<Proposal> =
        likenesses.into_iter().filter_map(|(stride, likeness)| proposal(bytes, stride, likeness)).collect();
    if let Some(best) = proposals.first().map(|best| best.likeness) {
        proposals.sort_by_key(|proposal| (proposal.likeness < AS_GOOD * best, proposal.stride));
    }
    proposals
}

/// Share of bytes that are equal one stride later, in excess of chance.
fn likeness(bytes: &[u8], stride: usize, chance: f64) -> f64 {
    let later = bytes.get(stride..).unwrap_or_default();
    // In blocks, which the compiler vectorises, and in which the count cannot overflow a byte.
    let same_in = |(now, later): (&[u8], &[u8])| -> usize {
        now.iter().zip(later).fold(0_u8, |same, (now, later)| same + u8::from(now == later)).into()
    };
    let same: usize = bytes.chunks(128).zip(later.chunks(128)).map(same_in).sum();
    let same = same as f64 / later.len().max(1) as f64;
    if chance < 1.0 { (same - chance) / (1.0 - chance) } else { 0.0 }
}

/// Share of bytes that would be equal by chance.
fn chance(bytes: &[u8]) -> f64 {
    let length = bytes.len().max(1) as f64;
    histogram(bytes).iter().map(|count| (*count as f64 / length).powi(2)).sum()
}

/// Number of occurrences of each byte.
fn histogram<'a>(bytes: impl IntoIterator<Item = &'a u8>) -> [usize; 256] {
    let mut counts = [0; 256];
    for byte in bytes {
        if let Some(count) = counts.get_mut(usize::from(*byte)) {
            *count += 1;
        }
    }
    counts
}

/// The proposal for a stride, if constant bytes occur once in each frame.
fn proposal(bytes: &[u8], stride: usize, likeness: f64) -> Option<Proposal> {
    let columns: Vec<ByteColumn> = (0..stride).map(|phase| ByteColumn::of(bytes, stride, phase)).collect();
    let mut runs: Vec<ConstantRun> =
        runs(&columns).into_iter().map(|run| ConstantRun::of(&columns, run)).collect();
    runs.sort_by_key(|run| Reverse((run.distinctive, run.after_varied)));
    let mark = runs.iter().take(RUNS_LOOKED_FOR).find_map(|run| run.mark(bytes, stride))?;
    let first_at = find(bytes, &mark.sync).next()?;
    let from_sync = |matches: fn(&ByteColumn) -> bool| -> Vec<usize> {
        let phases = columns.iter().cycle().skip(mark.phase).take(stride).enumerate();
        phases.filter(|(_, column)| matches(column)).map(|(offset, _)| offset).collect()
    };
    Some(Proposal {
        stride,
        likeness,
        first_at,
        constant: from_sync(|column| column.value.is_some()),
        counters: from_sync(|column| column.counts),
        sync: mark.sync,
    })
}

/// The bytes at one offset of all frames.
struct ByteColumn {
    /// Their value, if nearly all are the same.
    value: Option<u8>,
    /// True if they increase by one from frame to frame.
    counts: bool,
    /// Number of different values.
    kinds: usize,
}

impl ByteColumn {
    fn of(bytes: &[u8], stride: usize, phase: usize) -> Self {
        let values = || bytes.iter().skip(phase).step_by(stride);
        let counts = histogram(values());
        let total = counts.iter().sum::<usize>();
        let (mode, most) = (0..=u8::MAX).zip(&counts).max_by_key(|(_, count)| **count).unwrap_or((0, &0));
        let steps = values().zip(values().skip(1)).filter(|(a, b)| a.wrapping_add(1) == **b).count();
        Self {
            value: (*most as f64 >= NEARLY_ALL * total as f64).then_some(mode),
            counts: total > 2 && steps as f64 >= NEARLY_ALL * (total - 1) as f64,
            kinds: counts.iter().filter(|count| **count > 0).count(),
        }
    }
}

/// Beginning and length of each run of constant columns. A run may continue from the last column to the first.
fn runs(columns: &[ByteColumn]) -> Vec<(usize, usize)> {
    let stride = columns.len();
    let constant = |phase: usize| columns.get(phase % stride).is_some_and(|column| column.value.is_some());
    (0..stride)
        .filter(|phase| constant(*phase) && !constant(phase + stride - 1))
        .map(|phase| (phase, (phase..phase + stride).take_while(|phase| constant(*phase)).count()))
        .collect()
}

/// Adjacent constant columns.
struct ConstantRun {
    phase: usize,
    values: Vec<u8>,
    /// Number of bytes other than 0x00 and 0xFF; constant ones are rare outside of sync bytes.
    distinctive: usize,
    /// Number of different bytes just before it: a checksum in front of a sync varies most.
    after_varied: usize,
}

/// Constant bytes that occur once in every stride.
struct SyncCandidate {
    phase: usize,
    sync: Vec<u8>,
}

impl ConstantRun {
    fn of(columns: &[ByteColumn], (phase, length): (usize, usize)) -> Self {
        let values: Vec<u8> =
            columns.iter().cycle().skip(phase).take(length).filter_map(|column| column.value).collect();
        let distinctive = values.iter().filter(|byte| !matches!(byte, 0x00 | 0xFF)).count();
        let before = columns.get((phase + columns.len() - 1) % columns.len());
        Self { phase, values, distinctive, after_varied: before.map_or(0, |column| column.kinds) }
    }

    /// The shortest beginning of it with at least two bytes, or else its first byte, that occurs once in every stride.
    fn mark(&self, bytes: &[u8], stride: usize) -> Option<SyncCandidate> {
        let expected = bytes.len() as f64 / stride as f64;
        let is_mark = |sync: &&[u8]| {
            let found = find(bytes, sync).take(bytes.len() / stride * 2 + 2).count() as f64;
            (found - expected).abs() <= (0.05 * expected).max(1.5)
        };
        let lengths = (2..=self.values.len().min(MAX_SYNC_BYTES)).chain([1]);
        let sync = lengths.filter_map(|length| self.values.get(..length)).find(is_mark)?.to_vec();
        Some(SyncCandidate { phase: self.phase, sync })
    }
}

/// Offsets of a pattern.
pub(super) fn find<'a>(bytes: &'a [u8], pattern: &'a [u8]) -> impl Iterator<Item = usize> + 'a {
    let windows = bytes.windows(pattern.len().max(1)).enumerate();
    windows.filter(move |(_, window)| *window == pattern).map(|(at, _)| at)
}

#[cfg(test)]
#[path = "sniff_tests.rs"]
pub(super) mod tests;
