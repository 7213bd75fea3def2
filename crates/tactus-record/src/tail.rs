//! Looks at the end of a recording without reading the rest.

use std::{
    fs::File,
    io::{self, Read, Seek as _, SeekFrom},
    path::Path,
};

use mcap::records::op;

use crate::{
    Reader, RecordError,
    reader::{io_error, read},
};

/// A record's kind and length.
const HEAD_BYTES: usize = 9;

/// A record's kind and length, the footer's content, and the end mark.
const FOOTER_BYTES: u64 = HEAD_BYTES as u64 + 20 + 8;

/// True if the recording says how its run ended.
///
/// A recording with an end mark was closed by its service, so its last bytes suffice. Only without it is everything read.
///
/// # Errors
/// If the file cannot be read, or is no MCAP file.
pub fn run_has_ended(path: &Path) -> Result<bool, RecordError> {
    if has_end_mark(path)? {
        return Ok(true);
    }
    let mut tally = crate::Tally::default();
    for entry in read(path)? {
        if let crate::Entry::Message { message, .. } = entry.map_err(|source| io_error(path, source))? {
            tally.take(&message);
        }
    }
    Ok(tally.finished().is_some())
}

/// True if the file ends as a recording that its service closed.
///
/// # Errors
/// If the file cannot be read.
pub fn has_end_mark(path: &Path) -> Result<bool, RecordError> {
    let end = last_bytes(path).map_err(|source| io_error(path, source))?;
    Ok(end.starts_with(&[op::FOOTER, 20, 0, 0, 0, 0, 0, 0, 0]) && end.ends_with(mcap::MAGIC))
}

/// What a recording begins with, and then the messages in about the last `bytes` of it, complete or damaged. To the reader that looks like a
/// file with a hole. One that was cut off within its index may have no messages there.
///
/// # Errors
/// If the file cannot be read.
pub fn entries(path: &Path, bytes: u64) -> Result<Reader<impl Read + use<>>, RecordError> {
    let ends = || -> io::Result<_> {
        let mut start = File::open(path)?;
        let messages_at = bytes_before_chunks(&mut start)?;
        start.rewind()?;
        let mut end = File::open(path)?;
        let index_at = index_at(path)?.unwrap_or(end.metadata()?.len());
        end.seek(SeekFrom::Start(index_at.saturating_sub(bytes).max(messages_at)))?;
        let left = index_at.saturating_sub(end.stream_position()?);
        Ok(start.take(messages_at).chain(end.take(left)))
    };
    ends().map(Reader::new).map_err(|source| io_error(path, source))
}

/// Where the first chunk begins; the end of a file without any.
fn bytes_before_chunks(file: &mut File) -> io::Result<u64> {
    let bytes = file.metadata()?.len();
    let mut at = (mcap::MAGIC.len() as u64).min(bytes);
    loop {
        file.seek(SeekFrom::Start(at))?;
        let mut head = [0; HEAD_BYTES];
        if bytes - at < HEAD_BYTES as u64 {
            return Ok(at);
        }
        file.read_exact(&mut head)?;
        let [kind, length @ ..] = head;
        let next = at.saturating_add(HEAD_BYTES as u64).saturating_add(u64::from_le_bytes(length));
        // A record that goes beyond the end is damaged or not whole.
        if kind == op::CHUNK || next > bytes {
            return Ok(at);
        }
        at = next;
    }
}

/// Where the index of a recording begins that was closed.
fn index_at(path: &Path) -> io::Result<Option<u64>> {
    let end = last_bytes(path)?;
    let is_footer = end.first() == Some(&op::FOOTER) && end.ends_with(mcap::MAGIC);
    let at = end.get(HEAD_BYTES..).and_then(|body| body.first_chunk()).map(|at| u64::from_le_bytes(*at));
    // Zero stands for no index.
    Ok(at.filter(|at| is_footer && *at > 0))
}

/// The bytes that a footer and the end mark take; fewer of a shorter file.
fn last_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let bytes = file.metadata()?.len();
    file.seek(SeekFrom::Start(bytes.saturating_sub(FOOTER_BYTES)))?;
    let mut end = Vec::new();
    file.take(FOOTER_BYTES).read_to_end(&mut end)?;
    Ok(end)
}
