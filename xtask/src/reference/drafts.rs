//! The section of the draft file: its keys, and the words that it knows.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use syn::Variant;
use tactus_model::Covariate;
use tactus_model::effect::{Carrier, When};
use tactus_schema::draft::DraftStatus;

use super::configuration::{Table, all_rows, table};
use super::source::{doc, enumeration, read};

const FILE: &str = "crates/tactus-schema/src/draft.rs";
const EFFECT: &str = "crates/tactus-model/src/effect/draft.rs";

const KEYS: [Table; 6] = [
    table("at the top", FILE, "RawFile"),
    table("`[effect]`", FILE, "RawDraft"),
    table("`[[effect.covariate]]`", FILE, "RawCovariate"),
    table("`[[nearest]]`", FILE, "Nearest"),
    table("`[evidence]`", FILE, "DraftEvidence"),
    table("`[confirmation]`", FILE, "DraftConfirmation"),
];

pub(super) fn section(top: &Path) -> Result<String> {
    let mut page = "\n## Drafts: `tactus.draft/1`\n\nA draft is an effect that no class of the library names, as a TOML file: `tactus discover` writes it, `tactus effects` keeps it, and \
                    [your own effect](../how-to/effect.md) says how it is used. Unknown keys are refused, with the line. A model file holds the table \
                    `[effect]` whole, as `[effect.draft]`.\n\n\
                    A draft that was only stated, by hand, needs `schema`, `status = \"drafted\"` and `[effect]`. One with a covariance or nearest classes \
                    needs `[evidence]`, and one that is confirmed or refuted needs `[confirmation]`: else the file has lost its end.\n"
        .to_owned();
    all_rows(top, &mut page, "Drafts", &KEYS)?;
    page.push_str("\n### Drafts: `status`\n\n| word | means |\n|---|---|\n");
    for status in DraftStatus::ALL {
        // Writing to a string cannot fail.
        let _written = writeln!(page, "| `{}` | {} |", status.name(), status.meaning());
    }
    page.push_str("\n### Drafts: `carrier`, what the curve is added to\n\n| carrier | unit of the curve | stage |\n|---|---|---|\n");
    for carrier in Carrier::ALL {
        let stages = [Covariate::Depth, Covariate::Signal]
            .map(|one| tactus_schema::draft::stage_name(carrier.stage(&[one])));
        let stage = if stages[0] == stages[1] {
            stages[0].to_owned()
        } else {
            format!("{}; {} if it depends on signals alone", stages[0], stages[1])
        };
        let _written = writeln!(page, "| `{}` | {} | {stage} |", carrier.name(), carrier.unit());
    }
    let source = doc(&read(top, EFFECT)?.attrs);
    let meanings = source
        .split("| carrier | stage | the curve is |")
        .nth(1)
        .context("draft.rs says what a carrier is")?;
    let _written = write!(page, "\nWhat the curve is:\n\n| carrier | stage | the curve is |{meanings}\n");
    let when: Vec<String> = When::ALL.iter().map(|when| format!("`{}`", when.name())).collect();
    let _written = write!(page, "\n### Drafts: `when` it acts\n\nOne of {}.\n", when.join(", "));
    page.push_str("\n### Drafts: covariates, what the curve is a function of\n\nOne or two. A carrier of the stage `motion` takes none of an element or of signals, and only the carrier `counts` takes `counts`.\n\n| covariate | unit | |\n|---|---|---|\n");
    for covariate in Covariate::ALL {
        let each = if covariate.is_of_element() { "of each element" } else { "" };
        let _written = writeln!(page, "| `{}` | {} | {each} |", covariate.name(), covariate.unit());
    }
    page.push_str("\n### Drafts: `law`, the curve\n\nOf one covariate `x`; a table of one or two. Beyond the range of a covariate the curve keeps its last value.\n\n| law | numbers | is |\n|---|---|---|\n");
    for variant in &enumeration(&read(top, EFFECT)?, "Law")?.variants {
        page.push_str(&law(variant)?);
    }
    Ok(page)
}

/// A law with the names of its numbers and its formula.
fn law(variant: &Variant) -> Result<String> {
    let formula = doc(&variant.attrs).replace('\n', " ");
    ensure!(!formula.is_empty(), "the law {} has no formula", variant.ident);
    let numbers: Vec<String> =
        variant.fields.iter().filter_map(|field| Some(format!("`{}`", field.ident.as_ref()?))).collect();
    Ok(format!("| `{}` | {} | {formula} |\n", variant.ident.to_string().to_lowercase(), numbers.join(", ")))
}
