//! Chores of the repository.
//!
//! - `cargo xtask proto` compiles the messages.
//! - `cargo xtask assets` makes the tools.
//! - `cargo xtask licences FILE` collects the licence texts of what is linked into the programs.

mod assets;
#[cfg(feature = "licences")]
mod licences;
#[cfg(any(test, feature = "proto"))]
mod messages;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

fn main() -> Result<()> {
    let task = std::env::args().nth(1);
    match task.as_deref() {
        #[cfg(feature = "proto")]
        Some("proto") => messages::compile(&repository(), &repository()),
        Some("assets") => assets::write(&repository()),
        #[cfg(feature = "licences")]
        Some("licences") => {
            let Some(out) = std::env::args().nth(2) else {
                bail!("name the file to write: cargo xtask licences FILE")
            };
            licences::write(&repository(), Path::new(&out))
        }
        other => bail!("unknown task {other:?}; there are: proto, assets, licences"),
    }
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
