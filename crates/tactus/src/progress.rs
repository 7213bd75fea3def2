//! The progress of a run on the terminal: presses done, frames, losses, time left.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tactus_schema::pb::{RunPhase, RunState};

use crate::output::duration;

/// A progress bar on standard error; silent where that is no terminal or a machine reads.
#[derive(Debug)]
pub(crate) struct Progress(ProgressBar);

impl Progress {
    pub(crate) fn new(silent: bool) -> Self {
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/dim} {pos}/{len} presses  {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Shows where the run stands.
    pub(crate) fn show(&self, state: &RunState) {
        self.0.set_length(state.presses_planned.into());
        self.0.set_position(state.presses.into());
        let left = if state.remaining_s >= 0.0 {
            format!("  {} left", duration(state.remaining_s))
        } else {
            String::new()
        };
        let lost =
            if state.frames_lost > 0 { format!(", {} LOST", state.frames_lost) } else { String::new() };
        let frames = format!("{} frames{lost}", state.frames);
        self.0.set_message(match state.phase() {
            RunPhase::Preparing => "preparing".into(),
            RunPhase::Paused => state.message.clone(),
            RunPhase::Stopping => format!("{frames}  retracting"),
            RunPhase::Unspecified | RunPhase::Idle | RunPhase::Running | RunPhase::Finished => {
                format!("{frames}{left}")
            }
        });
    }

    /// Takes the bar away, to make room for the summary.
    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }

    /// Says something above the bar.
    pub(crate) fn say(&self, line: &str) {
        self.0.suspend(|| eprintln!("{line}"));
    }
}
