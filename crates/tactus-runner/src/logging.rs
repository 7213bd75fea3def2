//! Structured logs, readable in a terminal, in the journal, or by machines.

use std::fmt;
use std::fs;
use std::io::{self, IsTerminal};
use std::os::unix::fs::MetadataExt;

use tracing::{Event, Level, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::{FmtSpan, Writer};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

use crate::config::LogFormat;

/// Logs to standard error from here on. `RUST_LOG` has precedence over `filter`.
///
/// Under journald, which adds times itself, lines have neither times nor colours, and a line's level is the entry's
/// priority: `journalctl -p warning` shows warnings and errors.
pub fn start(format: LogFormat, filter: &str) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(filter));
    let lines = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_span_events(FmtSpan::NONE)
        .with_ansi(io::stderr().is_terminal());
    // A second start, as in tests, changes nothing.
    let _started = match (format, is_journal()) {
        (LogFormat::Json, true) => lines.json().flatten_event(true).map_event_format(Ranked).try_init(),
        (LogFormat::Json, false) => lines.json().flatten_event(true).try_init(),
        (LogFormat::Text, true) => lines.without_time().map_event_format(Ranked).try_init(),
        (LogFormat::Text, false) => lines.try_init(),
    };
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
#[path = "logging_tests.rs"]
mod tests;
