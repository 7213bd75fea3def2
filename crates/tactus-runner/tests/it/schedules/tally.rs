//! How often each thing was played and reached.

use std::collections::BTreeMap;
use std::fmt;

/// Counts by group and name. Merging is a sum, so that the order of schedules does not matter.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Tally(BTreeMap<(&'static str, String), u64>);

impl Tally {
    pub(super) fn count(&mut self, group: &'static str, name: impl Into<String>) {
        self.add(group, name, 1);
    }

    pub(super) fn add(&mut self, group: &'static str, name: impl Into<String>, number: u64) {
        *self.0.entry((group, name.into())).or_default() += number;
    }

    pub(super) fn merge(&mut self, other: Self) {
        for ((group, name), number) in other.0 {
            self.add(group, name, number);
        }
    }
}

impl fmt::Display for Tally {
    /// A line for each group.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut last = None;
        for ((group, name), number) in &self.0 {
            if last == Some(group) {
                write!(f, ", {name} {number}")?;
            } else {
                write!(f, "{}{group}: {name} {number}", if last.is_some() { "\n" } else { "" })?;
            }
            last = Some(group);
        }
        Ok(())
    }
}
