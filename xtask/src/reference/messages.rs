//! The page of keys and messages on the bus.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use tactus_schema::key::{Command, Topic};

use super::source::{doc, enumeration, read};

const PROTO: &str = "crates/tactus-schema/proto/tactus/v1/tactus.proto";

pub(super) fn page(top: &Path) -> Result<String> {
    let mut page = "All keys begin with `tactus/<rig>/`. Messages are protobuf, as `tactus.proto` defines them; recordings contain the same.\n\n\
                    ## Topics\n\nThe service publishes them. Subscribe to `KEY$*`, not to the plain key.\n\n| key | message |\n|---|---|\n"
        .to_owned();
    let keys = read(top, "crates/tactus-schema/src/key.rs")?;
    let rows =
        |name: &str, suffixes: &mut dyn Iterator<Item = &'static str>, page: &mut String| -> Result<()> {
            for (variant, suffix) in enumeration(&keys, name)?.variants.iter().zip(suffixes) {
                // Writing to a string cannot fail.
                let _written = writeln!(page, "| `{suffix}` | {} |", doc(&variant.attrs).replace('\n', " "));
            }
            Ok(())
        };
    rows("Topic", &mut Topic::ALL.into_iter().map(Topic::suffix), &mut page)?;
    let _written = write!(
        page,
        "\n## Commands\n\n{}\n\n| key | does |\n|---|---|\n",
        doc(&enumeration(&keys, "Command")?.attrs)
    );
    rows("Command", &mut Command::ALL.into_iter().map(Command::suffix), &mut page)?;
    let text = fs::read_to_string(top.join(PROTO)).with_context(|| format!("cannot read {PROTO}"))?;
    page.push_str(&definitions(&text)?);
    Ok(page)
}

/// A section for each message and enumeration of the definition, with its comments.
fn definitions(proto: &str) -> Result<String> {
    let mut page = String::new();
    let mut comment: Vec<&str> = Vec::new();
    for line in proto.lines().map(str::trim) {
        if let Some(words) = line.strip_prefix("//") {
            comment.push(words.trim());
            continue;
        }
        let said = comment.join(" ");
        if let Some(head) = line.strip_suffix('{') {
            let (kind, name) =
                head.trim().split_once(' ').with_context(|| format!("{line:?} has no name"))?;
            if kind == "oneof" {
                continue;
            }
            let heads = if kind == "enum" { "| value | number | is |" } else { "| field | type | is |" };
            let _written = write!(page, "\n## {name}\n\n{said}\n\n{heads}\n|---|---|---|\n");
        } else if let Some((left, number)) = line.strip_suffix(';').and_then(|line| line.split_once(" = ")) {
            match left.rsplit_once(' ') {
                Some((kind, name)) => {
                    let _written = writeln!(page, "| `{name}` | {} | {said} |", kind.replace('<', "&lt;"));
                }
                None if left == "syntax" => {}
                None => {
                    let _written = writeln!(page, "| `{left}` | {number} | {said} |");
                }
            }
        }
        comment.clear();
    }
    Ok(page)
}
