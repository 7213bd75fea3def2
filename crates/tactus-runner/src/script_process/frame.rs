//! Frames on a pipe: a length of 4 bytes, least significant first, then the message.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use serde::Serialize;

/// A pipe that is ready takes this much without waiting: `PIPE_BUF` of pipe(7).
const PIECE_BYTES: usize = 4096;

/// The frame of a message.
pub(super) fn of(message: &impl Serialize) -> Result<Vec<u8>, String> {
    let mut frame = postcard::to_extend(message, vec![0; 4]).map_err(|error| error.to_string())?;
    let length = u32::try_from(frame.len() - 4).map_err(|error| error.to_string())?;
    for (to, from) in frame.iter_mut().zip(length.to_le_bytes()) {
        *to = from;
    }
    Ok(frame)
}

/// The writing end.
#[derive(Debug)]
pub(super) struct FrameWriter(File);

impl FrameWriter {
    pub(super) fn new(pipe: OwnedFd) -> Self {
        Self(pipe.into())
    }

    /// Writes a piece, if the reader makes room within `patience`; returns the rest.
    pub(super) fn write_some<'a>(&mut self, bytes: &'a [u8], patience: Duration) -> io::Result<&'a [u8]> {
        if !is_ready(&self.0, PollFlags::OUT, patience)? {
            return Ok(bytes);
        }
        let written = self.0.write(bytes.get(..PIECE_BYTES).unwrap_or(bytes))?;
        Ok(bytes.get(written..).unwrap_or_default())
    }

    /// Writes a frame, however long the reader takes.
    pub(super) fn write_all(&mut self, frame: &[u8]) -> io::Result<()> {
        self.0.write_all(frame)
    }
}

/// The reading end.
#[derive(Debug)]
pub(super) struct FrameReader {
    pipe: File,
    /// What has come of the next frame.
    bytes: Vec<u8>,
    message_max_bytes: usize,
}

impl FrameReader {
    pub(super) fn new(pipe: OwnedFd, message_max_bytes: usize) -> Self {
        Self { pipe: pipe.into(), bytes: Vec::new(), message_max_bytes }
    }

    /// Reads what comes within `patience`; the message, once it is whole.
    pub(super) fn read_some(&mut self, patience: Duration) -> io::Result<Option<Vec<u8>>> {
        if is_ready(&self.pipe, PollFlags::IN, patience)? { self.read_ready() } else { Ok(None) }
    }

    /// Reads a message, however long it takes to come.
    pub(super) fn read(&mut self) -> io::Result<Vec<u8>> {
        loop {
            if let Some(message) = self.read_ready()? {
                return Ok(message);
            }
        }
    }

    /// True if nobody can write any more.
    pub(super) fn is_closed(&self) -> bool {
        let mut pipe = [PollFd::new(&self.pipe, PollFlags::empty())];
        poll(&mut pipe, Some(&Timespec::default())).is_ok()
            && pipe.iter().any(|pipe| pipe.revents().contains(PollFlags::HUP))
    }

    /// One read. Both sides wait for each other's messages, so nothing follows a whole frame.
    fn read_ready(&mut self) -> io::Result<Option<Vec<u8>>> {
        let mut piece = [0; 1 << 13];
        let read = match self.pipe.read(&mut piece) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(read) => read,
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(None),
            Err(error) => return Err(error),
        };
        self.bytes.extend(piece.get(..read).unwrap_or_default());
        let Some((length, message)) = self.bytes.split_first_chunk::<4>() else { return Ok(None) };
        let length = usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX);
        if length > self.message_max_bytes || message.len() > length {
            return Err(io::Error::new(ErrorKind::InvalidData, format!("a frame of {length} bytes")));
        }
        if message.len() < length {
            return Ok(None);
        }
        let message = message.to_vec();
        self.bytes.clear();
        Ok(Some(message))
    }
}

fn is_ready(pipe: &impl AsFd, for_what: PollFlags, patience: Duration) -> io::Result<bool> {
    let mut pipe = [PollFd::new(pipe, for_what)];
    let patience = Timespec::try_from(patience).unwrap_or_default();
    match poll(&mut pipe, Some(&patience)) {
        // An error or a hang-up counts as ready: the read or write tells it.
        Ok(ready) => Ok(ready > 0),
        Err(Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
