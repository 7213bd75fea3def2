//! The rehearsal of an experiment: what the rig would do, without the rig.
//!
//! The experiment's own script runs as in a dry run ([`crate::twin`]), on the rig's twin, in virtual time, but also with the drivers and the
//! device bytes of a run. The rehearsal keeps what a run would record. On an embedded rig a run with the same seed moves exactly so.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tactus_engine::{Record, RecordFailure, RunOrder, RunOutcome};
use tactus_record::{Message, RowsError, RunMetadata, Timeline, rows};
use tactus_schema::rig::ElementFault;
use tactus_schema::table::RowView;
use tactus_schema::{Frame, Rig, TimeStamp, WallTime, pb};
use tactus_virtual::twin_of;

use crate::twin::{self, Links, TwinError};

/// What the rig would do in an experiment.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    /// How the rehearsal ended. If it is not done, the rig cannot do the experiment either.
    pub outcome: RunOutcome,
    timeline: Timeline,
    frames: Vec<Frame>,
}

/// Rehearses an experiment on the rig's twin, whose elements have these faults. Blocks until it is computed, or until `stopped`,
/// which is asked every 20 ms, is true.
///
/// # Errors
/// [`TwinError`] if there was no rehearsal; also if the run would take longer than `longest`. A refused step is no error: it is in
/// the [`Rehearsal::outcome`].
pub fn rehearse(
    rig: &Rig,
    faults: BTreeMap<usize, ElementFault>,
    order: RunOrder,
    longest: Duration,
    stopped: &dyn Fn() -> bool,
) -> Result<Rehearsal, TwinError> {
    let run = RunMetadata {
        run_id: order.run_id.clone(),
        experiment: order.script.name().to_owned(),
        who: order.who.clone(),
        rig: rig.name.clone(),
        script: order.script.name().to_owned(),
        simulated: true,
        started: WallTime::default(),
        continues: None,
    };
    let mut twin = twin_of(rig);
    if let Some(simulation) = &mut twin.simulation {
        simulation.faults = faults;
    }
    let kept = Kept::default();
    let outcome = twin::run_on(twin, Links::Bytes, order, longest, Box::new(kept.clone()), &stopped)?;
    let messages = std::mem::take(&mut *kept.messages());
    let of_frame =
        |message: &Message| if let Message::Frame(frame) = message { Some(frame.clone()) } else { None };
    let frames = messages.iter().filter_map(of_frame).collect();
    Ok(Rehearsal { outcome, timeline: Timeline::of_messages(run, rig.clone(), messages), frames })
}

impl Rehearsal {
    /// Calls `take` for the rows that the run's recording would give, in order. Their counts are those of the twin.
    ///
    /// # Errors
    /// If the twin's stage never told its position.
    pub fn visit(&self, take: impl FnMut(RowView<'_>)) -> Result<(), RowsError> {
        rows::visit_frames(&self.timeline, &self.frames, take)
    }
}

/// Takes what a recording takes, and keeps it in memory.
#[derive(Debug, Clone, Default)]
struct Kept(Arc<Mutex<Vec<Message>>>);

impl Kept {
    fn messages(&self) -> MutexGuard<'_, Vec<Message>> {
        // A list that somebody panicked with is still a list.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Record for Kept {
    fn sensor_info(&mut self, info: &pb::SensorInfo, _: TimeStamp) -> Result<(), RecordFailure> {
        self.messages().push(Message::SensorInfo(info.clone()));
        Ok(())
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), RecordFailure> {
        self.messages().push(Message::Frame(frame.clone()));
        Ok(())
    }

    fn stage(&mut self, state: &pb::StageState) -> Result<(), RecordFailure> {
        self.messages().push(Message::Stage(*state));
        Ok(())
    }

    fn event(&mut self, event: &pb::RunEvent) -> Result<(), RecordFailure> {
        self.messages().push(Message::Event(Box::new(event.clone())));
        Ok(())
    }

    fn safety(&mut self, _: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        Ok(())
    }
}
