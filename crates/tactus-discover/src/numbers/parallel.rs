//! Independent work on the threads of rayon's current pool.
//!
//! Items are handed out one by one, and no thread works on two items of one call at a time, also if calls are nested. This
//! limits the memory in use.

use std::cmp::Reverse;

use rayon::iter::{ParallelBridge, ParallelIterator};

/// `work` of every item, in the order of the items, whatever the number of threads.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    map_longest_first(items, |_| 0, work)
}

/// As [`map`], but starts with the longest items, so that no thread is left with one at the end.
pub(crate) fn map_longest_first<T: Sync, R: Send>(
    items: &[T],
    length: impl Fn(&T) -> usize,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let mut order: Vec<(usize, &T)> = items.iter().enumerate().collect();
    order.sort_by_key(|(_, item)| Reverse(length(item)));
    let mut done: Vec<(usize, R)> =
        order.into_iter().par_bridge().map(|(index, item)| (index, work(item))).collect();
    done.sort_unstable_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}
