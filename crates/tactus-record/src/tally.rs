//! Totals of a run: frames received and lost, presses, dwells, exit status.

use std::{collections::BTreeSet, time::Duration};

use tactus_schema::{
    Frame, MonoTime,
    pb::{self, run_event::Event},
};

use crate::Message;

/// Totals over the messages of one run, counted in the order in which they were recorded.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    frames: u64,
    frames_lost: u64,
    frames_unaccounted: u64,
    gaps: u64,
    last_seq: Option<u64>,
    /// Runs in the order of their first dwell: a collection has several.
    runs: Vec<String>,
    /// Run, press and number of each dwell of a press.
    dwells: BTreeSet<(usize, i32, u32)>,
    dwells_outside: u32,
    span: Option<(MonoTime, MonoTime)>,
    finished: Option<pb::RunFinished>,
}

impl Tally {
    /// Counts any message as it was read back.
    pub fn take(&mut self, message: &Message) {
        message.count(self);
    }

    /// Counts a frame; returns how many are missing between it and the one before.
    ///
    /// Frames lost before the first one were lost before the recording began, and are not counted.
    pub fn frame(&mut self, frame: &Frame) -> u64 {
        self.time(frame.received.mono);
        self.frames += 1;
        let lost_before = u64::from(frame.lost_before);
        let lost = self.last_seq.map_or(0, |last| {
            let step = frame.seq.saturating_sub(last);
            lost_before.max(step.saturating_sub(1))
        });
        if self.last_seq.is_some() {
            self.frames_unaccounted = self.frames_unaccounted.saturating_add(lost - lost_before);
        }
        self.last_seq = Some(frame.seq);
        self.frames_lost = self.frames_lost.saturating_add(lost);
        self.gaps += u64::from(lost > 0);
        lost
    }

    /// Counts an event of the run.
    pub fn event(&mut self, event: &pb::RunEvent) {
        self.time(MonoTime::from_ns(event.t_mono_ns));
        match &event.event {
            // A press that was begun again repeats its dwells: each counts once.
            Some(Event::DwellDone(dwell)) if dwell.press >= 0 => {
                let run = self.run(&event.run_id);
                self.dwells.insert((run, dwell.press, dwell.dwell));
            }
            Some(Event::DwellDone(_)) => self.dwells_outside += 1,
            Some(Event::Finished(finished)) => self.finished = Some(finished.clone()),
            _ => {}
        }
    }

    /// Index of a run among those that have dwells.
    fn run(&mut self, id: &str) -> usize {
        self.runs.iter().position(|run| run == id).unwrap_or_else(|| {
            self.runs.push(id.to_owned());
            self.runs.len() - 1
        })
    }

    /// Extends the duration to the time of a message.
    pub fn time(&mut self, at: MonoTime) {
        let (first, last) = self.span.unwrap_or((at, at));
        self.span = Some((first.min(at), last.max(at)));
    }

    /// Number of frames received.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Number of frames that the sensor took and that never arrived.
    pub fn frames_lost(&self) -> u64 {
        self.frames_lost
    }

    /// Number of frames that were received and are not here, as far as the numbers of the others and the end of the run
    /// tell: the part of the recording that had them is lost. Those that leave a gap are counted as lost, too.
    pub fn frames_missing(&self) -> u64 {
        let received = self.finished.as_ref().map_or(0, |finished| finished.frames);
        self.frames_unaccounted.max(received.saturating_sub(self.frames))
    }

    /// Number of gaps in the sequence of frames.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Number of presses with at least one completed dwell.
    pub fn presses(&self) -> u32 {
        let presses: BTreeSet<_> = self.dwells.iter().map(|(run, press, _)| (run, press)).collect();
        u32::try_from(presses.len()).unwrap_or(u32::MAX)
    }

    /// Number of completed dwells.
    pub fn dwells(&self) -> u32 {
        u32::try_from(self.dwells.len()).unwrap_or(u32::MAX).saturating_add(self.dwells_outside)
    }

    /// From the first message to the last.
    pub fn duration(&self) -> Duration {
        self.span.map_or(Duration::ZERO, |(first, last)| last.since(first))
    }

    /// How the run ended; `None` if it never said.
    pub fn finished(&self) -> Option<&pb::RunFinished> {
        self.finished.as_ref()
    }

    /// The totals as the end of the run.
    pub(crate) fn finish(&self, exit_status: pb::ExitStatus, message: String) -> pb::RunFinished {
        pb::RunFinished {
            exit_status: exit_status.into(),
            message,
            frames: self.frames(),
            frames_lost: self.frames_lost(),
            presses: self.presses(),
            dwells: self.dwells(),
            duration_s: self.duration().as_secs_f64(),
        }
    }

    /// How the run ended; `None` if it never said.
    pub fn exit_status(&self) -> Option<pb::ExitStatus> {
        self.finished.as_ref().map(pb::RunFinished::exit_status)
    }
}

#[cfg(test)]
#[path = "tally_tests.rs"]
mod tests;
