//! Direction of dependencies: a crate depends only on crates in rows above its own.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand};

/// The rows of ARCHITECTURE.md, top to bottom.
const ROWS: [&str; 32] = [
    "tactus-model",
    "tactus-solid",
    "tactus-scene",
    "tactus-schema",
    "tactus-calibrate",
    "tactus-discover",
    "tactus-wire",
    "tactus-safety",
    "tactus-plan",
    "tactus-device",
    "tactus-engine",
    "tactus-record",
    "tactus-import",
    "tactus-report",
    "tactus-runs",
    "tactus-bus",
    "tactus-live",
    "tactus-log",
    "tactus-work",
    "tactus-hidden",
    "tactus-virtual",
    "tactus-usbip",
    "tactus-sets",
    "tactus-mock",
    "tactus-runner",
    "tactus-daemon",
    "tactus-web",
    "tactus",
    "tactus-e2e",
    "tactus-examples",
    "tactus-bench",
    "xtask",
];

/// Crates that must not be direct dependencies of a crate.
const NEVER: [(&str, &[&str]); 9] = [
    ("tactus-model", &["tokio", "rand", "serde"]),
    ("tactus-solid", &["tokio", "rand", "serde"]),
    ("tactus-scene", &["tokio", "rand", "serde"]),
    ("tactus-calibrate", &["tokio", "rand"]),
    ("tactus-discover", &["tokio", "rand"]),
    ("tactus-wire", &["tokio", "rand"]),
    ("tactus-plan", &["tokio"]),
    ("tactus-safety", &["tokio", "rand"]),
    ("tactus-live", &["tokio"]),
];

/// Who may be built from the crates of `mock-devices`: the service embeds virtual devices with their hidden physics,
/// benchmarks score on sets, and only `tactus-mock` has all of it. `xtask` asks that program for its options.
const MAY_USE_MOCK: [(&str, &[&str]); 5] = [
    ("tactus-hidden", &["tactus-virtual", "tactus-sets", "tactus-mock", "tactus-bench"]),
    ("tactus-virtual", &["tactus-usbip", "tactus-mock", "tactus-runner", "tactus-bench"]),
    ("tactus-usbip", &["tactus-mock"]),
    ("tactus-sets", &["tactus-mock", "tactus-bench"]),
    ("tactus-mock", &["xtask"]),
];

fn metadata() -> Metadata {
    MetadataCommand::new()
        .manifest_path(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"))
        .exec()
        .unwrap()
}

/// Pairs of a workspace crate and one of its direct dependencies; development dependencies are left out.
fn edges(metadata: &Metadata) -> BTreeSet<(String, String)> {
    metadata
        .workspace_packages()
        .into_iter()
        .flat_map(|package| {
            let built_from =
                package.dependencies.iter().filter(|dep| dep.kind != DependencyKind::Development);
            built_from.map(|dep| (package.name.to_string(), dep.name.clone())).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn every_crate_has_its_row() {
    let named: BTreeSet<String> = ROWS.iter().map(ToString::to_string).collect();
    let there: BTreeSet<String> =
        metadata().workspace_packages().iter().map(|package| package.name.to_string()).collect();
    assert_eq!(named, there);
}

#[test]
fn dependencies_point_upwards() {
    let row = |name: &str| ROWS.iter().position(|row| *row == name);
    for (user, used) in edges(&metadata()) {
        if let (Some(user_row), Some(used_row)) = (row(&user), row(&used)) {
            assert!(used_row < user_row, "{user} is in a row above {used} and must not depend on it");
        }
    }
}

#[test]
fn production_crates_do_not_know_the_virtual_devices() {
    for (user, used) in edges(&metadata()) {
        for (of_mock, users) in MAY_USE_MOCK {
            assert!(used != of_mock || users.contains(&user.as_str()), "{user} depends on {used}");
        }
    }
}

#[test]
fn pure_crates_have_no_io_no_async_and_no_global_random_numbers() {
    let edges = edges(&metadata());
    for (user, forbidden) in NEVER {
        for used in forbidden {
            assert!(!edges.contains(&(user.to_owned(), (*used).to_owned())), "{user} depends on {used}");
        }
    }
}
