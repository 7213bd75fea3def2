//! Progress bars for runs and for computations.

mod discovery;

use std::fmt;
use std::io::{self, Write as _};
use std::mem;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, LazyLock, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use indicatif::{
    MultiProgress, ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle,
};
use tactus_record::meter;
use tactus_runner::twin::{Attend, SoFar};
use tactus_schema::pb::{RunPhase, RunState};

use crate::output::duration;
pub(crate) use discovery::DiscoveryProgress;

/// The bars of all runs that this process makes now, one below the other.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

/// Has something printed while runs may be in progress.
pub(crate) fn beside_runs(print: impl FnOnce()) {
    BARS.suspend(print);
}

/// Progress bar of a run on standard error, after that of its dry run: presses, frames, losses, time left. Hidden with `--json` and without a
/// terminal.
///
/// A thread of its own draws, because a terminal may be held (Ctrl-S): whoever shows or says something never waits.
#[derive(Debug)]
pub(crate) struct RunProgress {
    next: Arc<Next>,
    /// Ends with the drawing thread.
    drawing: Mutex<Receiver<()>>,
}

/// What is to be drawn next.
#[derive(Debug, Default)]
struct Next {
    order: Mutex<DrawingOrder>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct DrawingOrder {
    /// The latest state only.
    state: Option<RunState>,
    /// How far a dry run is.
    rehearsed: Option<SoFar>,
    /// At most [`LINES_MAX`]; more are dropped.
    lines: Vec<String>,
    is_over: bool,
}

/// Lines that wait for a terminal.
const LINES_MAX: usize = 16;

/// Resolution of a bar that shows a share.
const STEPS: u64 = 1000;

/// So that the time goes on without news.
const TICK: Duration = Duration::from_secs(1);

/// Longest wait for a terminal at the end of a run.
const LAST_DRAWING: Duration = Duration::from_millis(200);

impl RunProgress {
    /// `title` stands before the bar.
    pub(crate) fn new(silent: bool, title: &str) -> Self {
        let next = Arc::<Next>::default();
        let (ended, drawing) = channel();
        let to_draw = Arc::clone(&next);
        let title = title.to_owned();
        // Without a thread nothing is drawn, but the run goes on.
        let _spawned = thread::Builder::new().name("progress".into()).spawn(move || {
            draw(&to_draw, silent, title);
            drop(ended);
        });
        Self { next, drawing: Mutex::new(drawing) }
    }

    /// Shows the state of the run.
    pub(crate) fn show(&self, state: &RunState) {
        self.next.change(|order| order.state = Some(state.clone()));
    }

    /// Shows how far the dry run is.
    pub(crate) fn rehearse(&self, so_far: SoFar) {
        self.next.change(|order| order.rehearsed = Some(so_far));
    }

    /// Prints a line above the bar.
    pub(crate) fn say(&self, line: &str) {
        self.next.change(|order| {
            if order.lines.len() < LINES_MAX {
                order.lines.push(line.to_owned());
            }
        });
    }

    /// Removes the bar.
    pub(crate) fn clear(&self) {
        self.next.change(|order| order.is_over = true);
        let drawing = self.drawing.lock().unwrap_or_else(PoisonError::into_inner);
        // Either the thread ends, or the terminal is held and keeps the bar.
        let _ended = drawing.recv_timeout(LAST_DRAWING);
    }
}

/// An error may end what is in progress.
impl Drop for RunProgress {
    fn drop(&mut self) {
        self.clear();
    }
}

impl Attend for RunProgress {
    fn stops(&self) -> bool {
        false
    }

    fn sees(&self, so_far: SoFar) {
        self.rehearse(so_far);
    }
}

impl Next {
    fn change(&self, change: impl FnOnce(&mut DrawingOrder)) {
        change(&mut self.order.lock().unwrap_or_else(PoisonError::into_inner));
        self.changed.notify_one();
    }

