//! A run that goes on with an earlier one: the script's first steps are answered from the earlier run's record.

use std::sync::Arc;

use serde_json::Value;
use tactus_model::Covering;
use tactus_plan::{Call, Reply, Step};
use tactus_schema::pb;

use super::steps::{describe, to_json};
use super::{Broken, Run};
use crate::engine::SAME_COVERING_MM;

/// Numbers of two steps that differ by less are the same: a recorded parameter may be read back with another last digit.
const SAME_NUMBER: f64 = 1e-9;

/// The steps of an earlier run that were done, for a run that goes on with it.
#[derive(Debug, Clone, PartialEq)]
pub struct EarlierRun {
    /// Its id.
    pub run_id: String,
    /// Thickness of the covering that was in place when its script began.
    pub covering_mm: f64,
    /// The script's first steps, in order.
    pub steps: Vec<DoneStep>,
    /// Index of the next press.
    pub next_press: i32,
}

/// A step that was done, with what the script was told.
#[derive(Debug, Clone, PartialEq)]
pub struct DoneStep {
    /// The step.
    pub step: Step,
    /// Where in the script, such as `corners.star:12`.
    pub at: String,
    /// What the script was told.
    pub reply: Reply,
}

/// The way of a run through the earlier run's steps.
pub(super) struct Replay {
    earlier: Arc<EarlierRun>,
    /// Number of steps that were answered.
    answered: usize,
    left: Left,
}

/// How the answered steps left the rig.
#[derive(Default)]
struct Left {
    /// The covering that the script asked for last.
    covering_mm: Option<f64>,
    /// Averaging time of the last tare.
    tare_s: Option<f64>,
    /// The move to the place of the tip.
    place: Option<Step>,
}

impl EarlierRun {
    /// In the form of messages.
    pub fn taken_over(&self) -> pb::TakenOver {
        let dwells = self.steps.iter().map(|step| match &step.reply {
            Reply::Pressed(readings) => Some(readings.len()),
            Reply::Done | Reply::Reading(_) | Reply::Position { .. } => None,
        });
        let dwells: Vec<usize> = dwells.flatten().collect();
        pb::TakenOver {
            run_id: self.run_id.clone(),
            steps: self.steps.len() as u64,
            presses: u32::try_from(dwells.len()).unwrap_or(u32::MAX),
            dwells: u32::try_from(dwells.iter().sum::<usize>()).unwrap_or(u32::MAX),
            first_press: self.next_press,
        }
    }
}

impl Replay {
    pub(super) fn of(earlier: Arc<EarlierRun>) -> Self {
        Self { earlier, answered: 0, left: Left::default() }
    }

    /// The earlier run's answer to a step; `None` after its last step. The error says how the step differs.
    fn answer(&mut self, call: &Call) -> Result<Option<Reply>, String> {
        let Some(done) = self.earlier.steps.get(self.answered) else { return Ok(None) };
        if !is_same(&done.step, &call.step) || call.at.to_string() != done.at {
            return Err(self.difference(done, call));
        }
        self.answered += 1;
        self.left.note(&call.step, self.earlier.covering_mm);
        Ok(Some(done.reply.clone()))
    }

    fn difference(&self, done: &DoneStep, call: &Call) -> String {
        let (mut asked, mut did) = (describe(&call.step), describe(&done.step));
        if asked == did {
            (asked, did) = (to_json(&call.step), to_json(&done.step));
        }
        let (step, run_id, was_at) = (self.answered, &self.earlier.run_id, &done.at);
        format!(
            "step {step} is not that of run {run_id}, whose script, parameters and seed it has: now `{asked}` at {}, then \
             `{did}` at {was_at}. The rig file or Tactus has changed since: restore it, or start the experiment anew",
            call.at
        )
    }

    /// An error if the script ended before the earlier run's last step.
    pub(super) fn check_over(&self) -> Result<(), String> {
        match self.earlier.steps.get(self.answered) {
            None => Ok(()),
            Some(next) => Err(format!(
                "the script ended after {} steps, and run {}, whose script, parameters and seed it has, went on with `{}` at \
                 {}. The rig file or Tactus has changed since: restore it, or start the experiment anew",
                self.answered,
                self.earlier.run_id,
                describe(&next.step),
                next.at
            )),
        }
    }
}

