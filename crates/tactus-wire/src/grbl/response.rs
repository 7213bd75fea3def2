//! A line from the controller.

use super::StatusReport;
use super::status::triple;

/// A line from the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// `ok`: the line was accepted. Its motion may still follow.
    Ok,
    /// `error:n`: the line was refused; see [`error_meaning`](super::error_meaning).
    Error(u8),
    /// `ALARM:n`; see [`alarm_meaning`](super::alarm_meaning).
    Alarm(u8),
    /// `Grbl 1.1h ['$' for help]`: the controller has started or was reset.
    Banner(String),
    /// `<...>`: a status report.
    Status(StatusReport),
    /// `[MSG:...]`: a message for people.
    Message(String),
    /// `[PRB:x,y,z:1]`: where a probing ended, and whether it touched.
    Probe {
        /// In the machine frame.
        position_mm: [f64; 3],
        /// The probe touched.
        touched: bool,
    },
    /// `$n=value`: a setting.
    Setting {
        /// Its number, as in `$100`.
        number: u16,
        /// Its value, as written.
        value: String,
    },
    /// `[...]` of any other kind: offsets, parser state, version.
    Feedback(String),
    /// Anything else: an echo, noise or a broken line.
    Unknown(String),
}

impl Response {
    /// Parses a line, without its end.
    pub fn parse(line: &str) -> Self {
        Self::known(line).unwrap_or_else(|| Self::Unknown(line.to_owned()))
    }

    fn known(line: &str) -> Option<Self> {
        if line == "ok" {
            return Some(Self::Ok);
        }
        if let Some(code) = line.strip_prefix("error:") {
            return Some(Self::Error(code.parse().ok()?));
        }
        if let Some(code) = line.strip_prefix("ALARM:") {
            return Some(Self::Alarm(code.parse().ok()?));
        }
        if line.starts_with('<') {
            return StatusReport::parse(line).ok().map(Self::Status);
        }
        if let Some(feedback) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            return Self::feedback(feedback);
        }
        if let Some(setting) = line.strip_prefix('$') {
            let (number, value) = setting.split_once('=')?;
            return Some(Self::Setting { number: number.parse().ok()?, value: value.to_owned() });
        }
        // Noise may precede the banner. Missing a reset is worse than seeing one that did not happen.
        let banner = line.get(line.find("Grbl")?..)?;
        Some(Self::Banner(banner.to_owned()))
    }

    fn feedback(feedback: &str) -> Option<Self> {
        if let Some(message) = feedback.strip_prefix("MSG:") {
            return Some(Self::Message(message.to_owned()));
        }
        if let Some(probe) = feedback.strip_prefix("PRB:") {
            let (position, touched) = probe.rsplit_once(':')?;
            return Some(Self::Probe { position_mm: triple(position)?, touched: touched == "1" });
        }
        Some(Self::Feedback(feedback.to_owned()))
    }
}

#[cfg(test)]
#[path = "response_tests.rs"]
mod tests;
