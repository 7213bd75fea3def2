//! `grbl`: controllers that run Grbl 1.1 or grblHAL.
//!
//! # Source
//! Grbl's published interface description, and its lists of errors and alarms. [`Session`] also takes into account what
//! the host build of the real firmware was observed to do:
//! - At boot it may send `error:7` before the banner.
//! - `?` requests a status report, which arrives 5-60 ms later. A second `?` before it may be dropped.
//! - Positions have three decimals.
//! - `!` leads to `Hold:1`, then `Hold:0`. Until then `~` is ignored.
//! - 0x18 in motion may or may not raise `ALARM:3`. A banner in motion therefore makes the position suspect.
//! - After `ALARM:1` and `ALARM:2` the answer to everything is `error:9` until 0x18 and `$X`, and `?` may stay unanswered.
//! - `$$` lists the settings and `$I` the version. Both are answered while nothing moves, also in an alarm. Writing a
//!   setting takes 100-220 ms; this host writes none.
//! - With homing switched off, `$H` gives `error:5`. During `$H` one `<Home|...>` is sent, then nothing until `ok`, or
//!   `ALARM:9` after about 24 s.
//! - `G53` makes the coordinates of one line those of the machine frame, absolute, in `G91` too.
//! - There is no heartbeat, and nothing has a checksum. The parser ignores `/`, and drops bytes above 0x7F as real-time
//!   commands. `$G` prints the modes, and the feed as a whole number. A reset forgets both.
//!
//! [`Response`] parses lines of the controller. [`Session`] is the host's side.

mod active_move;
mod config;
mod feed;
mod meaning;
mod number;
mod poll;
mod response;
mod session;
mod settings;
mod status;
mod work_frame;

pub use config::{Axis, Config, ConfigError};
pub use meaning::{alarm_meaning, error_meaning};
pub use response::Response;
pub use session::{Session, SessionError};
pub use status::{MachineState, Position, StatusError, StatusReport};

/// Real-time byte: requests a status report.
pub const STATUS_QUERY: u8 = b'?';
/// Real-time byte: decelerates to a standstill and holds.
pub const FEED_HOLD: u8 = b'!';
/// Real-time byte: resumes after a hold.
pub const CYCLE_START: u8 = b'~';
/// Real-time byte: resets the controller; it answers with its banner.
pub const SOFT_RESET: u8 = 0x18;
/// Real-time byte: ends a jog.
pub const JOG_CANCEL: u8 = 0x85;
