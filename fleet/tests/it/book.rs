//! The page of the book on fleets: its commands, as a reader types them. `tests/e2e/book.rs` does the other pages.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::{env, fs, os::unix::fs::PermissionsExt as _, path::Path, process::Command};

use crate::lab::Lab;

const PAGE: &str = include_str!("../../../docs/book/how-to/fleet.md");
const MODEL: &str = include_str!("../../../config/models/digitacts.toml");

#[test]
fn the_commands_of_the_page_do_what_it_says() {
    let lab = Lab::with_three_runs();
    let programs = lab.path("programs");
    fs::create_dir(&programs).unwrap();
    // `tactus fleet` hands over to the program; the rest of `tactus` is not built here.
    let tactus = programs.join("tactus");
    let program = env!("CARGO_BIN_EXE_tactus-fleet");
    fs::write(&tactus, format!("#!/bin/sh\n[ \"$1\" = fleet ] && shift && exec {program} \"$@\"\n")).unwrap();
    fs::set_permissions(&tactus, fs::Permissions::from_mode(0o755)).unwrap();
    let models = lab.path("config/models");
    fs::create_dir_all(&models).unwrap();
    fs::write(models.join("digitacts.toml"), MODEL).unwrap();
    let mut blocks = 0;
    let mut rest = PAGE;
    while let Some((_, after)) = rest.split_once("```sh by=fleet") {
        let (info, after) = after.split_once('\n').unwrap();
        let (block, after) = after.split_once("```").unwrap();
        let code = info.trim().strip_prefix("exit=").map_or(0, |code| code.parse().unwrap());
        assert_eq!(run(block, &lab.path(""), &programs), Some(code), "{block}");
        (rest, blocks) = (after, blocks + 1);
    }
    assert!(blocks > 0, "the page has commands");
}

/// Runs a block and returns its exit code.
fn run(block: &str, folder: &Path, programs: &Path) -> Option<i32> {
    let known = env::var_os("PATH").unwrap();
    let path = [programs.to_owned()].into_iter().chain(env::split_paths(&known));
    let mut shell = Command::new("bash");
    shell.args(["-euo", "pipefail", "-c", block]).current_dir(folder);
    shell.env("PATH", env::join_paths(path).unwrap()).status().unwrap().code()
}
