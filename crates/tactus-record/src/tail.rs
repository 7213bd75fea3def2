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
    if has_end_mark(path).map_err(|source| io_error(path, source))? {
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

fn has_end_mark(path: &Path) -> std::io::Result<bool> {
    let mut file = File::open(path)?;
    let bytes = file.metadata()?.len();
    if bytes < FOOTER_BYTES {
        return Ok(false);
    }
    file.seek(SeekFrom::Start(bytes - FOOTER_BYTES))?;
    let mut end = Vec::new();
    file.read_to_end(&mut end)?;
    Ok(end.starts_with(&[op::FOOTER, 20, 0, 0, 0, 0, 0, 0, 0]) && end.ends_with(mcap::MAGIC))
}