impl Left {
    fn note(&mut self, step: &Step, covering_mm: f64) {
        match step {
            Step::Covering { thickness_mm } => {
                let before_mm = self.covering_mm.replace(*thickness_mm).unwrap_or(covering_mm);
                // The tip goes up for a change.
                if let Some(Step::Move { height_mm, .. }) = &mut self.place
                    && (thickness_mm - before_mm).abs() > SAME_COVERING_MM
                {
                    *height_mm = None;
                }
            }
            Step::Tare { duration_s } => self.tare_s = Some(*duration_s),
            Step::Move { .. } => self.place = Some(step.clone()),
            // It ends at the safe height.
            Step::Press(press) => {
                self.place = Some(Step::Move { to: press.at, height_mm: None, speed_mm_per_s: None });
            }
            Step::Dwell { .. } | Step::Read { .. } | Step::Wait { .. } | Step::Log { .. } => {}
        }
    }
}

impl Run {
    /// The earlier run's answer to a step, without any motion. `None` if the step is to be done, by a rig that is then as the
    /// earlier run left it.
    pub(super) async fn taken_over(&mut self, call: &Call) -> Result<Option<Reply>, Broken> {
        let Some(replay) = &mut self.replay else { return Ok(None) };
        match replay.answer(call) {
            Ok(Some(reply)) => {
                self.steps += 1;
                return Ok(Some(reply));
            }
            Ok(None) => {}
            Err(difference) => self.refused("continue", difference).await?,
        }
        if let Some(replay) = self.replay.take() {
            self.restore(&replay, &call.step).await?;
        }
        Ok(None)
    }

    /// Brings the rig into the state in which the earlier run left it, before the first step that is done again. What the
    /// sensor reads without a load may have changed meanwhile: the zero is taken anew.
    async fn restore(&mut self, Replay { earlier, left, .. }: &Replay, next: &Step) -> Result<(), Broken> {
        // The next covering needs no other before it.
        if !matches!(next, Step::Covering { .. }) {
            self.restore_covering(earlier, left.covering_mm).await?;
        }
        if let Some(duration_s) = left.tare_s {
            self.tare(duration_s).await?;
        }
        if let Some(place @ Step::Move { to, height_mm, speed_mm_per_s }) = &left.place {
            self.bounds.check(place)?;
            self.go_to(*to, *height_mm, *speed_mm_per_s).await?;
        }
        Ok(())
    }

    /// A covering that the script asked for is asked for again, as the script would. Another one than that of the rig is
    /// nothing that a run can change.
    async fn restore_covering(
        &mut self,
        earlier: &EarlierRun,
        asked_for_mm: Option<f64>,
    ) -> Result<(), Broken> {
        if let Some(thickness_mm) = asked_for_mm {
            return self.change_covering(thickness_mm).await.map(drop);
        }
        let Covering { thickness_mm } = *self.shared.covering.borrow();
        let EarlierRun { run_id, covering_mm, .. } = earlier;
        if (thickness_mm - covering_mm).abs() < SAME_COVERING_MM {
            return Ok(());
        }
        let message = format!(
            "run {run_id} was under the {covering_mm} mm covering, and the one in place is {thickness_mm} mm thick. Put the \
             {covering_mm} mm covering back (a script with `covering({covering_mm})` lets you confirm it), or start the \
             experiment anew"
        );
        self.refused("continue", message).await
    }
}

fn is_same(one: &Step, other: &Step) -> bool {
    match (serde_json::to_value(one), serde_json::to_value(other)) {
        (Ok(one), Ok(other)) => is_same_value(&one, &other),
        _ => false,
    }
}

fn is_same_value(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Number(one), Value::Number(other)) => {
            let numbers = one.as_f64().zip(other.as_f64());
            numbers.is_some_and(|(one, other)| (one - other).abs() < SAME_NUMBER)
        }
        (Value::Array(one), Value::Array(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(one, other)| is_same_value(one, other))
        }
        (Value::Object(one), Value::Object(other)) => {
            one.len() == other.len()
                && one.iter().all(|(key, one)| other.get(key).is_some_and(|other| is_same_value(one, other)))
        }
        _ => one == other,
    }
}
