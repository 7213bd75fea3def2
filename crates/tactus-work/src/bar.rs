//! The progress bar.

use std::{
    fmt,
    sync::{Arc, OnceLock},
    time::{Duration, Instant},
};

use indicatif::{
    HumanDuration, ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle,
};

/// How far work is, with what other workers have done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Now {
    /// Pieces that are done.
    pub pieces: usize,
    /// All pieces.
    pub pieces_all: usize,
    /// Size of those that are done, in any unit.
    pub size: u64,
    /// Size of all pieces.
    pub size_all: u64,
}

/// A bar on standard error, by the size of pieces: the share that is done, the pieces done, and how long the rest takes at the speed since the
/// bar began. Hidden without a terminal.
#[derive(Debug)]
pub struct Bar {
    drawn: ProgressBar,
    /// What the pieces are.
    pieces: &'static str,
    begin: Arc<OnceLock<Begin>>,
}

/// When the bar began, and with how much.
#[derive(Debug, Clone, Copy)]
struct Begin {
    at: Instant,
    size: u64,
}

impl Bar {
    /// So that the time left goes on while a long piece is done.
    const TICK: Duration = Duration::from_secs(1);

    /// For pieces of this name, such as `files`.
    pub fn new(pieces: &'static str, silent: bool) -> Self {
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let drawn = ProgressBar::with_draw_target(Some(0), target).with_finish(ProgressFinish::AndClear);
        let begin = Arc::<OnceLock<Begin>>::default();
        let of_style = Arc::clone(&begin);
        let left = move |state: &ProgressState, text: &mut dyn fmt::Write| {
            let begin = of_style.get();
            if let Some(left) =
                begin.and_then(|begin| begin.left(state.pos(), state.len().unwrap_or_default()))
            {
                // Without it the bar is still true.
                let _shown = write!(text, "  {} left", HumanDuration(left));
            }
        };
        if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/dim} {percent:>3} %  {msg}{left}") {
            drawn.set_style(style.with_key("left", left));
        }
        drawn.enable_steady_tick(Self::TICK);
        Self { drawn, pieces, begin }
    }

    /// True if nobody sees it.
    pub fn is_hidden(&self) -> bool {
        self.drawn.is_hidden()
    }

    /// Shows progress. What is done the first time was done before, and tells nothing of the speed.
    pub fn show(&self, now: Now) {
        self.begin.get_or_init(|| Begin { at: Instant::now(), size: now.size });
        self.drawn.set_length(now.size_all);
        self.drawn.set_position(now.size);
        self.drawn.set_message(format!("{}/{} {}", now.pieces, now.pieces_all, self.pieces));
    }

    /// The time left at the speed since the bar began; `None` until something is done.
    pub fn left(&self, now: Now) -> Option<Duration> {
        self.begin.get()?.left(now.size, now.size_all)
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.drawn.finish_and_clear();
    }
}

impl Begin {
    fn left(&self, size: u64, size_all: u64) -> Option<Duration> {
        let done = size.checked_sub(self.size).filter(|done| *done > 0)?;
        let left = size_all.saturating_sub(size) as f64 / done as f64;
        Duration::try_from_secs_f64(self.at.elapsed().as_secs_f64() * left).ok()
    }
}
