//! When each stage of a discovery began. `tactus-bench evidence progress` makes the table of the time left from it.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};

use anyhow::Context;
use serde_json::json;
use tactus_discover::Progress;

/// Notes of when each stage began, as JSON lines. Time counts from the first one. It is that of the processor, which other programs hardly
/// change: on one thread the same as on a clock.
#[derive(Debug, Default)]
pub(super) struct StageLog {
    started_s: OnceLock<f64>,
    lines: Mutex<String>,
}

impl StageLog {
    /// Notes an activity.
    pub(super) fn note(&self, now: &Progress) {
        self.line(now.stage.name(), &now.what);
    }

    /// Notes the end and writes the file.
    pub(super) fn finish(self, path: &Path) -> anyhow::Result<()> {
        self.line("end", "");
        let lines = self.lines.into_inner().unwrap_or_else(PoisonError::into_inner);
        fs::write(path, lines).with_context(|| path.display().to_string())
    }

    fn line(&self, stage: &str, what: &str) {
        let Some(now_s) = processor_s() else { return };
        let elapsed_s = now_s - self.started_s.get_or_init(|| now_s);
        let line = json!({ "stage": stage, "what": what, "elapsed_s": elapsed_s });
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        // Writing to a string cannot fail.
        let _written = writeln!(lines, "{line}");
    }
}

/// The processor's time of this program and of those that it started and that have ended: in user mode and in the kernel's, in hundredths of a
/// second (proc(5), `USER_HZ`).
fn processor_s() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in brackets, may have spaces.
    let (_, after_name) = stat.rsplit_once(')')?;
    let hundredths = after_name.split_whitespace().skip(11).take(4).map(str::parse::<f64>);
    Some(hundredths.sum::<Result<f64, _>>().ok()? / 100.0)
}
