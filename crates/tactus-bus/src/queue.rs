//! A bounded queue that drops its oldest item when it is full, and counts what it dropped.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
};

use tokio::sync::Notify;

/// Many writers that never wait, one reader.
#[derive(Debug)]
pub(crate) struct Queue<T> {
    capacity: usize,
    inside: Mutex<Inside<T>>,
    ready: Notify,
}

#[derive(Debug)]
struct Inside<T> {
    items: VecDeque<T>,
    dropped: u64,
    closed: bool,
}

impl<T> Queue<T> {
    /// A queue of at least one place.
    pub(crate) fn new(capacity: usize) -> Self {
        let inside = Inside { items: VecDeque::new(), dropped: 0, closed: false };
        Self { capacity: capacity.max(1), inside: Mutex::new(inside), ready: Notify::new() }
    }

    /// Appends an item, and gives back the one that found no place: the oldest, or, once the queue is
    /// closed, the item itself.
    pub(crate) fn push(&self, item: T) -> Option<T> {
        let displaced = {
            let mut inside = self.lock();
            if inside.closed {
                return Some(item);
            }
            let oldest = if inside.items.len() == self.capacity { inside.items.pop_front() } else { None };
            inside.dropped += u64::from(oldest.is_some());
            inside.items.push_back(item);
            oldest
        };
        self.ready.notify_one();
        displaced
    }

    /// Takes the oldest item, waiting for one; `None` once the queue is closed and empty.
    ///
    /// Cancel-safe. For one reader at a time.
    pub(crate) async fn pop(&self) -> Option<T> {
        loop {
            {
                let mut inside = self.lock();
                if let Some(item) = inside.items.pop_front() {
                    return Some(item);
                }
                if inside.closed {
                    return None;
                }
            }
            self.ready.notified().await;
        }
    }

    /// Takes nothing in any more; what is inside can still be read.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.ready.notify_one();
    }

    /// Items that lost their place to newer ones.
    pub(crate) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    fn lock(&self) -> MutexGuard<'_, Inside<T>> {
        // Nothing panics under this lock, and each of its states is whole.
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[path = "queue_tests.rs"]
mod tests;
