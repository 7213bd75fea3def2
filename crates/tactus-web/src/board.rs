//! What every page shows: the latest of each message, the zero in force, the last minutes and the log.

use serde::Serialize;
use serde_json::{Value, json};
use tactus_live::{History, Log, Order, TAKEN_FRAMES, Weight, Zero};
use tactus_schema::pb;

/// A frame that is older than the service's last sign of life by more is not the present: after a new connection the service tells its
/// last frames again.
const PRESENT_NS: i64 = 500_000_000;
/// A report of the stage that is later than a frame by more does not say where the tip was at the frame.
const TIP_NS: i64 = 100_000_000;

/// Latest state of a rig; each message replaces the previous one of its kind.
#[derive(Debug, Default)]
pub(crate) struct Board {
    /// Why there is no service; empty while connected.
    pub(crate) problem: String,
    pub(crate) rig: String,
    pub(crate) frame: Option<pb::Frame>,
    /// Frames lost on the bus or dropped here.
    pub(crate) missed: u64,
    pub(crate) info: Option<pb::SensorInfo>,
    pub(crate) stage: Option<pb::StageState>,
    pub(crate) run: Option<pb::RunState>,
    pub(crate) safety: Option<pb::SafetyEvent>,
    pub(crate) health: Option<pb::Health>,
    pub(crate) description: Option<pb::RigDescription>,
    pub(crate) zero: Zero,
    pub(crate) history: History,
    pub(crate) log: Log,
}

/// A frame as the page gets it. Lengths in mm, times in s; counts are row-major from the origin corner.
#[derive(Debug, Serialize)]
struct FrameView<'a> {
    seq: u64,
    t_s: f64,
    counts: &'a [f32],
    bad_elements: &'a [u32],
    lost_before: u32,
    missed: u64,
    tip_mm: Option<[f64; 3]>,
    temperature_c: Option<f32>,
}

impl Board {
    /// A connection to the rig's service begins. The log and the last minutes stay.
    pub(crate) fn connected(&mut self, rig: &str) {
        let Self { zero, history, log, .. } = std::mem::take(self);
        *self = Self { rig: rig.to_owned(), zero, history, log, ..Self::default() };
    }

    /// The connection has ended, or there is none: nothing that was known holds any more.
    pub(crate) fn disconnected(&mut self, problem: &str, now_wall_ns: i64) {
        let was_connected = self.problem.is_empty();
        let rig = self.rig.clone();
        self.connected(&rig);
        problem.clone_into(&mut self.problem);
        if was_connected && !rig.is_empty() {
            self.log.note(now_wall_ns, "service", Weight::Stop, problem);
        }
    }

    /// True if the frame is the present one, so that pages get it.
    pub(crate) fn on_frame(&mut self, frame: pb::Frame, missed: u64) -> bool {
        let is_past =
            self.health.as_ref().is_some_and(|health| is_later(health.t_mono_ns, &frame, PRESENT_NS));
        let stage = self.stage.as_ref().filter(|stage| !is_later(stage.t_mono_ns, &frame, TIP_NS));
        let order = self.history.push(&frame, stage);
        if order != Order::Again && self.zero.on_frame(&frame, order == Order::Restarted) {
            let text = "the sensor connected anew: the zero is void";
            self.log.note(frame.t_wall_ns, "sensor", Weight::Warning, text);
        }
        self.missed = missed;
        if order == Order::Again || is_past {
            return false;
        }
        self.frame = Some(frame);
        true
    }

    pub(crate) fn on_event(&mut self, event: &pb::RunEvent) {
        if self.log.on_event(event) {
            self.zero.on_event(event);
        }
    }

    pub(crate) fn on_safety(&mut self, event: pb::SafetyEvent) {
        self.log.on_safety(&event);
        self.safety = Some(event);
    }

    pub(crate) fn on_description(&mut self, description: pb::RigDescription) {
        self.zero.describe(&description);
        self.description = Some(description);
    }

    pub(crate) fn on_health(&mut self, health: pb::Health) {
        let before = self.health.as_ref();
        for (name, was, is) in [
            ("sensor", before.map(|before| before.sensor_connected), health.sensor_connected),
            ("stage", before.map(|before| before.stage_connected), health.stage_connected),
        ] {
            let (weight, text) =
                if is { (Weight::Note, "connected") } else { (Weight::Stop, "DISCONNECTED") };
            if was.is_some_and(|was| was != is) {
                self.log.note(health.t_wall_ns, name, weight, text);
            }
        }
        self.health = Some(health);
    }

    /// Makes the mean of the last half second the zero of all viewers.
    ///
    /// # Errors
    /// If a run is in progress, which has a zero of its own, if the tip may touch the covering, or if frames are missing.
    pub(crate) fn take_zero(&mut self) -> Result<(), String> {
        if self.is_running() {
            return Err("a run is in progress: its script takes the zero".into());
        }
        let is_up = |stage: &pb::StageState| stage.status() == pb::StageStatus::Idle && stage.z_mm > 0.0;
        let was_up = self.history.lowest_z_mm(TAKEN_FRAMES).is_some_and(|z_mm| z_mm > 0.0);
        if !was_up || !self.stage.as_ref().is_some_and(is_up) {
            return Err(
                "the tip was not above the covering for the last half second, or that is not known".into()
            );
        }
        let mean = self.history.mean(TAKEN_FRAMES);
        let (Some(counts), Some(frame)) = (mean, &self.frame) else {
            return Err("too few frames came without a gap: try again".into());
        };
        self.zero.take(counts, frame);
        self.log.note(frame.t_wall_ns, "zero", Weight::Note, "a new zero for all viewers was taken here");
        Ok(())
    }

