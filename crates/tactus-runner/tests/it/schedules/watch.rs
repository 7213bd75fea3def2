//! The promises, held against the true tip at every frame and event.

use std::fmt;
use std::sync::{Mutex, MutexGuard};

use tactus_engine::{Publish, Record, RecordFailure, RunOutcome};
use tactus_schema::pb::{self, ExitStatus, run_event::Event};
use tactus_schema::rig::Service;
use tactus_schema::{Frame, Rig, TimeStamp};
use tactus_virtual::RigControl;

use super::tally::Tally;

/// Of a move, and the stage's step.
pub(super) const TOLERANCE_MM: f64 = 0.007;

/// How much farther a damaged command may carry the tip (docs/decisions/0020-a-damaged-byte.md): the way in the time
/// until a report shows it, at the greatest speed of a step down in these scripts.
const DAMAGE_MM: f64 = 0.31;

/// Near the covering the tip goes at most so far beyond what the last frame has shown: two steps.
const UNSEEN_MM: f64 = 0.2;

/// Below this height the tip goes in steps.
const NEAR_MM: f64 = 0.3;

/// A broken promise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Broken {
    /// Which one.
    pub(super) promise: &'static str,
    pub(super) what: String,
}

/// Promises that are stricter than the real ones, so that a test can see one broken.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Strictness {
    /// The tip must not be deeper.
    pub(super) depth_max_mm: Option<f64>,
    /// No run may end by this rule.
    pub(super) never: Option<&'static str>,
}

/// What the promises are held against.
pub(super) struct Witness {
    control: RigControl,
    rig: Rig,
    service: Service,
    /// What the faults may hide of the position.
    hidden_mm: f64,
    /// What a damaged command may cost.
    damage_mm: f64,
    strictness: Strictness,
    seen: Mutex<Seen>,
}

#[derive(Default)]
struct Seen {
    tally: Tally,
    events: Vec<String>,
    broken: Vec<Broken>,
    frames: u64,
    last_seq: Option<u64>,
    /// In any covering so far.
    deepest_mm: f64,
    /// The greatest depth that the steps below the tip at the last frame allow.
    allowed_mm: f64,
    /// Height of the tip when a frame showed a load that is too great.
    overloaded_at_mm: Option<f64>,
}

impl Witness {
    pub(super) fn new(
        control: RigControl,
        rig: Rig,
        faults: &tactus_virtual::schedule::Schedule,
        strictness: Strictness,
    ) -> Self {
        let may_be_damaged = faults.faults.iter().any(|(_, line)| line.starts_with("to-stage"));
        Self {
            control,
            service: rig.service.clone().unwrap(),
            rig,
            hidden_mm: faults.hidden_mm(),
            damage_mm: if may_be_damaged { DAMAGE_MM } else { 0.0 },
            strictness,
            seen: Mutex::default(),
        }
    }

    /// Adds a broken promise.
    pub(super) fn tell(&self, promise: &'static str, what: impl Into<String>) {
        self.seen().broken.push(Broken { promise, what: what.into() });
    }

    pub(super) fn count(&self, group: &'static str, name: impl Into<String>) {
        self.seen().tally.count(group, name);
    }

    /// What an outcome tells must be true.
    pub(super) fn check_outcome(&self, outcome: &RunOutcome, presses: u32, has_fault: bool) {
        self.count(
            "outcomes",
            outcome.exit_status.as_str_name().trim_start_matches("EXIT_STATUS_").to_lowercase(),
        );
        let is_done = outcome.exit_status == ExitStatus::Done;
        if is_done && (outcome.frames_lost > 0 || outcome.presses != presses) {
            self.tell("done", format!("{presses} presses were asked for: {outcome:?}"));
        }
        if outcome.message.contains("efect of Tactus") || outcome.message.contains("a panic while") {
            self.tell("defect", format!("{outcome:?}"));
        }
        let tip_mm = self.control.tip_mm();
        let safe_mm = self.service.motion.safe_height_mm - 2.0 * TOLERANCE_MM - self.hidden_mm;
        let is_told = outcome.message.contains("NOT RETRACTED") && has_fault;
        // A run that was refused before it began has moved nothing.
        let has_moved = outcome.travel_mm[2][0].is_finite();
        if is_told {
            self.count("outcomes", "not retracted");
        } else if has_moved && tip_mm[2] < safe_mm {
            self.tell("retract", format!("the tip is at {tip_mm:?} after {outcome:?}"));
        }
        // One may come between the count and the end of the recording.
        let recorded = self.seen().frames;
        if !(outcome.frames..=outcome.frames + 1).contains(&recorded) {
            self.tell("recording", format!("{recorded} frames are in the recording: {outcome:?}"));
        }
    }

