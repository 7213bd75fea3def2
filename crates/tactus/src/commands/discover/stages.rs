//! When each stage of a discovery began: from this the table of the time left is made (`tactus-bench evidence progress`).

use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::Context;
use serde_json::json;
use tactus_discover::Progress;

/// A file of JSON lines.
#[derive(Debug)]
pub(super) struct StageLog {
    file: Mutex<File>,
    started: Instant,
}

impl StageLog {
    pub(super) fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| path.display().to_string())?;
        Ok(Self { file: Mutex::new(file), started: Instant::now() })
    }

    pub(super) fn tell(&self, now: &Progress) {
        let line = json!({"stage": format!("{:?}", now.stage), "what": now.what, "elapsed_s": self.started.elapsed().as_secs_f64()});
        let _ = writeln!(self.file.lock().unwrap_or_else(PoisonError::into_inner), "{line}");
    }
    pub(super) fn note(&self, what: &str) {
        let line = json!({"stage": what, "what": what, "elapsed_s": self.started.elapsed().as_secs_f64()});
        let _ = writeln!(self.file.lock().unwrap_or_else(PoisonError::into_inner), "{line}");
    }
}
