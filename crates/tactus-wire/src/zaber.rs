//! `zaber-ascii`: stages that speak version 2 of Zaber's ASCII protocol, firmware 6 and 7.
//!
//! # Source
//! Zaber's ASCII protocol, version 2, as public code that quotes its manual, the list of flags that Zaber publishes
//! and the `zproto` crate tell of it. The manual itself was not at hand, and no real device was met; least sure are a few
//! rejections (`DRIVERDISABLED`, `INACTIVE`, `NOTSUPPORTED`, `REMOTE`) and the very words of the answer to
//! `warnings clear`. In short:
//! - A command is `/`, address (0: all devices), axis (0: all axes), message id and words, ended by LF. Each
//!   device that it is for answers it once: `@`, address in two digits, axis, id in two digits, `OK` or `RJ`,
//!   `BUSY` or `IDLE`, the gravest warning flag or `--`, data, CR LF. `#` are further lines for people, `!`
//!   comes unasked when a motion ends and `comm.alert` is on.
//! - `:` and two hexadecimal digits may end a message: all bytes after the first, and those digits' value,
//!   sum to zero modulo 256. A device checks a checksum that a command carries; its own messages carry one if
//!   `comm.checksum` is 1.
//! - A message that is longer than a line ends with `\` and goes on in an info that begins with `cont` and a
//!   number.
//! - Faults begin with F, warnings with W, notices with N; the reply shows the gravest one, `warnings` lists
//!   all of an axis with their number in front, `warnings clear` clears those that a person has to see to.
//! - Positions are in microsteps; `maxspeed` is microsteps per second times 1.6384, `accel` is microsteps per
//!   second squared times 1.6384 / 10000, and 0 means no limit there. `resolution` is how many microsteps make a full step,
//!   so that with it a microstep's length changes.
//! - A move that is answered `OK BUSY` is under way and no more; it has ended when a later reply says `IDLE`.
//!   An axis that starts without knowing where it is shows `WR` until it is homed.
//!
//! The words of the flags and rejections are ours. Nothing here has met a real device yet. Why this is not the `zproto`
//! crate: `docs/decisions/0013-zabers-protocol-is-ours.md`.
//!
//! [`Decoder`] and [`Message`] read what devices say, [`HostCommand`] is what a host says, [`Flag`] and
//! [`Rejection`] are in words, [`Session`] is the host's side of the conversation. [`HostCommandDecoder`] and
//! [`Message::encode`] are the device's side.

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
