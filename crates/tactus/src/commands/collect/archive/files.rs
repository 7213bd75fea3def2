//! The files of one rig: one is open at a time, and each can be read by itself.

mod earlier;

use std::collections::BTreeMap;
use std::fs;
use std::iter;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use tactus_record::{Header, RecordError, Recording, Script, Timed, space};
use tactus_runner::order::timestamp;
use tactus_schema::pb::{self, run_event::Event};
use tactus_schema::{Frame, TimeStamp, WallTime};

use super::{Described, Heard, Limits, Totals};
use earlier::Earlier;

/// Without messages for this time, what waits in memory is written.
const IDLE: Duration = Duration::from_secs(1);
/// Events of a run in progress that are kept for the next file.
const EVENTS_MAX: usize = 16_384;
/// What stands in the place of an experiment.
const SCRIPT: Script<'_> = Script {
    name: "collect.star",
    source: "# No experiment: `tactus collect` recorded what the rig published.\n",
};

/// The files of one rig.
pub(super) struct Files {
    rig: String,
    folder: PathBuf,
    limits: Limits,
    who: String,
    described: Option<Described>,
    open: Option<Open>,
    carried: Carried,
    /// What an earlier collection has of the rig.
    earlier: Earlier,
    /// Number of the next frame, if none is missing; unknown before the first one.
    due: Option<u64>,
    /// Time of the last message.
    at: TimeStamp,
    pub(super) totals: Totals,
}

/// The file that is written now.
struct Open {
    id: String,
    recording: Recording,
    began: Instant,
    touched: Instant,
    /// Events of the collection itself.
    events: u64,
    /// Frames and other messages that are missing in it.
    lost: u64,
}

/// What each file begins with, so that its frames can be understood without the files before it.
#[derive(Default)]
struct Carried {
    info: Option<pb::SensorInfo>,
    stage: Option<pb::StageState>,
    /// All of the run in progress.
    events: Vec<pb::RunEvent>,
}

impl Files {
    pub(super) fn new(rig: &str, folder: PathBuf, limits: Limits, who: &str) -> Self {
        Self {
            rig: rig.to_owned(),
            earlier: Earlier::in_folder(&folder),
            folder,
            limits,
            who: who.to_owned(),
            described: None,
            open: None,
            carried: Carried::default(),
            due: None,
            at: TimeStamp::default(),
            totals: Totals::default(),
        }
    }

    /// Records what was heard.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn take(&mut self, heard: Heard) -> Result<(), RecordError> {
        match heard {
            Heard::Described(described) => {
                self.described = Some(*described);
                self.totals.problem = None;
            }
            Heard::Undescribed(problem) => {
                if self.totals.problem.as_ref() != Some(&problem) {
                    eprintln!("{}: {problem}", self.rig);
                }
                self.totals.problem = Some(problem);
            }
            Heard::Info(info) => {
                let at = self.at;
                // It has no time of its own, and waits for the first message that has.
                if let Some(open) = &mut self.open {
                    open.recording.write_sensor_info(&info, at)?;
                }
                self.carried.info = Some(info);
            }
            Heard::Stage(state) => {
                self.write_new(&state)?;
                self.carried.stage = Some(state);
            }
            Heard::Safety(event) => self.write_new(&event)?,
            Heard::Event(event) => {
                self.write_new(&*event)?;
                self.carried.event(*event);
            }
            Heard::Frame(frame) => self.frame(&frame)?,
            Heard::Restarted => {
                eprintln!("{}: started again; a new file begins", self.rig);
                self.close()?;
                (self.carried, self.due) = (Carried::default(), Some(0));
                self.earlier = Earlier::default();
                self.totals.restarts += 1;
            }
            Heard::AskedAgain(messages) => self.totals.messages_asked_again += messages,
            Heard::Lost(topic, messages) => {
                self.totals.messages_lost += messages;
                let text = format!("{messages} messages of {} are lost: {KEPT_NO_LONGER}", topic.suffix());
                self.lost(messages, &text, Event::Log(pb::Log { message: text.clone() }))?;
            }
            Heard::Foreign(messages) => self.totals.messages_foreign = messages,
        }
        Ok(())
    }

    /// Completes the file if it is long enough; writes what waits in memory if nothing comes.
    ///
    /// # Errors
    /// As [`Files::take`].
    pub(super) fn tick(&mut self) -> Result<(), RecordError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        // A file that cannot be looked at will tell at the next write.
        let bytes = fs::metadata(open.recording.path()).map_or(0, |file| file.len());
        if open.began.elapsed() >= self.limits.span || bytes >= self.limits.bytes {
            return self.close();
        }
        if open.recording.unstored().messages > 0 && open.touched.elapsed() >= IDLE {
            open.recording.flush()?;
        }
        Ok(())
    }

    /// Completes the file that is open.
    ///
    /// # Errors
    /// As [`Files::take`].
    pub(super) fn close(&mut self) -> Result<(), RecordError> {
        let Some(mut open) = self.open.take() else { return Ok(()) };
        let tally = open.recording.tally();
        let (exit_status, message) = match open.lost {
            0 => (pb::ExitStatus::Done, String::new()),
            lost => (pb::ExitStatus::Degraded, format!("{lost} messages are missing")),
        };
        let finished = pb::RunFinished {
            exit_status: exit_status.into(),
            message,
            frames: tally.frames(),
            frames_lost: tally.frames_lost(),
            presses: tally.presses(),
            dwells: tally.dwells(),
            duration_s: tally.duration().as_secs_f64(),
        };
        // A recording that failed before ends itself, in the space that it has in reserve, and says so.
        let told = open.recording.flush().and_then(|()| open.tell(self.at, Event::Finished(finished)));
        let summary = open.recording.finish()?;
        told?;
        self.totals.files += 1;
        self.totals.bytes += summary.bytes;
        Ok(())
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        if self.earlier.has(frame) {
            self.due = Some(frame.seq.saturating_add(1));
            return Ok(());
        }
        if let Some(due) = self.due {
            let at_device = u64::from(frame.lost_before);
            let lost = frame.seq.saturating_sub(due).saturating_sub(at_device);
            self.totals.frames_lost_at_device += at_device;
            if lost > 0 {
                self.totals.frames_lost += lost;
                // The file of the frames after it tells of it.
                self.at = frame.received;
                let text = format!("{lost} frames before {} are lost: {KEPT_NO_LONGER}", frame.seq);
                let gap = pb::Gap {
                    frames_lost: lost,
                    after_seq: due.saturating_sub(1),
                    next_seq: frame.seq,
                    reason: KEPT_NO_LONGER.into(),
                };
                self.lost(lost, &text, Event::Gap(gap))?;
            }
        }
        self.write(frame)?;
        self.due = Some(frame.seq.saturating_add(1));
        self.totals.frames += 1;
        Ok(())
    }

    /// Says what is lost, here and in the file.
    fn lost(&mut self, messages: u64, text: &str, event: Event) -> Result<(), RecordError> {
        eprintln!("{}: {text}", self.rig);
        let at = self.at;
        let Some(open) = self.opened()? else { return Ok(()) };
        open.lost += messages;
        open.tell(at, event)
    }

    /// Writes what an earlier collection does not have.
    fn write_new<M: Timed>(&mut self, message: &M) -> Result<(), RecordError> {
        if self.earlier.has(message) { Ok(()) } else { self.write(message) }
    }

    fn write<M: Timed>(&mut self, message: &M) -> Result<(), RecordError> {
        self.at = message.at();
        let Some(open) = self.opened()? else { return Ok(()) };
        open.touched = Instant::now();
        open.recording.write(message)
    }

    /// The file that is open, or a new one; `None` before the rig is described.
    fn opened(&mut self) -> Result<Option<&mut Open>, RecordError> {
        if self.open.is_none()
            && let Some(described) = &self.described
        {
            let mut open = Open::create(&self.rig, &self.folder, &self.who, described)?;
            let Carried { info, stage, events } = &self.carried;
            if let Some(info) = info {
                open.recording.write_sensor_info(info, self.at)?;
            }
            if let Some(stage) = stage {
                open.recording.write(stage)?;
            }
            events.iter().try_for_each(|event| open.recording.write(event))?;
            self.open = Some(open);
        }
        Ok(self.open.as_mut())
    }
}

