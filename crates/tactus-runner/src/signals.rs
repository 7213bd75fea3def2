//! The signals that end a program, taken as a wish instead of at once: a tip in contact is retracted first.

use std::fs;
use std::future::poll_fn;
use std::io;
use std::task::Poll;

use tokio::signal::unix::{Signal, SignalKind, signal};

/// Signals that ask a program to end: a closed terminal, Ctrl-C, Ctrl-\, and the service manager's.
const ENDING: [(&str, i32, SignalKind); 4] = [
    ("SIGHUP", 1, SignalKind::hangup()),
    ("SIGINT", 2, SignalKind::interrupt()),
    ("SIGQUIT", 3, SignalKind::quit()),
    ("SIGTERM", 15, SignalKind::terminate()),
];

/// Signals that would kill or suspend a program, and mean nothing to these. 20 is SIGTSTP, the terminal's Ctrl-Z.
const IGNORED: [SignalKind; 3] =
    [SignalKind::user_defined1(), SignalKind::user_defined2(), SignalKind::from_raw(20)];

/// Listens to the signals that end a program. From then on neither they nor SIGUSR1, SIGUSR2 and SIGTSTP do anything of
/// their own, until the end of the process.
#[derive(Debug)]
pub struct EndingSignals {
    ending: Vec<(Ending, Signal)>,
    _ignored: Vec<Signal>,
}

/// A signal that asked the program to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ending {
    /// Its name, such as `SIGTERM`.
    pub name: &'static str,
    /// Its number.
    pub number: i32,
}

impl Ending {
    /// The exit code that tells of an end by this signal, as shells do.
    pub fn exit_code(self) -> i32 {
        128 + self.number
    }
}

impl EndingSignals {
    /// Starts to listen. A SIGHUP that the parent has switched off, as `nohup` does, stays off.
    ///
    /// # Errors
    /// If the system refuses a handler.
    ///
    /// # Panics
    /// Outside a tokio runtime with I/O.
    pub fn listen() -> io::Result<Self> {
        let inherited = inherited_ignored();
        let ending = ENDING
            .into_iter()
            .filter(|(name, number, _)| *name != "SIGHUP" || !is_in(inherited, *number))
            .map(|(name, number, kind)| Ok((Ending { name, number }, signal(kind)?)))
            .collect::<io::Result<_>>()?;
        let ignored = IGNORED.into_iter().map(signal).collect::<io::Result<_>>()?;
        Ok(Self { ending, _ignored: ignored })
    }

    /// Waits for the next signal.
    pub async fn next(&mut self) -> Ending {
        poll_fn(|context| {
            let came = self.ending.iter_mut().find_map(|(ending, signal)| {
                matches!(signal.poll_recv(context), Poll::Ready(Some(()))).then_some(*ending)
            });
            came.map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}

/// The signals that this process ignores, as a set of bits.
fn inherited_ignored() -> u64 {
    fs::read_to_string("/proc/self/status").map_or(0, |status| ignored_in(&status))
}

/// The set in a text of the form of `/proc/self/status`.
fn ignored_in(status: &str) -> u64 {
    let set = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0)
}

fn is_in(set: u64, number: i32) -> bool {
    set >> (number - 1) & 1 == 1
}

#[cfg(test)]
#[path = "signals_tests.rs"]
mod tests;
