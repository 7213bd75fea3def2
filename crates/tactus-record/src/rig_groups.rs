//! What differs between rigs, and which files are of one rig.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use serde_json::Value;
use tactus_schema::Rig;

use crate::{
    Entry, RowsError,
    header::RIG_JSON,
    reader::{first_bytes, io_error, is_mcap, read},
    table::TableReader,
};

/// Differences that are told; more are counted.
const DIFFERENCES_MAX: usize = 4;

/// Files of a group that are named; more are counted.
const FILES_MAX: usize = 6;

/// Longest value that is told, in characters.
const VALUE_CHARS_MAX: usize = 40;

/// Files by the rig that they were made with.
#[derive(Debug, Default)]
pub struct RigGroups(Vec<RigGroup>);

#[derive(Debug)]
struct RigGroup {
    rig: Rig,
    files: Vec<PathBuf>,
}

impl RigGroups {
    /// Groups files by rigs that go together. A file that cannot be read is left out.
    pub(crate) fn of<P: AsRef<Path>>(paths: &[P], go_together: impl Fn(&Rig, &Rig) -> bool) -> Self {
        let mut groups: Vec<RigGroup> = Vec::new();
        for path in paths.iter().map(AsRef::as_ref) {
            let Ok(Some(rig)) = rig_of(path) else { continue };
            match groups.iter_mut().find(|group| go_together(&group.rig, &rig)) {
                Some(group) => group.files.push(path.to_owned()),
                None => groups.push(RigGroup { rig, files: vec![path.to_owned()] }),
            }
        }
        Self(groups)
    }
}

impl fmt::Display for RigGroups {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(groups) = self;
        if groups.is_empty() {
            return f.write_str("Give the files of one rig at a time");
        }
        write!(f, "The files are of {} rigs; give those of one rig at a time:", groups.len())?;
        for RigGroup { rig, files } in groups {
            let named: Vec<_> = files.iter().take(FILES_MAX).map(|file| file.display().to_string()).collect();
            write!(f, "\n  rig {:?}: {}", rig.name, named.join(" "))?;
            if files.len() > FILES_MAX {
                write!(f, " and {} more", files.len() - FILES_MAX)?;
            }
        }
        Ok(())
    }
}

/// The rig of a recording or table; `None` if the file says none.
fn rig_of(path: &Path) -> Result<Option<Rig>, RowsError> {
    if !is_mcap(&first_bytes(path)?) {
        return Ok(Some(TableReader::open(path)?.head().rig.clone()));
    }
    for entry in read(path)? {
        // Attachments stand at the start.
        match entry.map_err(|source| io_error(path, source))? {
            Entry::Attachment(file) if file.name == RIG_JSON => {
                return Ok(std::str::from_utf8(&file.data).ok().and_then(|text| Rig::from_json(text).ok()));
            }
            Entry::Attachment(_) | Entry::Run(_) => {}
            Entry::Message { .. } => break,
        }
    }
    Ok(None)
}

/// In which keys of the description two rigs differ, with both values. Keys in `free` may differ.
pub(crate) fn differences(first: &Rig, other: &Rig, free: &[&str]) -> String {
    let value = |rig: &Rig| serde_json::from_str(&rig.to_json()).unwrap_or(Value::Null);
    let mut told = Vec::new();
    compare(&mut Vec::new(), &value(first), &value(other), free, &mut told);
    let more = told.len().saturating_sub(DIFFERENCES_MAX);
    told.truncate(DIFFERENCES_MAX);
    if more > 0 {
        told.push(format!("and {more} more"));
    }
    told.join("; ")
}

fn compare<'a>(
    place: &mut Vec<&'a str>,
    first: &'a Value,
    other: &'a Value,
    free: &[&str],
    told: &mut Vec<String>,
) {
    if first == other || place.first().is_some_and(|key| free.contains(key)) {
        return;
    }
    if let (Value::Object(ours), Value::Object(theirs)) = (first, other) {
        let added = theirs.keys().filter(|key| !ours.contains_key(*key));
        for key in ours.keys().chain(added) {
            place.push(key);
            let of = |of: &'a serde_json::Map<String, Value>| of.get(key).unwrap_or(&Value::Null);
            compare(place, of(ours), of(theirs), free, told);
            place.pop();
        }
        return;
    }
    told.push(format!("{} is {}, not {}", place.join("."), in_words(other), in_words(first)));
}

fn in_words(value: &Value) -> String {
    let text = if value.is_null() { "absent".to_owned() } else { value.to_string() };
    match value.as_array() {
        Some(values) if text.chars().count() > VALUE_CHARS_MAX => format!("a list of {}", values.len()),
        _ => text,
    }
}
