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
    /// A queue with the given capacity, at least 1.
    pub(crate) fn new(capacity: usize) -> Self {
        let inside = Inside { items: VecDeque::new(), dropped: 0, closed: false };
        Self { capacity: capacity.max(1), inside: Mutex::new(inside), ready: Notify::new() }
    }

    /// Appends an item and returns the displaced one: the oldest of a full queue or, once the queue is closed, the item
    /// itself.
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

    /// Waits for the oldest item and takes it; `None` once the queue is closed and empty.
    ///
    /// Cancel-safe. Only one reader at a time.
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

    /// Refuses further items; the items inside can still be read.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.ready.notify_one();
    }

    /// Number of items displaced by newer ones.
    pub(crate) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    fn lock(&self) -> MutexGuard<'_, Inside<T>> {
        // Nothing panics under this lock, and its state is always consistent.
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[path = "queue_tests.rs"]
mod tests;
