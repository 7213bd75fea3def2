//! Lines from a device.

use super::Flag;
use super::checksum::{checksum, verify};

/// Longest line of a device, with its end; the protocol's default.
const PACKET_MAX_BYTES: usize = 80;

/// Sender of a message, and the command that it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Address of the device, 1 to 99.
    pub device: u8,
    /// Number of the axis, 1 to 9; 0 for the device as a whole.
    pub axis: u8,
    /// The command's message id, 0 to 99; `None` if it had none.
    pub id: Option<u8>,
}

/// A message from a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Message {
    /// `@`: the answer to a command.
    Reply {
        /// Sender.
        header: Header,
        /// True for `OK`. For `RJ`, [`data`](Message::data) names the [`Rejection`](super::Rejection).
        accepted: bool,
        /// True for `BUSY` (moving), false for `IDLE`.
        busy: bool,
        /// The gravest present warning.
        flag: Flag,
        /// The requested data; `0` if there are none.
        data: String,
    },
    /// `#`: a further line of an answer, for people or lists.
    Info {
        /// Sender.
        header: Header,
        /// Text of the line.
        data: String,
    },
    /// `!`: sent unrequested when a motion has ended, if `comm.alert` is on.
    Alert {
        /// Sender; without an id.
        header: Header,
        /// True while it moves.
        busy: bool,
        /// The gravest present warning.
        flag: Flag,
        /// Usually empty.
        data: String,
    },
}

/// A line: a message, or a part of one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// The message or part.
    pub message: Message,
    /// True if it had a checksum, which was correct.
    pub checked: bool,
    /// True if it ended with `\`: the next part follows as an info line that begins with `cont`.
    pub more: bool,
}

/// Why a line is not a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum PacketError {
    /// It begins with none of `@`, `#` and `!`.
    #[error("the line begins with none of @, # and !")]
    Kind,
    /// The checksum is wrong or malformed.
    #[error("the checksum is wrong")]
    Checksum,
    /// A field is missing or malformed.
    #[error("the {field} is missing or malformed")]
    Field { field: &'static str },
}

impl Packet {
    /// Parses a line, without its end.
    ///
    /// # Errors
    /// If a device would not send such a line.
    pub fn parse(line: &str) -> Result<Self, PacketError> {
        let mut characters = line.chars();
        let kind = characters.next().filter(|kind| "@#!".contains(*kind)).ok_or(PacketError::Kind)?;
        let (content, checked) = verify(characters.as_str()).ok_or(PacketError::Checksum)?;
        let (content, more) = match content.strip_suffix('\\') {
            Some(content) => (content, true),
            None => (content, false),
        };
        let mut fields = Fields(content);
        let missing = |field| PacketError::Field { field };
        let device = fields.number(99).filter(|device| *device > 0).ok_or(missing("device address"))?;
        let axis = fields.number(9).ok_or(missing("axis number"))?;
        let id = if kind == '!' { None } else { fields.id() };
        let header = Header { device, axis, id };
        let message = match kind {
            '@' => Message::Reply {
                header,
                accepted: fields.either("reply flag", "OK", "RJ")?,
                busy: fields.either("status", "BUSY", "IDLE")?,
                flag: fields.flag()?,
                data: fields.rest(),
            },
            '!' => Message::Alert {
                header,
                busy: fields.either("status", "BUSY", "IDLE")?,
                flag: fields.flag()?,
                data: fields.rest(),
            },
            _ => Message::Info { header, data: fields.rest() },
        };
        Ok(Self { message, checked, more })
    }
}

impl Message {
    /// Sender, and the command that it answers.
    pub fn header(&self) -> Header {
        match self {
            Self::Reply { header, .. } | Self::Info { header, .. } | Self::Alert { header, .. } => *header,
        }
    }

    /// Its data.
    pub fn data(&self) -> &str {
        match self {
            Self::Reply { data, .. } | Self::Info { data, .. } | Self::Alert { data, .. } => data,
        }
    }