const KEPT_NO_LONGER: &str = "they did not arrive, and the rig's service keeps them no longer";

impl Carried {
    /// Keeps the events of the run in progress.
    fn event(&mut self, event: pb::RunEvent) {
        if self.events.first().is_some_and(|first| first.run_id != event.run_id) {
            self.events.clear();
        }
        if matches!(event.event, Some(Event::Finished(_))) {
            self.events.clear();
        } else if self.events.len() < EVENTS_MAX {
            self.events.push(event);
        }
    }
}

impl Open {
    fn create(rig: &str, folder: &PathBuf, who: &str, described: &Described) -> Result<Self, RecordError> {
        let error = |source| RecordError::Io { action: "make the folder", path: folder.clone(), source };
        fs::create_dir_all(folder).map_err(error)?;
        space::check_free(folder, &described.rig, None)?;
        let started = now();
        let id = format!("{}-{rig}", timestamp(started));
        let versions = BTreeMap::from([
            ("tactus".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("tactusd".to_owned(), described.version.clone()),
            ("schema".to_owned(), "tactus.v1".to_owned()),
        ]);
        // Another file of the same second has the name already.
        let free = file_names(&id)
            .map(|id| (folder.join(format!("{id}.mcap")), id))
            .find(|(path, _)| !path.exists());
        let (path, id) = free.unwrap_or_else(|| (folder.join(format!("{id}.mcap")), id));
        let header = Header {
            run_id: &id,
            experiment: "collect",
            who,
            rig: &described.rig,
            rig_toml: Some(&described.rig_toml),
            link_toml: None,
            script: SCRIPT,
            versions: &versions,
            parameters_json: "{}",
            started,
            simulated: described.simulated,
            continues: None,
        };
        let recording = Recording::create(path, &header)?;
        let now = Instant::now();
        Ok(Self { id, recording, began: now, touched: now, events: 0, lost: 0 })
    }

    /// Records an event of the collection itself.
    fn tell(&mut self, at: TimeStamp, event: Event) -> Result<(), RecordError> {
        let event = pb::RunEvent {
            seq: self.events,
            run_id: self.id.clone(),
            t_mono_ns: at.mono.ns(),
            t_wall_ns: at.wall.ns(),
            event: Some(event),
        };
        self.events += 1;
        self.recording.write(&event)
    }
}

/// Names of files that begin in one second. Whoever sorts the files by name, as `ls` does, has them in the order of time.
fn file_names(id: &str) -> impl Iterator<Item = String> {
    // `_` sorts behind the `.` of the first one, `-` before it.
    iter::once(id.to_owned()).chain((2..).map(move |nth: u32| format!("{id}_{nth}")))
}

fn now() -> WallTime {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    WallTime::from_ns(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

#[cfg(test)]
#[path = "files_tests.rs"]
mod tests;
