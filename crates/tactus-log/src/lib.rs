//! Structured logs on standard error, readable in a terminal, in the journal, or by machines.
//!
//! Nothing that logs ever waits for a reader. A terminal that is held (Ctrl-S) or a pipe that nobody reads stops one thread
//! only, which has no other work: see [`Lines`].

mod lines;

use std::backtrace::{Backtrace, BacktraceStatus};
use std::fmt;
use std::fs::{self, File};
use std::io::{self, IsTerminal};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::panic;
use std::time::Duration;

use serde::Deserialize;
use tracing::{Event, Level, Subscriber, error, warn};
use tracing_subscriber::filter::{EnvFilter, filter_fn};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::{Layer, SubscriberExt as _};
use tracing_subscriber::registry::{LookupSpan, Registry};
use tracing_subscriber::util::SubscriberInitExt as _;

pub use lines::{LINE_MAX_BYTES, Lines, QUEUE_MAX_BYTES};

/// Longest wait for the last lines at the end of the program.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(200);

/// The form of a log line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// One readable line per entry; without times under journald, which has its own.
    #[default]
    Text,
    /// One JSON object per entry.
    Json,
}

/// Something else that hears what is logged, and the spans.
pub type Listener = Box<dyn Layer<Registry> + Send + Sync>;

/// The log of a program. Dropping it waits for the last lines, at most 200 ms.
#[derive(Debug)]
#[must_use = "the last lines are lost if this is not kept until the program's end"]
pub struct Log(Option<Lines>);

impl Drop for Log {
    fn drop(&mut self) {
        if let Some(lines) = &self.0 {
            // If nobody reads, the last lines are lost: the program's end is more urgent.
            let _written = lines.flush(FLUSH_TIMEOUT);
        }
    }
}

/// Logs to standard error from here on, panics included. `RUST_LOG` has precedence over `filter`.
///
/// Under journald, which adds times itself, lines have neither times nor colours, and a line's level is the entry's
/// priority: `journalctl -p warning` shows warnings and errors.
pub fn start(format: LogFormat, filter: &str) -> Log {
    start_with(format, filter, None)
}

/// As [`start`], with a listener. Lines show in which spans of the level ERROR they are, such as the rig among several; of the others only the
/// listener knows.
pub fn start_with(format: LogFormat, filter: &str, listener: Option<Listener>) -> Log {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(filter));
    // Not through the standard library's handle: its lock would be held while a line waits for its reader.
    let opened = io::stderr().as_fd().try_clone_to_owned().map(File::from);
    let Ok(queue) = opened.and_then(|out| Lines::start(out, format, tell_dropped)) else {
        // Without a file or a thread there is no log; the program is more important.
        return Log(None);
    };
    let lines =
        tracing_subscriber::fmt::layer().with_writer(queue.clone()).with_ansi(io::stderr().is_terminal());
    let lines: Listener = match (format, is_journal()) {
        (LogFormat::Json, true) => lines.json().flatten_event(true).map_event_format(Ranked).boxed(),
        (LogFormat::Json, false) => lines.json().flatten_event(true).boxed(),
        (LogFormat::Text, true) => lines.without_time().map_event_format(Ranked).boxed(),
        (LogFormat::Text, false) => lines.boxed(),
    };
    let lines = lines
        .with_filter(filter_fn(|metadata| metadata.is_event() || *metadata.level() == Level::ERROR))
        .boxed();
    let listeners: Vec<Listener> = listener.into_iter().chain([lines]).collect();
    let started = tracing_subscriber::registry().with(listeners).with(filter).try_init();
    if started.is_err() {
        // A second start, as in tests, changes nothing.
        return Log(None);
    }
    // The standard hook writes to standard error itself, and so waits for its reader.
    panic::set_hook(Box::new(|panic| match Backtrace::capture() {
        trace if trace.status() == BacktraceStatus::Captured => error!("{panic}\n{trace}"),
        _ => error!("{panic}"),
    }));
    Log(Some(queue))
}

fn tell_dropped(lines: u64) {
    warn!("{lines} log lines were dropped: standard error was not read");
}

/// True if standard error is journald's stream. The variable alone is no proof: child processes inherit it.
fn is_journal() -> bool {
    let Ok(stream) = std::env::var("JOURNAL_STREAM") else { return false };
    fs::metadata("/proc/self/fd/2").is_ok_and(|there| stream == format!("{}:{}", there.dev(), there.ino()))
}

/// Puts the priority before a line, in the form of sd-daemon(3); journald removes it.
struct Ranked<F>(F);

impl<S, N, F> FormatEvent<S, N> for Ranked<F>
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
    F: FormatEvent<S, N>,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        write!(writer, "<{}>", priority(*event.metadata().level()))?;
        self.0.format_event(context, writer, event)
    }
}

/// The level as a number of syslog(3).
fn priority(level: Level) -> u8 {
    match level {
        Level::ERROR => 3,
        Level::WARN => 4,
        Level::INFO => 6,
        Level::DEBUG | Level::TRACE => 7,
    }
}

#[cfg(test)]
#[path = "lib_tests.rs"]
mod tests;