    /// The bytes that a device sends: one packet, or several if it is longer than 80 bytes. It is split between words; a
    /// word that is longer than a packet is sent whole.
    pub fn encode(&self, with_checksum: bool) -> Vec<u8> {
        let Header { device, axis, id } = self.header();
        let id = id.map(|id| format!(" {id:02}")).unwrap_or_default();
        let status = |busy: &bool| if *busy { "BUSY" } else { "IDLE" };
        let mut head = match self {
            Self::Reply { accepted, busy, flag, .. } => {
                let accepted = if *accepted { "OK" } else { "RJ" };
                format!("@{device:02} {axis}{id} {accepted} {} {flag}", status(busy))
            }
            Self::Info { .. } => format!("#{device:02} {axis}{id}"),
            Self::Alert { busy, flag, .. } => format!("!{device:02} {axis} {} {flag}", status(busy)),
        };
        let mut bytes = Vec::new();
        let mut parts = 0;
        let mut packet = head.clone();
        for word in self.data().split_ascii_whitespace() {
            // 1 for the space before the word; 6 for `\`, a checksum and the line's end.
            let fits = packet.len() + 1 + word.len() + 6 <= PACKET_MAX_BYTES;
            if !fits && packet.len() > head.len() {
                packet.push('\\');
                end_packet(&mut bytes, &packet, with_checksum);
                parts += 1;
                head = format!("#{device:02} {axis}{id} cont {parts}");
                packet.clone_from(&head);
            }
            packet.push(' ');
            packet.push_str(word);
        }
        end_packet(&mut bytes, &packet, with_checksum);
        bytes
    }

    /// Its data, to append the next part.
    pub(super) fn data_mut(&mut self) -> &mut String {
        match self {
            Self::Reply { data, .. } | Self::Info { data, .. } | Self::Alert { data, .. } => data,
        }
    }
}

fn end_packet(bytes: &mut Vec<u8>, packet: &str, with_checksum: bool) {
    bytes.extend_from_slice(packet.as_bytes());
    if with_checksum {
        let content = packet.get(1..).unwrap_or_default();
        bytes.extend_from_slice(format!(":{:02X}", checksum(content.as_bytes())).as_bytes());
    }
    bytes.extend_from_slice(b"\r\n");
}

/// The words of a line, from the left.
pub(super) struct Fields<'a>(pub(super) &'a str);

impl<'a> Fields<'a> {
    /// Takes the next word if it is a number up to `max`.
    pub(super) fn number(&mut self, max: u8) -> Option<u8> {
        let (word, rest) = self.split();
        let is_number = !word.is_empty() && word.len() <= 2 && word.bytes().all(|byte| byte.is_ascii_digit());
        let number = word.parse().ok().filter(|number| is_number && *number <= max)?;
        self.0 = rest;
        Some(number)
    }

    /// Takes the next word if it is a message id: two digits.
    pub(super) fn id(&mut self) -> Option<u8> {
        let (word, _) = self.split();
        if word.len() == 2 { self.number(99) } else { None }
    }

    /// The remaining words.
    pub(super) fn rest(&self) -> String {
        self.0.trim().to_owned()
    }

    fn either(&mut self, field: &'static str, yes: &str, no: &str) -> Result<bool, PacketError> {
        let word = self.word();
        if word == yes {
            Ok(true)
        } else if word == no {
            Ok(false)
        } else {
            Err(PacketError::Field { field })
        }
    }

    fn flag(&mut self) -> Result<Flag, PacketError> {
        Flag::parse(self.word()).ok_or(PacketError::Field { field: "warning flag" })
    }

    fn word(&mut self) -> &'a str {
        let (word, rest) = self.split();
        self.0 = rest;
        word
    }

    fn split(&self) -> (&'a str, &'a str) {
        let left = self.0.trim_start();
        left.split_once(' ').unwrap_or((left, ""))
    }
}

#[cfg(test)]
#[path = "packet_tests.rs"]
mod tests;
