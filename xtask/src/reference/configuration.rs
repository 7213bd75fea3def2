//! The page of all keys of configuration files.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use syn::{Fields, Type};

use super::drafts;
use super::source::{doc, enumeration, has_default, key, read, structure};

/// A table of a file: its heading, the source of its type and the type's name.
pub(super) struct Table {
    pub(super) heading: &'static str,
    source: &'static str,
    of: &'static str,
    /// Source and name of the checked type, which documents keys that the type itself does not.
    checked: Option<(&'static str, &'static str)>,
}

pub(super) const fn table(heading: &'static str, source: &'static str, of: &'static str) -> Table {
    Table { heading, source, of, checked: None }
}

impl Table {
    const fn checked(self, source: &'static str, of: &'static str) -> Self {
        Self { checked: Some((source, of)), ..self }
    }
}

const RUNNER: &str = "crates/tactus-runner/src/config.rs";
const CHECKED: &str = "crates/tactus-schema/src/rig.rs";
const RIG: &str = "crates/tactus-schema/src/rig/file.rs";
const SERVICE: &str = "crates/tactus-schema/src/rig/service.rs";
const STAGE: &str = "crates/tactus-schema/src/rig/stage.rs";
const TRANSPORT: &str = "crates/tactus-schema/src/rig/transport.rs";
const SIMULATION: &str = "crates/tactus-schema/src/rig/simulation.rs";
const ARRAY: &str = "crates/tactus-schema/src/description/array.rs";
const INDENTER: &str = "crates/tactus-schema/src/description/indenter.rs";
const MODEL: &str = "crates/tactus-schema/src/model/file.rs";

/// `tactusd.toml`.
const OF_SERVICE: [Table; 4] = [
    table("at the top", RUNNER, "RawConfig"),
    table("`[bus]`", RUNNER, "BusSection"),
    table("`[bus.tls]`", RUNNER, "TlsSection"),
    table("`[log]`", RUNNER, "LogSection"),
];

const OF_RIG: [Table; 18] = [
    table("at the top", RIG, "RawRig"),
    table("`[array]`", ARRAY, "RawArray"),
    table("`[registration]`", "crates/tactus-schema/src/rig/registration.rs", "RawRegistration"),
    table("`[psf]`", RIG, "RawPsf"),
    table("`[sensitivity_reference]`", RIG, "RawReference"),
    table("`[indenters.NAME]`", INDENTER, "RawIndenter"),
    table("`[covering]`", RIG, "RawCovering"),
    table("`[envelope]`", SERVICE, "RawEnvelope").checked(CHECKED, "Envelope"),
    table("`[motion]`", SERVICE, "RawMotion").checked(CHECKED, "Motion"),
    table("`[policy]`", SERVICE, "RawPolicy"),
    table("`[sensor]`", SERVICE, "RawSensorLink"),
    table("`[stage]`", STAGE, "RawStageLink"),
    table("`[stage] axes` of `grbl`, for x, y, z", STAGE, "RawGrblAxis").checked(STAGE, "GrblAxis"),
    table("`[stage] axes` of `zaber-ascii`, for x, y, z", STAGE, "RawZaberAxis").checked(STAGE, "ZaberAxis"),
    table("`transport`", TRANSPORT, "RawTransport"),
    table("`transport.usb`", TRANSPORT, "RawIdentity"),
    table("`[simulation]`", SIMULATION, "RawSimulation").checked(CHECKED, "Simulation"),
    table("`[simulation.stage]`", SIMULATION, "RawSimulatedStage").checked(CHECKED, "SimulatedStage"),
];

const OF_MODEL: [Table; 5] = [
    table("at the top", MODEL, "RawModel"),
    table("`[base]`", MODEL, "RawBase"),
    table("`[base.psf]`", MODEL, "RawPsf"),
    table("`[base.sensitivity_reference]`", MODEL, "RawReference"),
    table("`[[effect]]`", MODEL, "RawEffect"),
];

