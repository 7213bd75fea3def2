//! Independent work on several threads.

use std::cmp::Reverse;
use std::sync::atomic::{AtomicIsize, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Threads for work within work: a thread that is out of work helps where the rest still has some.
#[derive(Debug)]
pub(crate) struct Threads {
    /// Threads that might compute beside those that do.
    spare: AtomicIsize,
}

impl Threads {
    /// So many in all, the caller's own among them.
    pub(crate) fn new(threads: usize) -> Self {
        Self { spare: AtomicIsize::new(threads.max(1).cast_signed() - 1) }
    }

    /// `work` of every item, in the order of the items, whatever the number of threads.
    pub(crate) fn map<T: Sync, R: Send>(&self, items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
        self.map_longest_first(items, |_| 0, work)
    }

    /// The same, begun with what takes longest, so that no thread is left with it at the end.
    pub(crate) fn map_longest_first<T: Sync, R: Send>(
        &self,
        items: &[T],
        length: impl Fn(&T) -> usize,
        work: impl Fn(&T) -> R + Sync,
    ) -> Vec<R> {
        let done: Vec<Mutex<Option<R>>> = items.iter().map(|_| Mutex::new(None)).collect();
        let mut order: Vec<(&T, &Mutex<Option<R>>)> = items.iter().zip(&done).collect();
        order.sort_by_key(|(item, _)| Reverse(length(item)));
        let next = AtomicUsize::new(0);
        let share = || {
            while let Some((item, slot)) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                let result = work(item);
                *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
            }
            self.spare.fetch_add(1, Ordering::Relaxed);
        };
        std::thread::scope(|scope| {
            for _ in 1..items.len() {
                if !self.take() {
                    break;
                }
                scope.spawn(share);
            }
            share();
        });
        // It was given away while the others finished, and may be at work elsewhere by now: then there is one too many for a
        // moment.
        self.spare.fetch_sub(1, Ordering::Relaxed);
        drop(order);
        done.into_iter()
            .filter_map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner))
            .collect()
    }

    /// Takes a spare thread, if there is one.
    fn take(&self) -> bool {
        let less = |spare: isize| (spare > 0).then_some(spare - 1);
        self.spare.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less).is_ok()
    }
}
