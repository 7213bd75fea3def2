//! Progress bars for runs and for computations.

use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use tactus_schema::pb::{RunPhase, RunState};

use crate::output::duration;

/// Progress bar of a run on standard error: presses, frames, losses, time left. Hidden with `--json` and without a
/// terminal.
#[derive(Debug)]
pub(crate) struct RunProgress(ProgressBar);

impl RunProgress {
    pub(crate) fn new(silent: bool) -> Self {
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/dim} {pos}/{len} presses  {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Shows the state of the run.
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

    /// Removes the bar.
    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }

    /// Prints a line above the bar.
    pub(crate) fn say(&self, line: &str) {
        self.0.suspend(|| eprintln!("{line}"));
    }
}

/// Progress bar of a computation: share done, current step, time left. Hidden where [`RunProgress`] is.
#[derive(Debug)]
pub(crate) struct ComputationProgress {
    bar: ProgressBar,
    start: Instant,
}

impl ComputationProgress {
    /// Resolution of the bar.
    const STEPS: u64 = 1000;
    /// Below this share the time left is not shown: it would be a guess.
    const SHARE_MIN: f64 = 0.02;

    pub(crate) fn new(silent: bool) -> Self {
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        // Cleared, too, when an error ends the computation.
        let bar =
            ProgressBar::with_draw_target(Some(Self::STEPS), target).with_finish(ProgressFinish::AndClear);
        if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/dim} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        Self { bar, start: Instant::now() }
    }

    /// Shows the current step and the share done, 0 to 1.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to STEPS")]
    pub(crate) fn show(&self, what: &str, share: f64) {
        let share = share.clamp(0.0, 1.0);
        let left = if (Self::SHARE_MIN..1.0).contains(&share) {
            let left_s = self.start.elapsed().as_secs_f64() * (1.0 - share) / share;
            format!("  {} left", duration(left_s))
        } else {
            String::new()
        };
        self.bar.set_position((share * Self::STEPS as f64) as u64);
        self.bar.set_message(format!("{what}{left}"));
    }

    /// Removes the bar.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