    /// True if a run is in progress.
    pub(crate) fn is_running(&self) -> bool {
        self.run.as_ref().is_some_and(|run| match run.phase() {
            pb::RunPhase::Preparing
            | pb::RunPhase::Running
            | pb::RunPhase::Paused
            | pb::RunPhase::Stopping => true,
            pb::RunPhase::Unspecified | pb::RunPhase::Idle | pb::RunPhase::Finished => false,
        })
    }

    /// JSON of the latest frame.
    pub(crate) fn frame_json(&self) -> Option<String> {
        let frame = self.frame.as_ref()?;
        serde_json::to_string(&FrameView {
            seq: frame.seq,
            t_s: frame.t_mono_ns as f64 * 1e-9,
            counts: &frame.counts,
            bad_elements: &frame.bad_elements,
            lost_before: frame.lost_before,
            missed: self.missed,
            tip_mm: self
                .stage
                .as_ref()
                .filter(|stage| !is_later(stage.t_mono_ns, frame, TIP_NS))
                .map(|stage| [stage.x_mm, stage.y_mm, stage.z_mm]),
            temperature_c: frame.temperature_c,
        })
        .ok()
    }

    /// JSON of what seldom changes: the rig and the zero.
    pub(crate) fn rig_json(&self) -> Value {
        json!({
            "sensor": self.info.as_ref().map(|info| json!({
                "rows": info.rows,
                "cols": info.cols,
                "array": info.array,
                "rate_hz": info.rate_hz,
            })),
            "zero": self.zero.json(),
            "description": self.description.as_ref().map(|rig| json!({
                "col_centres_mm": rig.col_centres_mm,
                "row_centres_mm": rig.row_centres_mm,
                "element_mm": rig.element_mm,
                "origin_mm": rig.origin_mm,
                "rotation_deg": rig.rotation_deg,
                "baseline_counts": rig.baseline_counts,
                "baseline_band_counts": rig.baseline_band_counts,
                "covering_mm": rig.covering_mm,
                "indenter": rig.indenter,
                "indenter_shape": rig.indenter_shape,
                "indenter_width_mm": rig.indenter_width_mm,
                "x_mm": rig.x_mm,
                "y_mm": rig.y_mm,
                "z_max_mm": rig.z_max_mm,
                "depth_max_mm": rig.depth_max_mm,
                "element_max_counts": rig.element_max_counts,
                "sum_max_counts": rig.sum_max_counts,
                "safe_height_mm": rig.safe_height_mm,
                "approach_height_mm": rig.approach_height_mm,
                "unwatched_elements": rig.unwatched_elements,
            })),
        })
    }

    /// JSON of everything else but frames and log.
    pub(crate) fn view_json(&self) -> Value {
        json!({
            "problem": self.problem,
            "rig": self.rig,
            "simulated": self.health.as_ref().is_some_and(|health| health.simulated),
            "stage": self.stage.as_ref().map(|stage| json!({
                "status": stage.status().word(),
                "x_mm": stage.x_mm,
                "y_mm": stage.y_mm,
                "z_mm": stage.z_mm,
            })),
            "run": self.run.as_ref().map(|run| json!({
                "run_id": run.run_id,
                "experiment": run.experiment,
                "who": self.log.who(&run.run_id),
                "phase": run.phase().word(),
                "is_running": self.is_running(),
                "exit_status": run.exit_status().word(),
                "presses": run.presses,
                "presses_planned": run.presses_planned,
                "remaining_s": (run.remaining_s >= 0.0).then_some(run.remaining_s),
                "elapsed_s": run.elapsed_s,
                "frames": run.frames,
                "frames_lost": run.frames_lost,
                "message": run.message,
                "recording": run.recording,
                "fault": run.fault,
            })),
            "safety": self.safety.as_ref().map(|event| self.safety_json(event)),
            "health": self.health.as_ref().map(|health| json!({
                "version": health.version,
                "uptime_s": health.uptime_s,
                "sensor_connected": health.sensor_connected,
                "stage_connected": health.stage_connected,
                "frames_lost": health.frames_lost,
                "frames_dropped_on_bus": health.frames_dropped_on_bus,
                "frame_rate_hz": health.frame_rate_hz,
                "lease_holder": health.lease_holder,
            })),
        })
    }

    /// Safety news is past once its run is over and nothing of it holds the rig.
    fn safety_json(&self, event: &pb::SafetyEvent) -> Value {
        let run_id = self.log.run_at(event.t_wall_ns);
        let run = self.run.as_ref();
        let is_of_this_run = self.is_running() && run.is_some_and(|run| run.run_id == run_id);
        let holds = run.is_some_and(|run| !run.fault.is_empty());
        json!({
            "verdict": event.verdict().word(),
            "rule": event.rule,
            "detail": event.detail,
            "run_id": run_id,
            "t_wall_ms": event.t_wall_ns / 1_000_000,
            "is_past": !(is_of_this_run || holds),
        })
    }
}

/// True if a time of the service is later than a frame by more than this.
fn is_later(t_mono_ns: i64, frame: &pb::Frame, by_ns: i64) -> bool {
    frame.t_mono_ns.saturating_add(by_ns) < t_mono_ns
}

#[cfg(test)]
#[path = "board_tests.rs"]
mod tests;