pub(super) fn page(top: &Path) -> Result<String> {
    let mut page = "Files are TOML. Unknown keys are refused; `tactus validate FILE` checks a file and names the line or key that is wrong. \
                    The unit of a key is the last word of its name. A key may be left out unless it is marked as needed.\n"
        .to_owned();
    section(
        top,
        &mut page,
        "The service",
        "The file of `tactusd --config FILE`.",
        &OF_SERVICE,
        "config/tactusd.toml",
    )?;
    section(
        top,
        &mut page,
        "Rigs",
        "A rig file: the array with its covering, and the stage with its tool.",
        &OF_RIG,
        "config/rigs/sim.toml",
    )?;
    section(
        top,
        &mut page,
        "Models",
        "A model file: a sensor's numbers and its effects. `tactus calibrate` and `tactus discover` write it.",
        &OF_MODEL,
        "config/models/digitacts.toml",
    )?;
    page.push_str(&drafts::section(top)?);
    let frames = doc(&read(top, "crates/tactus-wire/src/declared.rs")?.attrs);
    let start = frames.find("```toml").context("declared.rs explains the keys")?;
    let end = frames[start + 3..].find("```").context("the example ends")? + start + 6;
    let _written = write!(
        page,
        "\n## Frame formats\n\nThe description of a sensor's frames, for `protocol = \"declared\"`: [your own sensor](../how-to/sensor.md).\n\n\
         {}\n\n`[hid] report_id` and `[usb] interface, endpoint` can say where the frames come from. Negative offsets count from the\n\
         frame's end.\n",
        &frames[start..end]
    );
    Ok(page)
}

fn section(
    top: &Path,
    page: &mut String,
    title: &str,
    what: &str,
    tables: &[Table],
    shipped: &str,
) -> Result<()> {
    // Writing to a string cannot fail.
    let _written = write!(page, "\n## {title}\n\n{what}\n");
    all_rows(top, page, title, tables)?;
    let text = fs::read_to_string(top.join(shipped)).with_context(|| format!("cannot read {shipped}"))?;
    let _written =
        write!(page, "\n### {title}: a whole file\n\n`{shipped}`:\n\n```toml\n{}\n```\n", text.trim());
    Ok(())
}

/// The keys of each of these types, under a heading.
pub(super) fn all_rows(top: &Path, page: &mut String, title: &str, tables: &[Table]) -> Result<()> {
    for table in tables {
        // Writing to a string cannot fail.
        let _written = write!(page, "\n### {title}: {}\n\n", table.heading);
        page.push_str(&rows(top, table).with_context(|| format!("{} in {}", table.of, table.source))?);
    }
    Ok(())
}

/// The keys of a type.
fn rows(top: &Path, table: &Table) -> Result<String> {
    let file = read(top, table.source)?;
    let mut out = String::new();
    if let Ok(found) = structure(&file, table.of) {
        let checked = table.checked.map(|(source, of)| documented(top, source, of)).transpose()?;
        keys(&found.fields, &checked.unwrap_or_default(), &mut out)?;
        return Ok(out);
    }
    let found = enumeration(&file, table.of)?;
    for variant in &found.variants {
        let name = kebab(&variant.ident.to_string());
        let said = doc(&variant.attrs).replace('\n', " ");
        ensure!(!said.is_empty(), "{name} has no doc comment");
        let _written = write!(out, "`\"{name}\"`: {said}\n\n");
        if !variant.fields.is_empty() {
            keys(&variant.fields, &BTreeMap::new(), &mut out)?;
            out.push('\n');
        }
    }
    Ok(out)
}

/// What a type says of its fields.
fn documented(top: &Path, source: &str, of: &str) -> Result<BTreeMap<String, String>> {
    let file = read(top, source)?;
    let fields = structure(&file, of)?.fields.iter();
    Ok(fields.filter_map(|field| Some((field.ident.as_ref()?.to_string(), doc(&field.attrs)))).collect())
}

fn keys(fields: &Fields, checked: &BTreeMap<String, String>, out: &mut String) -> Result<()> {
    out.push_str("| key | is | |\n|---|---|---|\n");
    for field in fields {
        let name = key(field).context("a key has a name")?;
        let own = doc(&field.attrs);
        let said = if own.is_empty() { checked.get(&name).cloned().unwrap_or_default() } else { own };
        let said = said.replace('\n', " ");
        ensure!(!said.is_empty(), "the key {name} has no doc comment");
        let mark = if is_optional(&field.ty) || has_default(field) { "" } else { "needed" };
        let _written = writeln!(out, "| `{name}` | {} | {mark} |", said.replace('|', "\\|"));
    }
    Ok(())
}

fn is_optional(kind: &Type) -> bool {
    let Type::Path(kind) = kind else { return false };
    kind.path.segments.last().is_some_and(|last| last.ident == "Option")
}

/// `ZaberAscii` is `zaber-ascii`.
fn kebab(name: &str) -> String {
    let mut out = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !out.is_empty() {
            out.push('-');
        }
        out.extend(letter.to_lowercase());
    }
    out
}
