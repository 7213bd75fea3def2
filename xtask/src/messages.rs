//! Compiles `tactus.proto` to the committed Rust types and descriptors.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};

/// The compiled files, relative to the repository. They are committed so that neither a build nor the Python client
/// needs a protobuf compiler.
const RUST_TYPES: &str = "crates/tactus-schema/proto/tactus.v1.rs";
const DESCRIPTORS: [&str; 2] =
    ["crates/tactus-schema/proto/tactus.binpb", "clients/python/src/tactus_client/tactus.binpb"];

/// Compiles the messages of the repository at `top` and writes the results below `out`.
pub(crate) fn compile(top: &Path, out: &Path) -> Result<()> {
    let descriptors = protox::Compiler::new([top.join("crates/tactus-schema/proto")])?
        .include_source_info(true)
        .open_file("tactus/v1/tactus.proto")
        .context("tactus.proto does not compile")?
        .file_descriptor_set();

    let types = place(out, RUST_TYPES)?;
    let folder = types.parent().context("the Rust types have no folder")?;
    prost_build::Config::new()
        .out_dir(folder)
        .btree_map(["."])
        .disable_comments(["."])
        .compile_fds(descriptors.clone())
        .context("no Rust types from tactus.proto")?;

    // The descriptors include the comments, which stock MCAP viewers show beside the fields.
    let bytes = prost::Message::encode_to_vec(&descriptors);
    for path in DESCRIPTORS {
        fs::write(place(out, path)?, &bytes).with_context(|| format!("cannot write {path}"))?;
    }
    Ok(())
}

/// A path below `out`; makes its folder.
fn place(out: &Path, path: &str) -> Result<PathBuf> {
    let path = out.join(path);
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    Ok(path)
}

#[cfg(test)]
#[path = "messages_tests.rs"]
mod tests;
