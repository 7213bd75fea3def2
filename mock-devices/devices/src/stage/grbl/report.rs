//! Texts that the controller sends.

use std::fmt;

use super::gcode::GrblError;
use super::input::BUFFER_BYTES;

pub(super) const OK: &str = "ok\r\n";
pub(super) const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]\r\n[MSG:Simulated stage]\r\n";
pub(super) const UNLOCK: &str = "[MSG:'$H'|'$X' to unlock]\r\n";
pub(super) const UNLOCKED: &str = "[MSG:Caution: Unlocked]\r\n";
pub(super) const RESET_TO_CONTINUE: &str = "[MSG:Reset to continue]\r\n";
pub(super) const HELP: &str = "[HLP:$$ $# $G $I $x=val $J=line $X $H ~ ! ? ctrl-x]\r\n";
/// Build and options: variable speeds, planner blocks, receive buffer.
pub(super) const BUILD: &str = "[VER:1.1h.20190830:simulated by Tactus]\r\n[OPT:V,15,128]\r\n";

/// Moves that the planner holds.
pub(super) const PLANNER_BLOCKS: usize = 15;

/// `error:n`.
pub(super) fn error(error: GrblError) -> String {
    format!("error:{}\r\n", error.0)
}

/// What `$#` prints.
pub(super) fn offsets(work_offset_mm: [f64; 3]) -> String {
    format!("[G54:{}]\r\n[G92:0.000,0.000,0.000]\r\n[TLO:0.000]\r\n", triple(work_offset_mm))
}

/// `ALARM:n`.
pub(super) fn alarm(code: u8) -> String {
    format!("ALARM:{code}\r\n")
}

/// Content of a status report.
#[derive(Debug, Clone, Copy)]
pub(super) struct Status {
    pub(super) state: &'static str,
    pub(super) machine_mm: [f64; 3],
    pub(super) work_offset_mm: [f64; 3],
    pub(super) is_machine_position: bool,
    /// Pending moves and free receive bytes, if the settings ask for them.
    pub(super) buffers: Option<(usize, usize)>,
    pub(super) speed_mm_per_s: f64,
    /// Number of the report since the reset, from 0 on: some fields are only in some reports.
    pub(super) number: u32,
}

impl Status {
    /// The report's line.
    pub(super) fn line(&self) -> String {
        let (frame, position_mm) = if self.is_machine_position {
            ("MPos", self.machine_mm)
        } else {
            ("WPos", std::array::from_fn(|axis| self.machine_mm[axis] - self.work_offset_mm[axis]))
        };
        let buffers = fmt::from_fn(|f| {
            self.buffers.map_or(Ok(()), |(moves, free_bytes)| {
                write!(f, "|Bf:{},{}", PLANNER_BLOCKS.saturating_sub(moves), free_bytes.min(BUFFER_BYTES))
            })
        });
        let now_and_then = fmt::from_fn(|f| match self.number % 10 {
            0 => write!(f, "|WCO:{}", triple(self.work_offset_mm)),
            1 => f.write_str("|Ov:100,100,100"),
            _ => Ok(()),
        });
        let (state, position) = (self.state, triple(position_mm));
        let feed_mm_per_min = whole((self.speed_mm_per_s * 60.0).round_ties_even());
        format!("<{state}|{frame}:{position}{buffers}|FS:{feed_mm_per_min},0{now_and_then}>\r\n")
    }
}

/// Three coordinates with three decimals.
fn triple(mm: [f64; 3]) -> impl fmt::Display {
    // Whole microns: exact decimals of binary fractions would take ten times as long, in every report.
    let mm = mm.map(|mm| {
        let um = whole((mm * 1000.0).round());
        fmt::from_fn(move |f| {
            let sign = if um < 0 { "-" } else { "" };
            write!(f, "{sign}{}.{:03}", um.unsigned_abs() / 1000, um.unsigned_abs() % 1000)
        })
    });
    fmt::from_fn(move |f| write!(f, "{},{},{}", mm[0], mm[1], mm[2]))
}

#[expect(clippy::cast_possible_truncation, reason = "no stage is a light year long")]
fn whole(rounded: f64) -> i64 {
    rounded as i64
}

#[cfg(test)]
#[path = "report_tests.rs"]
mod tests;
