//! Writes the book's reference and the manual pages from the code.

mod command_line;
mod configuration;
mod drafts;
mod effects;
mod exit_codes;
mod manual;
mod messages;
mod source;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Folder of the pages, relative to the repository.
const BOOK: &str = "docs/book/reference";

/// Folder of the manual pages, relative to the repository.
const MANUAL: &str = "packaging/man";

/// What stands below the title of each page.
const MADE: &str = "<!-- Made by `cargo xtask reference`. -->";

/// A file that is made: its path relative to the repository, and its text.
struct Made {
    path: PathBuf,
    text: String,
}

/// Makes everything of the repository at `top` and writes it below `out`.
pub(crate) fn write(top: &Path, out: &Path) -> Result<()> {
    for folder in [BOOK, MANUAL] {
        let folder = out.join(folder);
        // A page of a command that is gone goes, too.
        if folder.exists() {
            fs::remove_dir_all(&folder).with_context(|| format!("cannot empty {}", folder.display()))?;
        }
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    for Made { path, text } in make(top)? {
        fs::write(out.join(&path), text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn make(top: &Path) -> Result<Vec<Made>> {
    let pages = [
        ("command-line", "Command line", command_line::page()),
        ("exit-codes", "Exit codes", exit_codes::page(top)?),
        ("configuration", "Configuration", configuration::page(top)?),
        ("messages", "Messages", messages::page(top)?),
        ("scripts", "Scripts", scripts()),
        ("effects", "Effects", effects::page(top)?),
    ];
    let page = |(name, title, text): (&str, &str, String)| Made {
        path: Path::new(BOOK).join(name).with_extension("md"),
        text: format!("# {title}\n\n{MADE}\n\n{}\n", text.trim_end()),
    };
    let mut made: Vec<Made> = pages.into_iter().map(page).collect();
    made.extend(manual::pages()?);
    Ok(made)
}

fn scripts() -> String {
    let intro = "What an experiment script can say, as `tactus script reference` prints it. Scripts are Starlark, a small Python. \
                 [Your own experiment](../how-to/experiment.md) begins with a short one.";
    format!("{intro}\n\n```python\n{}\n```", tactus_plan::reference().trim())
}

#[cfg(test)]
#[path = "reference_tests.rs"]
mod tests;
