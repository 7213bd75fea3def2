//! The page of the library of effects: what each module's documentation says.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Result, ensure};
use tactus_model::effect::REGISTRY;
use tactus_schema::draft::stage_name;

use super::source::{doc, read};

pub(super) fn page(top: &Path) -> Result<String> {
    let mut page = format!(
        "The library has {} effects. `tactus effects show NAME` prints one. An effect acts in one stage of the\n\
         [model](../explanation/model.md); `u_e` is the depth in mm that element e feels.\n\n| effect | stage | is |\n|---|---|---|\n",
        REGISTRY.len()
    );
    for effect in REGISTRY {
        let (name, stage) = (effect.name, stage_name(effect.stage()));
        // Writing to a string cannot fail.
        let _written = writeln!(page, "| [{name}](#{name}) | {stage} | {} |", effect.summary);
    }
    for effect in REGISTRY {
        let path = format!("crates/tactus-model/src/effect/{}.rs", effect.name.replace('-', "_"));
        let text = doc(&read(top, &path)?.attrs);
        ensure!(!text.is_empty(), "{path} has no documentation");
        let text: Vec<String> = text.lines().map(as_part).collect();
        let list =
            |names: &[&str]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let covariates: Vec<&str> = effect.acts_by.iter().map(|covariate| covariate.name()).collect();
        let by = if covariates.is_empty() {
            String::new()
        } else {
            format!("Acts by: {}. ", covariates.join(", "))
        };
        let _written = write!(
            page,
            "\n## {}\n\n{}\n\n{by}Near twins: {}. Shown by: {}.\n",
            effect.name,
            text.join("\n"),
            list(effect.near_twins),
            list(effect.shown_by)
        );
    }
    Ok(page)
}

/// A line of a module's documentation below a heading of the page.
fn as_part(line: &str) -> String {
    match line.strip_prefix("# ") {
        Some(heading) => format!("**{heading}**\n"),
        None => line.to_owned(),
    }
}
