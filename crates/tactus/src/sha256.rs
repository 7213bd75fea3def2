//! Checksums of files and texts.

use std::fs::File;
use std::io;
use std::path::Path;

use anyhow::Context;
use sha2::{Digest, Sha256};

/// SHA-256 of a file, in hexadecimal.
pub(crate) fn of_file(path: &Path) -> anyhow::Result<String> {
    let mut hash = Sha256::new();
    let read = File::open(path).and_then(|mut file| io::copy(&mut file, &mut hash));
    read.with_context(|| path.display().to_string())?;
    Ok(format!("{:x}", hash.finalize()))
}

/// SHA-256 of a text, in hexadecimal.
pub(crate) fn of_text(text: &str) -> String {
    format!("{:x}", Sha256::digest(text))
}
