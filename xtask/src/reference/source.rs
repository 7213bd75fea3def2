//! What Rust sources say in doc comments and types.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use syn::{Attribute, Expr, ExprLit, Field, File, Item, ItemEnum, ItemStruct, Lit, Meta};

/// A source file, relative to the repository.
pub(super) fn read(top: &Path, path: &str) -> Result<File> {
    let text = fs::read_to_string(top.join(path)).with_context(|| format!("cannot read {path}"))?;
    syn::parse_file(&text).with_context(|| format!("{path} does not parse"))
}

pub(super) fn structure<'a>(file: &'a File, name: &str) -> Result<&'a ItemStruct> {
    for item in &file.items {
        if let Item::Struct(found) = item
            && found.ident == name
        {
            return Ok(found);
        }
    }
    bail!("no struct {name}")
}

pub(super) fn enumeration<'a>(file: &'a File, name: &str) -> Result<&'a ItemEnum> {
    for item in &file.items {
        if let Item::Enum(found) = item
            && found.ident == name
        {
            return Ok(found);
        }
    }
    bail!("no enum {name}")
}

/// The doc comment in its lines.
pub(super) fn doc(attributes: &[Attribute]) -> String {
    let lines: Vec<String> = attributes.iter().filter_map(doc_line).collect();
    without_paths(lines.join("\n").trim())
}

fn doc_line(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else { return None };
    let Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) = &pair.value else { return None };
    let text = pair.path.is_ident("doc").then(|| text.value())?;
    Some(text.strip_prefix(' ').unwrap_or(&text).to_owned())
}

/// The text with links to items of the code as plain names: ``[`crate::pb::Frame`]`` is `Frame`.
fn without_paths(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("[`") {
        let Some((name, after)) = after.split_once("`]") else { break };
        out.push_str(before);
        let short = name.rsplit("::").next().unwrap_or(name);
        for part in ["`", short, "`"] {
            out.push_str(part);
        }
        rest = after.strip_prefix('(').and_then(|link| link.split_once(')')).map_or(after, |(_, rest)| rest);
    }
    out.push_str(rest);
    out
}

/// True if serde fills the field in where the file lacks it.
pub(super) fn has_default(field: &Field) -> bool {
    serde_words(field).any(|word| word.starts_with("default"))
}

/// The field's name in the file.
pub(super) fn key(field: &Field) -> Option<String> {
    let renamed = serde_words(field)
        .find_map(|word| Some(word.strip_prefix("rename = \"")?.trim_end_matches('"').to_owned()));
    renamed.or_else(|| Some(field.ident.as_ref()?.to_string()))
}

/// The arguments of a field's `#[serde(...)]`.
fn serde_words(field: &Field) -> impl Iterator<Item = String> {
    let list = |attribute: &Attribute| {
        let Meta::List(list) = &attribute.meta else { return None };
        list.path.is_ident("serde").then(|| list.tokens.to_string())
    };
    let lists: Vec<String> = field.attrs.iter().filter_map(list).collect();
    lists.into_iter().flat_map(|list| list.split(',').map(|word| word.trim().to_owned()).collect::<Vec<_>>())
}
