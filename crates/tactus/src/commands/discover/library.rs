//! Drafts of a folder, which discovery takes beside the effects of the library.

use std::fs;
use std::path::Path;

use anyhow::Context;
use tactus_model::effect::Definition;
use tactus_schema::DraftFile;

use crate::exit::{Exit, Failure};

/// The drafts in use of a folder's `.toml` files, in order of their names.
///
/// # Errors
/// If the folder or a file cannot be read, if a file is no draft, or if two drafts have one name.
pub(super) fn read(folder: &Path) -> anyhow::Result<Vec<&'static Definition>> {
    let entries = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let mut drafts: Vec<&'static Definition> = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        let refused = |problem: String| Failure::new(Exit::Usage, format!("{}: {problem}", path.display()));
        let file = DraftFile::from_toml(&text).map_err(|error| refused(error.to_string()))?;
        if !file.status.is_in_use() {
            continue;
        }
        let definition = file.define()?;
        if drafts.iter().any(|known| known.name == definition.name) {
            return Err(refused(format!("another file has a draft {:?}, too", definition.name)).into());
        }
        drafts.push(definition);
    }
    Ok(drafts)
}
