//! The progress bar of work on many files.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};

/// Bytes of files that are done and of all, the files done, and how long the rest takes at the speed so far. Hidden with `--json` and without a
/// terminal.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

/// How far the work is.
#[derive(Debug, Clone, Copy)]
pub struct Now {
    /// Files that are done.
    pub files: usize,
    /// All files.
    pub files_all: usize,
    /// Their bytes.
    pub bytes: u64,
    /// Bytes of all files.
    pub bytes_all: u64,
}

impl Progress {
    /// So that the time left goes on while a long file is read.
    const TICK: Duration = Duration::from_secs(1);

    pub(crate) fn new(silent: bool) -> Self {
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(0), target).with_finish(ProgressFinish::AndClear);
        if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/dim} {percent:>3} %  {msg}  {eta} left")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Self::TICK);
        Self { bar }
    }

    pub(crate) fn show(&self, now: Now) {
        self.bar.set_length(now.bytes_all);
        self.bar.set_position(now.bytes);
        self.bar.set_message(format!("{}/{} files", now.files, now.files_all));
    }

    /// Removes the bar.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
