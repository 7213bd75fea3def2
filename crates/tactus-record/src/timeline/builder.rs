//! Builds a timeline from a recording's entries.

use std::{collections::BTreeMap, path::Path};

use tactus_schema::{
    DeviceTick, Frame, MonoTime, Rig,
    pb::{self, run_event::Event},
    table::Phase,
};

use super::{StageReport, Timeline, press_numbers::PressNumbers};
use crate::{
    Completeness, Entry, EpochClock, Message, NoClock, RecordError, RunMetadata, Tally, header::RIG_JSON,
};

#[derive(Default)]
pub(super) struct TimelineBuilder {
    attachments: BTreeMap<String, Vec<u8>>,
    /// Ticks and arrivals by connection; `None` once a frame of the connection had no tick.
    ticks: BTreeMap<u32, Option<Vec<(DeviceTick, MonoTime)>>>,
    /// Tick length by connection, as first known when one of its frames arrived.
    tick_ns: BTreeMap<u32, u64>,
    stated_tick_ns: u64,
    stage: Vec<StageReport>,
    phases: Vec<(MonoTime, Phase, i32)>,
    coverings: Vec<(MonoTime, f64)>,
    untold: Vec<(MonoTime, MonoTime)>,
    events: Vec<pb::RunEvent>,
    presses: PressNumbers,
    tally: Tally,
}

impl TimelineBuilder {
    pub(super) fn take(&mut self, entry: Entry) {
        let message = match entry {
            Entry::Run(_) => return,
            Entry::Attachment(file) => {
                self.attachments.insert(file.name, file.data);
                return;
            }
            Entry::Message { message, .. } => message,
        };
        self.message(message);
    }

    pub(super) fn message(&mut self, message: Message) {
        self.tally.take(&message);
        #[expect(
            clippy::wildcard_enum_match_arm,
            reason = "other kinds say nothing about where the stage was"
        )]
        match message {
            Message::Frame(frame) => self.frame(&frame),
            Message::SensorInfo(info) => self.stated_tick_ns = info.tick_ns,
            Message::Stage(state) => self.stage(&state),
            Message::Event(event) => self.event(*event),
            _ => {}
        }
    }

    fn frame(&mut self, frame: &Frame) {
        if self.stated_tick_ns > 0 {
            self.tick_ns.entry(frame.epoch).or_insert(self.stated_tick_ns);
        }
        let ticks = self.ticks.entry(frame.epoch).or_insert_with(|| Some(Vec::new()));
        match (ticks.as_mut(), frame.device_tick) {
            (Some(known), Some(tick)) => known.push((tick, frame.received.mono)),
            _ => *ticks = None,
        }
    }

    fn stage(&mut self, state: &pb::StageState) {
        // A disconnected stage reports no valid position.
        let position_mm = [state.x_mm, state.y_mm, state.z_mm];
        if state.status() != pb::StageStatus::Disconnected && position_mm.iter().all(|mm| mm.is_finite()) {
            let stands = state.status() == pb::StageStatus::Idle;
            self.stage.push(StageReport { at: MonoTime::from_ns(state.t_mono_ns), position_mm, stands });
        }
    }

    fn event(&mut self, mut event: pb::RunEvent) {
        self.presses.renumber(&mut event);
        let at = MonoTime::from_ns(event.t_mono_ns);
        // A collection has events of several runs, and of its own.
        let earlier = self.events.iter().rev().find(|earlier| earlier.run_id == event.run_id);
        let (next, since) = earlier.map_or((0, MonoTime::from_ns(i64::MIN)), |last| {
            (last.seq.saturating_add(1), MonoTime::from_ns(last.t_mono_ns))
        });
        if event.seq > next {
            self.untold.push((since, MonoTime::from_ns(i64::MAX)));
        }
        match &event.event {
            Some(Event::PhaseChanged(changed)) => {
                for (_, until) in &mut self.untold {
                    *until = at.min(*until);
                }
                if let Ok(phase) = Phase::try_from(changed.phase()) {
                    self.phases.push((at, phase, changed.press.max(-1)));
                }
            }
            Some(Event::Started(started)) if started.covering_mm > 0.0 => {
                self.coverings.push((at, started.covering_mm));
            }
            Some(Event::CoveringChanged(changed)) => self.coverings.push((at, changed.covering_mm)),
            _ => {}
        }
        self.events.push(event);
    }

    /// The timeline of a recording, whose rig is among its attachments.
    pub(super) fn into_timeline(
        self,
        path: &Path,
        run: RunMetadata,
        completeness: Completeness,
    ) -> Result<Timeline, RecordError> {
        let Some(Ok(rig_json)) = self.attachments.get(RIG_JSON).cloned().map(String::from_utf8) else {
            let problem = "missing: the recording was cut off before it, or is not ours".to_owned();
            return Err(RecordError::Header { path: path.to_owned(), what: RIG_JSON.into(), problem });
        };
        let rig =
            Rig::from_json(&rig_json).map_err(|source| RecordError::Rig { path: path.to_owned(), source })?;
        Ok(self.finish(path, run, (rig, rig_json), completeness))
    }

    /// The timeline of a run on a rig, which is given as its text in JSON as well.
    pub(super) fn finish(
        mut self,
        path: &Path,
        run: RunMetadata,
        (rig, rig_json): (Rig, String),
        completeness: Completeness,
    ) -> Timeline {
        let lost_chunks = matches!(&completeness, Completeness::Damaged(damage) if damage.chunks > 0);
        if lost_chunks && self.tally.finished().is_none() {
            // Nothing tells whether the last event here was the last.
            let since = self.events.last().map_or(i64::MIN, |last| last.t_mono_ns);
            self.untold.push((MonoTime::from_ns(since), MonoTime::from_ns(i64::MAX)));
        }
        // Sorted by the messages' own times; a stable sort keeps the order of equal times.
        self.stage.sort_by_key(|report| report.at);
        self.stage.dedup_by(|later, kept| {
            let same = later.at == kept.at;
            if same {
                *kept = *later;
            }
            same
        });
        self.phases.sort_by_key(|(from, _, _)| *from);
        self.coverings.sort_by_key(|(from, _)| *from);
        let clocks = self
            .ticks
            .iter()
            .map(|(&epoch, ticks)| {
                let tick_ns = self.tick_ns.get(&epoch).copied().unwrap_or(self.stated_tick_ns);
                let ticks = ticks.as_deref().ok_or(NoClock::Absent);
                (epoch, ticks.and_then(|ticks| EpochClock::estimate(epoch, tick_ns, ticks)))
            })
            .collect();
        Timeline {
            path: path.to_owned(),
            run,
            rig,
            rig_json,
            attachments: self.attachments,
            clocks,
            stage: self.stage,
            phases: self.phases,
            untold: self.untold,
            coverings: self.coverings,
            events: self.events,
            tally: self.tally,
            completeness,
        }
    }
}
