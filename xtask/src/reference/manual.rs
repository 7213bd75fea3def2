//! The manual pages: one for each program and for each command of it.

use std::path::Path;

use anyhow::Result;
use clap::Command;

use super::command_line::programs;
use super::{MANUAL, Made};

pub(super) fn pages() -> Result<Vec<Made>> {
    let mut pages = Vec::new();
    for program in programs() {
        write(&program, program.get_name(), &mut pages)?;
    }
    Ok(pages)
}

/// `name` is that of the page: the words of the command with hyphens.
fn write(command: &Command, name: &str, pages: &mut Vec<Made>) -> Result<()> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone()).source("Tactus").manual("Tactus").render(&mut text)?;
    let path = Path::new(MANUAL).join(format!("{name}.1"));
    pages.push(Made { path, text: String::from_utf8(text)? });
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help")
    {
        write(inner, &format!("{name}-{}", inner.get_name()), pages)?;
    }
    Ok(())
}
