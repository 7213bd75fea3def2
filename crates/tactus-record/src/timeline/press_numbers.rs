//! Presses of several runs in one file. Each run counts its presses from 0, and a collection has the runs of an hour.

use std::collections::BTreeMap;

use tactus_schema::pb::{self, run_event::Event};

/// Gives each press of a file a number of its own: those of the first run stay, those of a later one go on after all before.
#[derive(Debug, Default)]
pub(super) struct PressNumbers {
    /// What is added to a run's numbers, by its id.
    added: BTreeMap<String, i32>,
    /// Behind the greatest number so far.
    next: i32,
}

impl PressNumbers {
    /// Changes the number of the press in an event of a run, if it has one.
    pub(super) fn renumber(&mut self, event: &mut pb::RunEvent) {
        let Some(press) = press_of(&mut event.event) else { return };
        let added = match self.added.get(&event.run_id) {
            Some(added) => *added,
            None => *self.added.entry(event.run_id.clone()).or_insert(self.next),
        };
        *press = press.saturating_add(added);
        self.next = self.next.max(press.saturating_add(1));
    }
}

/// The number of a press within its run, unless the event is of none.
fn press_of(event: &mut Option<Event>) -> Option<&mut i32> {
    let press = match event {
        Some(Event::PhaseChanged(changed)) => &mut changed.press,
        Some(Event::DwellDone(dwell)) => &mut dwell.press,
        Some(Event::PressRepeated(repeated)) => &mut repeated.press,
        _ => return None,
    };
    (*press >= 0).then_some(press)
}

#[cfg(test)]
#[path = "press_numbers_tests.rs"]
mod tests;
