//! The program that is measured: which build it is, and a run of it.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitStatus};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};
use tactus_work::Stop;

/// A program that was watched until its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watched {
    pub(crate) exit: ExitStatus,
    pub(crate) seconds: f64,
    /// Time of the processor on all cores.
    pub(crate) processor_s: f64,
    /// Greatest resident memory.
    pub(crate) peak_mib: f64,
}

/// Time between two readings of the memory.
const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// SHA-256 of a program.
pub(crate) fn digest(program: &Path) -> Result<String> {
    let bytes = fs::read(program).with_context(|| program.display().to_string())?;
    let mut digits = String::new();
    for byte in Sha256::digest(bytes) {
        write!(digits, "{byte:02x}")?;
    }
    Ok(digits)
}

/// Runs a program to its end; `None` if it was killed because `stop` was set.
pub(crate) fn watched(command: &mut Command, stop: &Stop) -> Result<Option<Watched>> {
    let started = Instant::now();
    let mut child = command.spawn().with_context(|| command.get_program().to_string_lossy().into_owned())?;
    let process = child.id();
    let about = |what: &str| fs::read_to_string(format!("/proc/{process}/{what}")).ok();
    let (mut peak_kib, mut processor_s) = (0.0_f64, 0.0_f64);
    loop {
        // The files are gone once the process has ended; the last values stay.
        let most_kib = about("status").and_then(|text| kib(&text, "VmHWM:"));
        peak_kib = peak_kib.max(most_kib.unwrap_or(0.0));
        let used_s = about("stat").and_then(|text| self::processor_s(&text));
        processor_s = processor_s.max(used_s.unwrap_or(0.0));
        if let Some(exit) = child.try_wait()? {
            let seconds = started.elapsed().as_secs_f64();
            return Ok(Some(Watched { exit, seconds, processor_s, peak_mib: peak_kib / 1024.0 }));
        }
        if stop.is_set() {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(LOOK_AGAIN);
    }
}

/// Time of the processor in `/proc/PID/stat`: in user mode and in the kernel's, in hundredths of a second (proc(5), `USER_HZ`).
fn processor_s(stat: &str) -> Option<f64> {
    // The name of the program, in brackets, may have spaces.
    let (_, after_name) = stat.rsplit_once(')')?;
    let mut fields = after_name.split_whitespace().skip(11);
    let mut hundredths = || fields.next()?.parse::<f64>().ok();
    Some((hundredths()? + hundredths()?) / 100.0)
}

/// The value of a line of the kernel, such as `VmHWM:   231596 kB`.
pub(crate) fn kib(lines: &str, name: &str) -> Option<f64> {
    lines.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
#[path = "program_tests.rs"]
mod tests;
