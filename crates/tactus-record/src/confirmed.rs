//! The presses of a run that were done to their end.

use std::{collections::BTreeMap, path::Path};

use tactus_schema::pb::{self, run_event::Event};

use crate::{
    Entry, Message, RecordError,
    reader::{io_error, read},
};

/// A press that its run confirmed: every dwell was done, and the tip was up again.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfirmedPress {
    /// Number of the script's step, counted from 0 in the run.
    pub step: u64,
    /// Where in the script, such as `corners.star:12`.
    pub at: String,
    /// Index of the press in the run. If the press was repeated, that of the last time.
    pub press: i32,
    /// Its dwells, in order; at least one.
    pub dwells: Vec<pb::DwellDone>,
}

/// The confirmed presses of a recording, complete or damaged, in order. A press whose events are not all there is none.
///
/// # Errors
/// If the file cannot be read, or is no MCAP file.
pub fn confirmed_presses(path: impl AsRef<Path>) -> Result<Vec<ConfirmedPress>, RecordError> {
    let path = path.as_ref();
    let mut confirmed = Confirmed::default();
    for entry in read(path)? {
        if let Entry::Message { message: Message::Event(event), .. } =
            entry.map_err(|source| io_error(path, source))?
        {
            confirmed.take(&event);
        }
    }
    Ok(confirmed.presses)
}

/// Collects the confirmed presses from the events of a run, in order.
#[derive(Debug, Default)]
pub(crate) struct Confirmed {
    presses: Vec<ConfirmedPress>,
    step: Option<(u64, String)>,
    /// Dwells of the present step, by press.
    dwells: BTreeMap<i32, Vec<pb::DwellDone>>,
    next_event: u64,
}

impl Confirmed {
    pub(crate) fn take(&mut self, event: &pb::RunEvent) {
        if event.seq != self.next_event {
            // If events of a step are lost, it is unknown whether it was done.
            self.step = None;
        }
        self.next_event = event.seq.saturating_add(1);
        match &event.event {
            Some(Event::StepStarted(started)) => {
                self.step = Some((started.step, started.at.clone()));
                self.dwells.clear();
            }
            Some(Event::DwellDone(dwell)) if dwell.press >= 0 => {
                self.dwells.entry(dwell.press).or_default().push(dwell.clone());
            }
            Some(Event::PressRepeated(repeated)) => {
                self.dwells.remove(&repeated.press);
            }
            Some(Event::StepDone(done)) => {
                let step = self.step.take().filter(|(step, _)| *step == done.step);
                if let (Some((step, at)), Some((press, dwells))) = (step, self.dwells.pop_last()) {
                    self.presses.push(ConfirmedPress { step, at, press, dwells });
                }
            }
            _ => {}
        }
    }

    pub(crate) fn last(&self) -> Option<&ConfirmedPress> {
        self.presses.last()
    }
}

#[cfg(test)]
#[path = "confirmed_tests.rs"]
mod tests;
