//! `zaber-ascii`: stages that speak version 2 of Zaber's ASCII protocol, firmware 6 and 7.
//!
//! # Source
//! Zaber's ASCII protocol, version 2, as described by public code that quotes its manual, by Zaber's published list of
//! flags, and by the `zproto` crate. The manual itself was not available, and no real device has been tested. Least
//! certain are a few rejections (`DRIVERDISABLED`, `INACTIVE`, `NOTSUPPORTED`, `REMOTE`) and the exact answer to
//! `warnings clear`. In short:
//! - A command is `/`, address (0: all devices), axis (0: all axes), message id and words, ended by LF. Each addressed
//!   device answers once: `@`, address in two digits, axis, id in two digits, `OK` or `RJ`, `BUSY` or `IDLE`, the gravest
//!   warning flag or `--`, data, CR LF. Lines with `#` are further information for people. Lines with `!` come
//!   unrequested when a motion ends, if `comm.alert` is on.
//! - A message may end with `:` and two hexadecimal digits, a checksum: all bytes after the first and the digits' value sum
//!   to zero modulo 256. A device checks the checksum of a command that has one. Its own messages have one if
//!   `comm.checksum` is 1.
//! - A message that is longer than a line ends with `\` and continues in an info line that begins with `cont` and a number.
//! - Flags of faults begin with F, of warnings with W, of notices with N. A reply shows the gravest one. `warnings` lists all
//!   flags of an axis after their count. `warnings clear` clears those that need a person's attention.
//! - Positions are in microsteps. `maxspeed` is in microsteps/s times 1.6384, and `accel` in microsteps/s^2 times
//!   1.6384 / 10000, where 0 means no limit. `resolution` is the number of microsteps in a full step, so it determines the
//!   length of a microstep.
//! - `OK BUSY` means that a move has started. The move has ended when a later reply says `IDLE`. An axis that starts without
//!   a reference position shows `WR` until it is homed.
//!
//! The descriptions of flags and rejections are ours. See `docs/decisions/0013-zabers-protocol-is-ours.md` for why this is
//! not the `zproto` crate.
//!
//! The host's side is [`Session`], with [`Decoder`], [`Message`] and [`HostCommand`]. The device's side is
//! [`HostCommandDecoder`] and [`Message::encode`]. [`Flag`] and [`Rejection`] have descriptions in words.

mod checksum;
mod command;
mod config;
mod decoder;
mod flag;
mod packet;
mod path;
mod rejection;
mod session;

pub use command::{HostCommand, HostCommandDecoder};
pub use config::{Axis, Config, ConfigError};
pub use decoder::Decoder;
pub use flag::{Flag, Severity};
pub use packet::{Header, Message, Packet, PacketError};
pub use path::{accel_setting, accel_told, speed_setting, speed_told};
pub use rejection::Rejection;
pub use session::{Session, SessionError};
