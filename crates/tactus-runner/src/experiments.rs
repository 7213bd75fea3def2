//! Where experiment scripts come from: a path, the configured folder, or the built-in ones.

use std::fs;
use std::path::{Path, PathBuf};

use tactus_plan::{Script, ScriptError};

/// The scripts that come with Tactus, by name.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("corners", include_str!("../../../experiments/corners.star")),
    ("diagnose", include_str!("../../../experiments/diagnose.star")),
    ("element-centres", include_str!("../../../experiments/element-centres.star")),
    ("grid-sweep", include_str!("../../../experiments/grid-sweep.star")),
    ("image", include_str!("../../../experiments/image.star")),
    ("move-to", include_str!("../../../experiments/move-to.star")),
];

/// Why there is no such experiment.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ExperimentError {
    /// No script of that name.
    #[error(
        "no experiment {name:?}; there is: {known}; or give the path of a .star file. `tactus experiments` explains them"
    )]
    Unknown { name: String, known: String },
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// The script has an error.
    #[error(transparent)]
    Script(#[from] ScriptError),
}

/// Finds a script for a person at this machine: by a path that ends in `.star`, or by name.
///
/// # Errors
/// [`ExperimentError`]; the script's own errors name the line.
pub fn find(name_or_path: &str, folder: Option<&Path>) -> Result<Script, ExperimentError> {
    let path = Path::new(name_or_path);
    if path.extension().is_some_and(|extension| extension == "star") {
        load(path)
    } else {
        named(name_or_path, folder)
    }
}

/// Finds a script by name, in `folder` or built in. Never reads anywhere else, whatever the name.
///
/// # Errors
/// As [`find`].
pub fn named(name: &str, folder: Option<&Path>) -> Result<Script, ExperimentError> {
    let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    let file = folder.filter(|_| is_name).map(|folder| folder.join(name).with_extension("star"));
    if let Some(path) = file.filter(|path| path.is_file()) {
        return load(&path);
    }
    match BUILT_IN.iter().find(|(built_in, _)| *built_in == name) {
        Some((name, source)) => Ok(Script::parse(name, source)?),
        None => Err(ExperimentError::Unknown { name: name.to_owned(), known: names(folder).join(", ") }),
    }
}

/// The names that [`find`] knows.
pub fn names(folder: Option<&Path>) -> Vec<String> {
    let mut names: Vec<_> = BUILT_IN.iter().map(|(name, _)| (*name).to_owned()).collect();
    let files = folder.and_then(|folder| fs::read_dir(folder).ok()).into_iter().flatten().flatten();
    names.extend(
        files
            .map(|file| file.path())
            .filter(|path| path.extension().is_some_and(|e| e == "star"))
            .filter_map(|path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned())),
    );
    names.sort();
    names.dedup();
    names
}

fn load(path: &Path) -> Result<Script, ExperimentError> {
    let source =
        fs::read_to_string(path).map_err(|source| ExperimentError::Read { path: path.to_owned(), source })?;
    let name = path.file_stem().map_or_else(|| "script".into(), |stem| stem.to_string_lossy().into_owned());
    Ok(Script::parse(&name, &source)?)
}