    /// Holds the greatest depth ever in the covering in place against its limit.
    pub(super) fn check_depth(&self) {
        let mut covering = self.rig.covering;
        covering.thickness_mm = self.control.covering_mm();
        let covering_mm = self.service.envelope.depth_max_mm(covering) + TOLERANCE_MM;
        let limit_mm = covering_mm + self.hidden_mm + self.damage_mm;
        let limit_mm = self.strictness.depth_max_mm.unwrap_or(limit_mm);
        let deepest_mm = self.control.deepest_mm();
        if deepest_mm > limit_mm {
            self.tell(
                "depth",
                format!(
                    "the tip was {deepest_mm:.3} mm deep in {} mm; the limit is {limit_mm:.3} mm",
                    covering.thickness_mm
                ),
            );
        }
        let mut seen = self.seen();
        seen.deepest_mm = seen.deepest_mm.max(deepest_mm);
    }

    /// A person puts another covering in place.
    pub(super) fn put_in_place(&self, thickness_mm: f64) {
        self.check_depth();
        let was_mm = self.control.covering_mm();
        self.control.set_covering_mm(thickness_mm);
        let name = if thickness_mm < was_mm { "thinner covering" } else { "thicker covering" };
        self.count("operator", name);
    }

    /// A recording of a run.
    pub(super) fn recording(this: &std::sync::Arc<Self>) -> Box<dyn Record> {
        this.seen().frames = 0;
        Box::new(Recording(std::sync::Arc::clone(this)))
    }

    pub(super) fn what_was_seen(&self) -> (Vec<String>, Vec<Broken>, Tally) {
        let mut seen = std::mem::take(&mut *self.seen());
        seen.tally.count("schedules", "all");
        for (name, least_mm) in [("in contact", 0.0), ("deeper than 0.5 mm", 0.5), ("deeper than 1 mm", 1.0)]
        {
            if seen.deepest_mm > least_mm {
                seen.tally.count("schedules", name);
            }
        }
        (seen.events, seen.broken, seen.tally)
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap()
    }

    /// A dwell that is told is one: the tip stands, and where it was told.
    fn check_dwell(&self, dwell: &pb::DwellDone) {
        let [x_mm, y_mm] = self.rig.registration.to_robot([dwell.x_mm, dwell.y_mm]);
        let (tip_mm, told_mm) = (self.control.tip_mm(), [x_mm, y_mm, -dwell.depth_mm]);
        let away_mm = tip_mm.iter().zip(told_mm).map(|(tip, told)| (tip - told).powi(2)).sum::<f64>().sqrt();
        if away_mm > 2.0 * TOLERANCE_MM + self.hidden_mm || self.control.is_moving() {
            self.tell("dwell", format!("a dwell at {told_mm:?} is told, and the tip is at {tip_mm:?}"));
        }
    }

    /// The greatest rise above the rig's baseline that every zero allows, and that of the sum.
    fn is_overloaded(&self, frame: &Frame) -> bool {
        let envelope = &self.service.envelope;
        let (mut sum, mut is_over) = (0.0, false);
        for (counts, baseline) in frame.counts.iter().zip(&self.rig.baseline_counts) {
            let rise = f64::from(*counts) - baseline - envelope.baseline_band_counts;
            is_over |= rise > envelope.element_max_counts;
            sum += rise.max(0.0);
        }
        is_over || sum > envelope.sum_max_counts
    }
}

