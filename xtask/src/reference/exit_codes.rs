//! The page of exit codes.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use syn::{Expr, Lit};

use super::source::{doc, enumeration, read};

pub(super) fn page(top: &Path) -> Result<String> {
    let file = read(top, "crates/tactus/src/exit.rs")?;
    let mut page = "How every command of `tactus` ends. With `--json` an error is one object with `error` and `exit_code`.\n\n\
                    | code | means |\n|---|---|\n"
        .to_owned();
    for variant in &enumeration(&file, "Exit")?.variants {
        let (_, value) = variant.discriminant.as_ref().context("an exit code has a number")?;
        let Expr::Lit(value) = value else { anyhow::bail!("an exit code is a number") };
        let Lit::Int(code) = &value.lit else { anyhow::bail!("an exit code is a whole number") };
        let meaning = doc(&variant.attrs).replace('\n', " ");
        ensure!(!meaning.is_empty(), "exit code {code} has no doc comment");
        // Writing to a string cannot fail.
        let _written = writeln!(page, "| {code} | {meaning} |");
    }
    Ok(page)
}
