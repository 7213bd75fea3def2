//! Joins a topic's past to its present: each message once, in order, and what is missing counted.
//!
//! Past and present come by different ways and overlap. zenoh-ext has a merge of its own, which this
//! replaces: its subscriber, asked for both history and recovery, hands on a present message before
//! the past if one arrives while it is asking for missing ones, and then throws the past away as
//! outdated (seen in 1.10.2 with a run's events joined late).

use std::{collections::HashMap, hash::Hash};

/// One message as it arrived: from which publisher, and its number there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Numbered<S, T> {
    /// The publisher, and its own count of its messages; `None` from a publisher that does not count.
    pub(crate) origin: Option<(S, u32)>,
    pub(crate) item: T,
}

/// Puts past and present of one topic together.
#[derive(Debug)]
pub(crate) struct Merge<S, T> {
    /// What came of the present while the past is awaited, which is not for long: the wait has a limit,
    /// and so has this; `None` once the past is there.
    held: Option<Vec<Numbered<S, T>>>,
    /// The last number passed on, by publisher.
    last: HashMap<S, u32>,
    missed: u64,
}

impl<S: Eq + Hash, T> Merge<S, T> {
    /// Nothing is passed on until [`Merge::join`].
    pub(crate) fn awaiting_past() -> Self {
        Self { held: Some(Vec::new()), last: HashMap::new(), missed: 0 }
    }

    /// Takes a message of the present, and passes it on if the past is there.
    pub(crate) fn present(&mut self, message: Numbered<S, T>, pass_on: impl FnMut(T)) {
        match &mut self.held {
            Some(held) => held.push(message),
            None => self.pass(message, pass_on),
        }
    }

    /// Takes the whole past, in order, and passes it on together with what came meanwhile.
    pub(crate) fn join(&mut self, past: Vec<Numbered<S, T>>, mut pass_on: impl FnMut(T)) {
        let held = self.held.take().unwrap_or_default();
        for message in past.into_iter().chain(held) {
            self.pass(message, &mut pass_on);
        }
    }

    /// Messages between those passed on that never came.
    pub(crate) fn missed(&self) -> u64 {
        self.missed
    }

    fn pass(&mut self, message: Numbered<S, T>, mut pass_on: impl FnMut(T)) {
        if let Some((publisher, number)) = message.origin {
            if let Some(last) = self.last.get(&publisher) {
                // Numbers wrap around; whatever lies in the half behind the last one is old.
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