    /// Waits for something to draw.
    fn take(&self) -> DrawingOrder {
        let order = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        let is_empty = |order: &mut DrawingOrder| {
            order.state.is_none() && order.rehearsed.is_none() && order.lines.is_empty() && !order.is_over
        };
        mem::take(&mut *self.changed.wait_while(order, is_empty).unwrap_or_else(PoisonError::into_inner))
    }
}

/// Where progress is drawn, if anybody wants to see it.
fn target(silent: bool) -> ProgressDrawTarget {
    if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// In a template, `{left}` is the time left if the rest takes as long as its share: empty while that says nothing yet.
fn styled(bar: &ProgressBar, template: &str) {
    let left = |state: &ProgressState, to: &mut dyn fmt::Write| {
        let (done, elapsed) = (f64::from(state.fraction()), state.elapsed());
        if elapsed >= TICK && done >= 0.01 {
            // Nothing can be done about a line that does not fit.
            let _full = write!(to, "{} left", duration(elapsed.as_secs_f64() * (1.0 - done) / done));
        }
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("left", left));
    }
}

/// Shows a share, 0 to 1, of a bar of [`STEPS`].
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to STEPS")]
fn set_share(bar: &ProgressBar, share: f64) {
    bar.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
}

/// Draws until the run is over.
fn draw(next: &Next, silent: bool, title: String) {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()).with_prefix(title);
    let bar = if silent { bar } else { BARS.add(bar) };
    styled(&bar, "{prefix}dry run  {elapsed:>4}  {msg}");
    let mut is_rehearsing = true;
    loop {
        let DrawingOrder { state, rehearsed, lines, is_over } = next.take();
        for line in lines {
            // A terminal that is gone shows nothing.
            let _gone = bar.suspend(|| writeln!(io::stderr(), "{line}"));
        }
        if is_over {
            return bar.finish_and_clear();
        }
        if let Some(SoFar { presses, share }) = rehearsed.filter(|_| is_rehearsing) {
            // The time goes on without news.
            bar.enable_steady_tick(TICK);
            bar.set_message(if presses > 0 { format!("{presses} presses so far") } else { String::new() });
            if let Some(share) = share {
                if bar.length().is_none() {
                    bar.set_length(STEPS);
                    styled(&bar, "{prefix}dry run  {bar:30.cyan/dim} {percent:>3} %  {left}");
                }
                set_share(&bar, share);
            }
        }
        if let Some(state) = state {
            if mem::take(&mut is_rehearsing) {
                bar.disable_steady_tick();
                styled(&bar, "{prefix}{bar:30.cyan/dim} {pos}/{len} presses  {msg}");
            }
            show(&bar, &state);
        }
    }
}

fn show(bar: &ProgressBar, state: &RunState) {
    let taken_over = state.taken_over.as_ref().map_or(0, |taken| u64::from(taken.presses));
    bar.set_length(taken_over + u64::from(state.presses_planned));
    bar.set_position(taken_over + u64::from(state.presses));
    let left = if state.remaining_s >= 0.0 {
        format!("  {} left", duration(state.remaining_s))
    } else {
        String::new()
    };
    let lost = if state.frames_lost > 0 { format!(", {} LOST", state.frames_lost) } else { String::new() };
    let frames = format!("{} frames{lost}", state.frames);
    bar.set_message(match state.phase() {
        RunPhase::Preparing => "preparing".into(),
        RunPhase::Paused => state.message.clone(),
        RunPhase::Stopping => format!("{frames}  retracting"),
        RunPhase::Running if !state.message.is_empty() => format!("{frames}  {}", state.message),
        RunPhase::Unspecified | RunPhase::Idle | RunPhase::Running | RunPhase::Finished => {
            format!("{frames}{left}")
        }
    });
}

/// Work of unknown length: what it is, and the time so far. Where a share is known, as while it reads files ([`Busy::reads`]), that and the time
/// left. Hidden where [`RunProgress`] is; ends with this, also when an error ends the work.
#[derive(Debug)]
pub(crate) struct Busy(ProgressBar);

impl Busy {
    pub(crate) fn with(what: &'static str, silent: bool) -> Self {
        let bar =
            ProgressBar::with_draw_target(Some(STEPS), target(silent)).with_finish(ProgressFinish::AndClear);
        let busy = Self(bar);
        busy.goes_on(what);
        busy.0.enable_steady_tick(TICK);
        busy
    }

    /// Does a job that reads files: see [`meter::will_read`].
    pub(crate) fn reads<T>(&self, job: impl FnOnce() -> T) -> T {
        let bar = self.0.clone();
        meter::metered(move |share| show_share(&bar, share), job)
    }

    /// Shows what share is done, 0 to 1, and how long the rest takes if it goes on so.
    pub(crate) fn shows(&self, share: f64) {
        show_share(&self.0, share);
    }

    /// As [`Busy::shows`], with the present step.
    pub(crate) fn shows_step(&self, what: &str, share: f64) {
        self.0.set_message(what.to_owned());
        self.shows(share);
    }

    /// Shows work that follows, with the time since the beginning.
    pub(crate) fn goes_on(&self, what: &'static str) {
        styled(&self.0, "{elapsed:>4}  {msg}");
        self.0.set_message(what);
    }
}

fn show_share(bar: &ProgressBar, share: f64) {
    // Only now, because not every job knows it.
    if bar.position() == 0 {
        styled(bar, "{bar:30.cyan/dim} {percent:>3} %  {left:<13}  {msg}");
    }
    set_share(bar, share);
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
