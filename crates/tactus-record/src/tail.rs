//! Looks at the end of a recording without reading the rest.

use std::{
    fs::File,
    io::{Read as _, Seek as _, SeekFrom},
    path::Path,
};

use mcap::records::op;

use crate::{
    RecordError,
    reader::{io_error, read},
};

/// A record's kind and length, the footer's content, and the end mark.
const FOOTER_BYTES: u64 = 9 + 20 + 8;

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

/// The bytes that a footer and the end mark take; fewer of a shorter file.
fn last_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let bytes = file.metadata()?.len();
    file.seek(SeekFrom::Start(bytes.saturating_sub(FOOTER_BYTES)))?;
    let mut end = Vec::new();
    file.take(FOOTER_BYTES).read_to_end(&mut end)?;
    Ok(end)
}
