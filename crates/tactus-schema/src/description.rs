//! The parts that the rig file and the model file share: arrays, indenters, values of elements.
//!
//! A raw type mirrors the file; its `check` takes the path of its field in the file, for errors.

mod array;
mod indenter;
mod number;
mod one_or_each;

pub(crate) use array::RawArray;
pub(crate) use indenter::RawIndenter;
pub(crate) use number::{LARGEST, finite, not_negative, positive, range};
pub(crate) use one_or_each::OneOrEach;

/// A wrong field; becomes the variant `Field` of each file's error.
#[derive(Debug)]
pub(crate) struct WrongField {
    /// Path of the field.
    pub(crate) field: String,
    /// What is wrong with it, and what would be right.
    pub(crate) problem: String,
}

pub(crate) fn wrong(field: impl Into<String>, problem: impl Into<String>) -> WrongField {
    WrongField { field: field.into(), problem: problem.into() }
}

/// The schema that the text of a TOML file states: the value of its key `schema`, before any table.
pub fn stated_schema(text: &str) -> Option<&str> {
    let top = text.lines().map(str::trim_start).take_while(|line| !line.starts_with('['));
    top.filter_map(|line| line.strip_prefix("schema")?.trim_start().strip_prefix('='))
        .find_map(|value| value.split(['"', '\'']).nth(1))
}

/// Refuses the text of a TOML file of another schema, before its fields are looked at: of another kind of file all would be unknown. A text
/// that states none is for the parser, which knows all ways to write a key.
pub(crate) fn check_kind(read: &str, text: &str) -> Result<(), WrongField> {
    stated_schema(text).map_or(Ok(()), |stated| check_schema(read, stated))
}

/// Refuses a file of another schema or version.
pub(crate) fn check_schema(read: &str, stated: &str) -> Result<(), WrongField> {
    if stated == read {
        Ok(())
    } else {
        let is_draft_for_model = (read, stated) == (crate::model::SCHEMA, crate::draft::SCHEMA);
        let hint = if is_draft_for_model {
            "; a draft acts in a model: discovery wrote model.toml beside it"
        } else {
            ""
        };
        Err(wrong("schema", format!("this program reads {read:?} here, not {stated:?}{hint}")))
    }
}
