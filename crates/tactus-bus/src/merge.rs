//! Merges a topic's history with its live messages: each message once and in order; missing ones are counted.
//!
//! History and live messages arrive by different ways and overlap. This replaces the merge of zenoh-ext: its subscriber
//! with both history and recovery passes on a live message first if one arrives while it recovers missing ones, and then
//! discards the history as outdated (seen in 1.10.2 with a run's events, joined late).

use std::{collections::HashMap, hash::Hash};

/// A received message with its publisher and number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Numbered<S, T> {
    /// The publisher and its message number; `None` from a publisher that does not number.
    pub(crate) origin: Option<(S, u32)>,
    pub(crate) item: T,
}

/// Merges history and live messages of one topic.
#[derive(Debug)]
pub(crate) struct Merge<S, T> {
    /// Live messages that arrived before the history. The wait for the history is limited, which bounds this list. `None`
    /// once the history has arrived.
    held: Option<Vec<Numbered<S, T>>>,
    /// Last number passed on, by publisher.
    last: HashMap<S, u32>,
    missed: u64,
}

impl<S: Eq + Hash, T> Merge<S, T> {
    /// Nothing is passed on until [`Merge::join`].
    pub(crate) fn awaiting_history() -> Self {
        Self { held: Some(Vec::new()), last: HashMap::new(), missed: 0 }
    }

    /// Takes a live message, and passes it on if the history has arrived.
    pub(crate) fn present(&mut self, message: Numbered<S, T>, pass_on: impl FnMut(T)) {
        match &mut self.held {
            Some(held) => held.push(message),
            None => self.pass(message, pass_on),
        }
    }

    /// Takes the whole history, in order, and passes it on with the live messages that arrived before it.
    pub(crate) fn join(&mut self, past: Vec<Numbered<S, T>>, mut pass_on: impl FnMut(T)) {
        let held = self.held.take().unwrap_or_default();
        for message in past.into_iter().chain(held) {
            self.pass(message, &mut pass_on);
        }
    }

    /// Number of messages that never arrived between those passed on.
    pub(crate) fn missed(&self) -> u64 {
        self.missed
    }

    fn pass(&mut self, message: Numbered<S, T>, mut pass_on: impl FnMut(T)) {
        if let Some((publisher, number)) = message.origin {
            if let Some(last) = self.last.get(&publisher) {
                // Numbers wrap around; a number in the half behind the last one is old.
                match number.wrapping_sub(*last) {
                    0 | 0x8000_0000.. => return,
                    step => self.missed += u64::from(step - 1),
                }
            }
            self.last.insert(publisher, number);
        }
        pass_on(message.item);
    }
}

#[cfg(test)]
#[path = "merge_tests.rs"]
mod tests;
