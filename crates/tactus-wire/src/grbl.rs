//! `grbl`: controllers that run Grbl 1.1 or grblHAL.
//!
//! # Source
//! Grbl's published interface description and its lists of errors and alarms; and what the real
//! firmware's host build was seen to do, which [`Session`] honours:
//! - Boot may emit `error:7` before the banner.
//! - A status report is asked for by `?` and comes 5-60 ms later; a second `?` may be dropped.
//! - Positions have three decimals.
//! - `!` leads to `Hold:1`, then `Hold:0`; `~` is ignored until then.
//! - 0x18 in motion may or may not raise `ALARM:3`, so that a banner in motion leaves the position suspect.
//! - After `ALARM:1` and `ALARM:2` everything is `error:9` until 0x18 and `$X`, and `?` may go unanswered.
//! - `$$` lists the settings, `$I` tells the version; both are answered while nothing moves, in an alarm too. Writing a
//!   setting takes 100-220 ms; this host writes none.
//! - `$H` with homing switched off is `error:5`. During `$H` one `<Home|...>` is sent, then nothing until
//!   `ok`, or `ALARM:9` after some 24 s.
//! - There is no heartbeat.
//!
//! [`Response`] reads what the controller says, [`Session`] is the host's side of the conversation.

mod active_move;
mod config;
mod meaning;
mod poll;
mod response;
mod session;
mod settings;
mod status;

pub use config::{Axis, Config, ConfigError};
pub use meaning::{alarm_meaning, error_meaning};
pub use response::Response;
pub use session::{Session, SessionError};
pub use status::{MachineState, Position, StatusError, StatusReport};

/// Real-time byte: asks for a status report.
pub const STATUS_QUERY: u8 = b'?';
/// Real-time byte: decelerates to a stand and holds.
pub const FEED_HOLD: u8 = b'!';
/// Real-time byte: goes on after a hold.
pub const CYCLE_START: u8 = b'~';
/// Real-time byte: resets the controller; it answers with its banner.
pub const SOFT_RESET: u8 = 0x18;
/// Real-time byte: ends a jog.
pub const JOG_CANCEL: u8 = 0x85;