impl Publish for Witness {
    fn frame(&self, frame: &Frame) {
        let (deepest_mm, z_mm) = (self.control.deepest_mm(), self.control.tip_mm()[2]);
        let is_overloaded = self.is_overloaded(frame);
        let mut broken = Vec::new();
        let mut seen = self.seen();
        let expected = seen.last_seq.map(|seq| seq + u64::from(frame.lost_before) + 1);
        if expected.is_some_and(|seq| seq != frame.seq) {
            broken.push(("sequence", format!("{expected:?} was expected: {frame:?}")));
        }
        seen.last_seq = Some(frame.seq);
        if deepest_mm > seen.allowed_mm {
            let allowed_mm = seen.allowed_mm;
            broken.push((
                "unseen",
                format!("{deepest_mm:.3} mm deep without a frame; allowed: {allowed_mm:.3}"),
            ));
        }
        let slack_mm = UNSEEN_MM + 2.0 * TOLERANCE_MM + self.damage_mm;
        seen.allowed_mm = deepest_mm.max(slack_mm - z_mm.min(NEAR_MM));
        // It may be forgotten once the tip is up: whoever resets may press again.
        let at_mm = seen.overloaded_at_mm.filter(|_| z_mm < 1.0).or(is_overloaded.then_some(z_mm));
        seen.overloaded_at_mm = at_mm;
        if let Some(at_mm) = at_mm
            && z_mm < at_mm - 0.1 - TOLERANCE_MM - self.damage_mm
        {
            broken.push((
                "force",
                format!("the load was too great at {at_mm:.3} mm, and the tip is at {z_mm:.3} mm"),
            ));
        }
        if is_overloaded {
            seen.tally.count("frames", "overloaded");
        }
        if z_mm < 0.0 {
            seen.tally.count("frames", "in contact");
        }
        seen.tally.count("frames", "all");
        drop(seen);
        for (promise, what) in broken {
            self.tell(promise, what);
        }
    }

    fn frame_at_rest(&self, frame: &Frame) {
        if self.control.is_moving() {
            self.tell(
                "rest",
                format!("the stage moves at {:?}, and the frame may wait", self.control.tip_mm()),
            );
        }
        self.count("frames", "at rest");
        self.frame(frame);
    }

    fn event(&self, event: &pb::RunEvent) {
        if let Some(Event::DwellDone(dwell)) = &event.event {
            self.check_dwell(dwell);
            self.count("outcomes", "dwells");
        }
        self.seen().events.push(format!("{} {:?}", event.t_mono_ns, event.event));
    }

    fn safety(&self, event: &pb::SafetyEvent) {
        let verdict = event.verdict().as_str_name().trim_start_matches("SAFETY_VERDICT_").to_lowercase();
        self.count("rules", format!("{verdict} {}", event.rule));
        self.seen().events.push(format!("{} {} {}", event.t_mono_ns, event.rule, event.detail));
        if self.strictness.never == Some(event.rule.as_str()) {
            self.tell("never", event.detail.clone());
        }
    }

    fn sensor_info(&self, _: &pb::SensorInfo) {}

    fn stage(&self, _: &pb::StageState) {}

    fn state(&self, _: &pb::RunState) {}
}

/// Counts what a recording must hold.
struct Recording(std::sync::Arc<Witness>);

impl Record for Recording {
    fn sensor_info(&mut self, _: &pb::SensorInfo, _: TimeStamp) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn frame(&mut self, _: &Frame) -> Result<(), RecordFailure> {
        self.0.seen().frames += 1;
        Ok(())
    }

    fn stage(&mut self, _: &pb::StageState) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn event(&mut self, _: &pb::RunEvent) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn safety(&mut self, _: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        Ok(())
    }
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.promise, self.what)
    }
}
