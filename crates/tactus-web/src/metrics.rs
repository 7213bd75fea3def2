//! The state of the lab as Prometheus reads it: the text format, version 0.0.4.

use tactus_schema::pb;

use crate::board::Board;

/// Media type of the text.
pub(crate) const KIND: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Lines of metrics, all with the rig as their label.
struct Metrics {
    lines: Vec<String>,
    rig: String,
}

/// What the board knows. A metric that is not known is left out, so that nobody takes an old value for the present.
pub(crate) fn metrics(board: &Board) -> String {
    let mut metrics = Metrics { lines: Vec::new(), rig: label(&board.rig) };
    let is_connected = board.problem.is_empty();
    metrics.gauge(
        "tactus_service_connected",
        "1 while the dashboard hears the service",
        [flag(is_connected)],
    );
    metrics.counter(
        "tactus_dashboard_frames_missed",
        "frames lost between service and dashboard",
        board.missed,
    );
    if let Some(health) = &board.health {
        of_health(&mut metrics, health);
    }
    if let Some(run) = &board.run {
        let is_running = flag(board.is_running());
        metrics.gauge("tactus_run_in_progress", "1 while a run is in progress", [is_running]);
        metrics.gauge("tactus_run_presses", "presses done in the present or last run", [number(run.presses)]);
        metrics.gauge("tactus_run_presses_planned", "presses planned in it", [number(run.presses_planned)]);
        metrics.gauge("tactus_reset_needed", "1 if a fault wants a reset", [flag(!run.fault.is_empty())]);
    }
    if let Some(safety) = &board.safety {
        let verdicts = [
            ("clear", pb::SafetyVerdict::Clear),
            ("refused", pb::SafetyVerdict::Refused),
            ("stopped", pb::SafetyVerdict::Stopped),
        ];
        let values = verdicts.map(|(name, verdict)| {
            (format!("verdict=\"{name}\""), f64::from(u8::from(safety.verdict() == verdict)))
        });
        metrics.gauge("tactus_safety_verdict", "the supervisor's last verdict: 1 at its name", values);
    }
    if let Some(stage) = &board.stage {
        let axes = [("x", stage.x_mm), ("y", stage.y_mm), ("z", stage.z_mm)];
        let values = axes.map(|(axis, mm)| (format!("axis=\"{axis}\""), mm));
        metrics.gauge("tactus_tip_millimetres", "place of the tip in the robot's frame", values);
    }
    metrics.lines.join("\n") + "\n"
}

/// What live viewers missed.
#[cfg(feature = "foxglove")]
pub(crate) fn of_viewers(rig: &str, viewers: usize, missed: u64) -> String {
    let mut metrics = Metrics { lines: Vec::new(), rig: label(rig) };
    metrics.gauge("tactus_viewers", "viewers that are connected", [plain(viewers as f64)]);
    metrics.counter("tactus_viewer_messages_missed", "messages that slow viewers missed", missed);
    metrics.lines.join("\n") + "\n"
}

fn of_health(metrics: &mut Metrics, health: &pb::Health) {
    let info = format!("version=\"{}\",simulated=\"{}\"", label(&health.version), health.simulated);
    metrics.gauge("tactus_service_info", "the service's version", [(info, 1.0)]);
    metrics.gauge(
        "tactus_service_uptime_seconds",
        "time since the service started",
        [plain(health.uptime_s)],
    );
    metrics.gauge(
        "tactus_sensor_connected",
        "1 while the sensor is connected",
        [flag(health.sensor_connected)],
    );
    metrics.gauge("tactus_stage_connected", "1 while the stage is connected", [flag(health.stage_connected)]);
    metrics.counter("tactus_frames", "frames received since the service started", health.frames);
    metrics.counter(
        "tactus_frames_lost",
        "frames that the sensor took and that never arrived",
        health.frames_lost,
    );
    metrics.counter(
        "tactus_frames_dropped_on_bus",
        "frames dropped for slow subscribers",
        health.frames_dropped_on_bus,
    );
    metrics.gauge("tactus_frame_rate_hertz", "frames per second", [plain(health.frame_rate_hz)]);
    metrics.gauge(
        "tactus_lease_held",
        "1 while a client holds the lease",
        [flag(!health.lease_holder.is_empty())],
    );
    for (name, about, value) in [
        ("tactus_clock_offset_seconds", "the device's clock against the host's", health.clock_offset_s),
        ("tactus_clock_uncertainty_seconds", "uncertainty of that", health.clock_uncertainty_s),
    ] {
        if let Some(value) = value {
            metrics.gauge(name, about, [plain(value)]);
        }
    }
}

impl Metrics {
    fn gauge(&mut self, name: &str, about: &str, values: impl IntoIterator<Item = (String, f64)>) {
        self.head(name, "gauge", about);
        for (labels, value) in values {
            let comma = if labels.is_empty() { "" } else { "," };
            self.lines.push(format!("{name}{{rig=\"{}\"{comma}{labels}}} {value}", self.rig));
        }
    }

    fn counter(&mut self, name: &str, about: &str, value: u64) {
        let name = format!("{name}_total");
        self.head(&name, "counter", about);
        self.lines.push(format!("{name}{{rig=\"{}\"}} {value}", self.rig));
    }

    fn head(&mut self, name: &str, kind: &str, about: &str) {
        self.lines.push(format!("# HELP {name} {about}\n# TYPE {name} {kind}"));
    }
}

fn plain(value: f64) -> (String, f64) {
    (String::new(), value)
}

fn flag(is: bool) -> (String, f64) {
    plain(f64::from(u8::from(is)))
}

fn number(value: u32) -> (String, f64) {
    plain(f64::from(value))
}

/// The value of a label between its quotes.
fn label(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
#[path = "metrics_tests.rs"]
mod tests;
