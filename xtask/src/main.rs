//! Chores of the repository.
//!
//! - `cargo xtask proto` compiles the messages.
//! - `cargo xtask assets` writes the tools as STL.
//! - `cargo xtask reference` writes the book's reference and the manual pages.

mod assets;
#[cfg(any(test, feature = "proto"))]
mod messages;
#[cfg(any(test, feature = "reference"))]
mod reference;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

fn main() -> Result<()> {
    let task = std::env::args().nth(1);
    match task.as_deref() {
        #[cfg(feature = "proto")]
        Some("proto") => messages::compile(&repository(), &repository()),
        Some("assets") => assets::write(&repository()),
        #[cfg(feature = "reference")]
        Some("reference") => reference::write(&repository(), &repository()),
        other => bail!("unknown task {other:?}; known: proto, assets, reference"),
    }
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
