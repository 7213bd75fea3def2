//! The content of the page.

use serde_json::{Value, json};
use tactus_schema::pb;

/// Latest state of a rig; each message replaces the previous one.
#[derive(Debug, Clone, Default)]
pub(crate) struct View {
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
}

impl View {
    /// JSON for the page's script. Lengths in mm, times in s; counts are row-major from the origin corner.
    pub(crate) fn json(&self) -> Value {
        json!({
            "problem": self.problem,
            "rig": self.rig,
            "simulated": self.health.as_ref().is_some_and(|health| health.simulated),
            "sensor": self.info.as_ref().map(|info| json!({ "rows": info.rows, "cols": info.cols })),
            "frame": self.frame.as_ref().map(|frame| json!({
                "seq": frame.seq,
                "t_s": frame.t_mono_ns as f64 * 1e-9,
                "counts": frame.counts,
                "bad_elements": frame.bad_elements,
            })),
            "missed": self.missed,
            "stage": self.stage.as_ref().map(|stage| json!({
                "status": stage.status().word(),
                "x_mm": stage.x_mm,
                "y_mm": stage.y_mm,
                "z_mm": stage.z_mm,
            })),
            "run": self.run.as_ref().map(|run| json!({
                "run_id": run.run_id,
                "experiment": run.experiment,
                "phase": run.phase().word(),
                "exit_status": run.exit_status().word(),
                "presses": run.presses,
                "presses_planned": run.presses_planned,
                "remaining_s": (run.remaining_s >= 0.0).then_some(run.remaining_s),
                "frames": run.frames,
                "frames_lost": run.frames_lost,
                "message": run.message,
                "recording": run.recording,
                "fault": run.fault,
            })),
            "safety": self.safety.as_ref().map(|event| json!({
                "verdict": event.verdict().word(),
                "rule": event.rule,
                "detail": event.detail,
            })),
            "health": self.health.as_ref().map(|health| json!({
                "version": health.version,
                "uptime_s": health.uptime_s,
                "sensor_connected": health.sensor_connected,
                "stage_connected": health.stage_connected,
                "frames_lost": health.frames_lost,
                "frame_rate_hz": health.frame_rate_hz,
            })),
        })
    }
}
