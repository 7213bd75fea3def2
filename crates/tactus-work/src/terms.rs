//! What all results in a folder have in common.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde_json::{Map, Value};

use crate::whole_file::write_whole_new;

/// A worker may not work in a folder.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum TermsError {
    /// Its results would differ from those that are there.
    #[error("the results beside {} are of {name} {there}, not of {here}: give another folder, or remove this one", path.display())]
    Differ { path: PathBuf, name: String, there: Value, here: Value },
    /// The file is none of terms.
    #[error("{}: {source}", path.display())]
    Form { path: PathBuf, source: serde_json::Error },
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: io::Error },
}

/// Holds all workers of a folder to the terms of the first, which are in a file there.
///
/// # Errors
/// If the terms differ, or the file cannot be read or written.
pub fn agree(path: &Path, terms: impl IntoIterator<Item = (&'static str, Value)>) -> Result<(), TermsError> {
    let form = |source| TermsError::Form { path: path.into(), source };
    let file = |source| TermsError::File { path: path.into(), source };
    let terms: Map<String, Value> = terms.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    match write_whole_new(path, &serde_json::to_vec_pretty(&terms).map_err(form)?) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        written => return written.map_err(file),
    }
    let mut first: Map<String, Value> =
        serde_json::from_slice(&fs::read(path).map_err(file)?).map_err(form)?;
    for (name, here) in terms {
        let there = first.remove(&name).unwrap_or(Value::Null);
        if there != here {
            return Err(TermsError::Differ { path: path.into(), name, there, here });
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "terms_tests.rs"]
mod tests;
