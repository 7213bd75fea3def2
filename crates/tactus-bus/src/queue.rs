//! A bounded queue that drops its oldest items when it is full, and counts what it dropped. It is bounded in items and, where they
//! differ in size, in bytes.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
};

use tokio::sync::Notify;

/// Many writers that never wait, one reader.
#[derive(Debug)]
pub(crate) struct Queue<T> {
    capacity: usize,
    bytes_max: usize,
    /// Size of an item.
    bytes_of: fn(&T) -> usize,
    inside: Mutex<Inside<T>>,
    ready: Notify,
}

#[derive(Debug)]
struct Inside<T> {
    items: VecDeque<T>,
    bytes: usize,
    dropped: u64,
    closed: bool,
}

impl<T> Queue<T> {
    /// A queue with the given capacity, at least 1.
    pub(crate) fn new(capacity: usize) -> Self {
        Self::bounded(capacity, usize::MAX, |_| 0)
    }

    /// A queue with the given capacity, at least 1, for items of at most `bytes_max` bytes together. One item always fits.
    pub(crate) fn bounded(capacity: usize, bytes_max: usize, bytes_of: fn(&T) -> usize) -> Self {
        let inside = Inside { items: VecDeque::new(), bytes: 0, dropped: 0, closed: false };
        let capacity = capacity.max(1);
        Self { capacity, bytes_max, bytes_of, inside: Mutex::new(inside), ready: Notify::new() }
    }

    /// Appends an item and returns a displaced one: the last of the oldest that gave way or, once the queue is closed, the
    /// item itself.
    pub(crate) fn push(&self, item: T) -> Option<T> {
        let displaced = {
            let mut inside = self.lock();
            if inside.closed {
                return Some(item);
            }
            let added = (self.bytes_of)(&item);
            let mut displaced = None;
            while inside.items.len() == self.capacity
                || (!inside.items.is_empty() && inside.bytes.saturating_add(added) > self.bytes_max)
            {
                displaced = self.take_oldest(&mut inside);
                inside.dropped += 1;
            }
            inside.bytes = inside.bytes.saturating_add(added);
            inside.items.push_back(item);
            displaced
        };
        self.ready.notify_one();
        displaced
    }

    fn take_oldest(&self, inside: &mut Inside<T>) -> Option<T> {
        let oldest = inside.items.pop_front()?;
        inside.bytes = inside.bytes.saturating_sub((self.bytes_of)(&oldest));
        Some(oldest)
    }

    /// Waits for the oldest item and takes it; `None` once the queue is closed and empty.
    ///
    /// Cancel-safe. Only one reader at a time.
    pub(crate) async fn pop(&self) -> Option<T> {
        loop {
            {
                let mut inside = self.lock();
                if let Some(item) = self.take_oldest(&mut inside) {
                    return Some(item);
                }
                if inside.closed {
                    return None;
                }
            }
            self.ready.notified().await;
        }
    }

    /// Takes the oldest item, if there is one.
    pub(crate) fn try_pop(&self) -> Option<T> {
        self.take_oldest(&mut self.lock())
    }

    /// True once the queue is closed and empty.
    pub(crate) fn is_finished(&self) -> bool {
        let inside = self.lock();
        inside.closed && inside.items.is_empty()
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
