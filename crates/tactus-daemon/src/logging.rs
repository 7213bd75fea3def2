//! Structured logs, readable in a terminal, in the journal, or by machines.

use std::io::{self, IsTerminal};

use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::FmtSpan;

use crate::config::LogFormat;

/// Logs to standard error from here on. `RUST_LOG` has precedence over `filter`.
///
/// Under journald, which stamps and stores each line itself, times and colours are left out.
pub fn start(format: LogFormat, filter: &str) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(filter));
    let lines = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_span_events(FmtSpan::NONE)
        .with_ansi(io::stderr().is_terminal());
    let journald = std::env::var_os("JOURNAL_STREAM").is_some();
    // A second start, as in tests, changes nothing.
    let _started = match format {
        LogFormat::Json => lines.json().flatten_event(true).try_init(),
        LogFormat::Text if journald => lines.without_time().try_init(),
        LogFormat::Text => lines.try_init(),
    };
}
