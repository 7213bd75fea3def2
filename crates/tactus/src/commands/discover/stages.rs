//! When each stage of a discovery began. `tactus-bench evidence progress` makes the table of the time left from it.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

use anyhow::Context;
use serde_json::json;
use tactus_discover::Progress;

/// Notes of when each stage began, as JSON lines. Time counts from the first one.
#[derive(Debug, Default)]
pub(super) struct StageLog {
    started: OnceLock<Instant>,
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
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let elapsed_s = self.started.get_or_init(Instant::now).elapsed().as_secs_f64();
        // Writing to a string cannot fail.
        let _written = writeln!(lines, "{}", json!({ "stage": stage, "what": what, "elapsed_s": elapsed_s }));
    }
}
