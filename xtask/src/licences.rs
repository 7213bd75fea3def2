//! Collects the licence texts of everything that is linked into the packaged programs.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use cargo_metadata::{CargoOpt, DependencyKind, Metadata, MetadataCommand, Package, PackageId};

/// The programs of the Debian package.
const PROGRAMS: [&str; 4] = ["tactus", "tactus-daemon", "tactus-web", "tactus-mock"];

/// A file is a licence text if its name begins so, in any case.
const BEGINNINGS: [&str; 6] = ["license", "licence", "copying", "copyright", "notice", "unlicense"];

/// Writes the texts to `out`, those that are the same only once.
///
/// # Errors
/// If cargo cannot resolve the workspace at `top`, or a file cannot be read or written.
pub(crate) fn write(top: &Path, out: &Path) -> Result<()> {
    let metadata = MetadataCommand::new()
        .manifest_path(top.join("Cargo.toml"))
        .features(CargoOpt::SomeFeatures(Vec::new()))
        .other_options(["--locked".to_owned(), "--filter-platform".to_owned(), host()?])
        .exec()
        .context("cargo cannot resolve the workspace")?;
    let mut crates_of_text: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in linked(&metadata).into_iter().map(|id| &metadata[id]) {
        if package.source.is_some() {
            let licence = package.license.as_deref().unwrap_or("see below");
            let title = format!("{} {} ({licence})", package.name, package.version);
            crates_of_text.entry(texts(package)?).or_default().push(title);
        }
    }

    let mut page =
        String::from("Third-party code that is linked into the programs of Tactus, with its licences.\n");
    for (text, crates) in &crates_of_text {
        write!(page, "\n\n# {}\n\n{}\n", crates.join("\n# "), text.trim())?;
    }
    fs::write(out, page).with_context(|| format!("cannot write {}", out.display()))
}

/// The target that this machine compiles for.
fn host() -> Result<String> {
    let said =
        std::process::Command::new("rustc").args(["--print", "host-tuple"]).output().context("no rustc")?;
    Ok(String::from_utf8(said.stdout)?.trim().to_owned())
}

/// Everything that the programs are built from, procedural macros included, build scripts' own dependencies not.
fn linked(metadata: &Metadata) -> BTreeSet<&PackageId> {
    let nodes: BTreeMap<_, _> =
        metadata.resolve.iter().flat_map(|resolve| &resolve.nodes).map(|node| (&node.id, node)).collect();
    let programs = metadata.workspace_packages();
    let mut open: Vec<_> = programs
        .iter()
        .filter(|package| PROGRAMS.contains(&package.name.as_str()))
        .map(|package| &package.id)
        .collect();
    let mut linked = BTreeSet::new();
    while let Some(id) = open.pop() {
        if linked.insert(id) {
            let deps = nodes.get(id).map_or(&[][..], |node| &node.deps);
            let normal = |kinds: &[cargo_metadata::DepKindInfo]| {
                kinds.iter().any(|dependency| dependency.kind == DependencyKind::Normal)
            };
            open.extend(deps.iter().filter(|dep| normal(&dep.dep_kinds)).map(|dep| &dep.pkg));
        }
    }
    linked
}

/// The licence texts in a crate's folder and in the folders right below, where vendored C sources have theirs.
fn texts(package: &Package) -> Result<String> {
    let folder = package.manifest_path.parent().context("a manifest has a folder")?;
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(fs::read_dir(&path)?.flatten().map(|entry| entry.path()));
        } else {
            files.push(path);
        }
    }
    files.retain(|path| path.is_file() && is_licence(path));
    files.sort();

    if files.is_empty() {
        return Ok(format!(
            "The crate has no licence text of its own. Authors: {}. Source: {}.",
            package.authors.join(", "),
            package.repository.as_deref().unwrap_or("crates.io"),
        ));
    }
    let read = |path| fs::read(path).map(|bytes| String::from_utf8_lossy(&bytes).trim().to_owned());
    Ok(files.iter().map(read).collect::<Result<Vec<_>, _>>()?.join("\n\n"))
}

fn is_licence(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let code = path
        .extension()
        .is_some_and(|extension| ["rs", "c", "h", "py", "sh"].iter().any(|code| extension == *code));
    !code && BEGINNINGS.iter().any(|beginning| name.starts_with(beginning))
}
