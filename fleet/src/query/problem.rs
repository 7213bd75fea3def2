//! Why a query has no answer, for who wrote it.

use std::fmt;

use datafusion::{
    common::{Column, Diagnostic, SchemaError},
    error::DataFusionError,
    sql::sqlparser::parser::ParserError,
};

use super::session::TABLES;
use crate::{Place, run_head::Described};

/// What is wrong, and where in the query.
#[derive(Debug, PartialEq, Eq)]
struct Problem {
    what: String,
    /// The line of the query, and the column in it, from 1.
    at: Option<(String, usize)>,
}

/// What is wrong with a query, in words.
pub(super) async fn in_words(error: DataFusionError, place: &Place, sql: &str) -> anyhow::Error {
    let root = error.find_root();
    // The library does not say in which file.
    if matches!(root, DataFusionError::ParquetError(_))
        && let Err(unreadable) = Described::all(place).await
    {
        return anyhow::Error::new(unreadable);
    }
    // The causes are in the error itself.
    if matches!(root, DataFusionError::External(_)) {
        return anyhow::Error::new(error);
    }
    anyhow::Error::new(Problem::of(root, error.diagnostic(), sql))
}

impl Problem {
    fn of(root: &DataFusionError, diagnostic: Option<&Diagnostic>, sql: &str) -> Self {
        let place = diagnostic.and_then(|told| told.span).map(|span| (span.start.line, span.start.column));
        #[expect(
            clippy::wildcard_enum_match_arm,
            reason = "the library's own words do for the others, and for those that it adds"
        )]
        let (what, place) = match root {
            DataFusionError::SQL(parser, _) => with_place(match parser.as_ref() {
                ParserError::TokenizerError(told) | ParserError::ParserError(told) => told.clone(),
                ParserError::RecursionLimitExceeded => "the query is nested too deep".to_owned(),
            }),
            DataFusionError::SchemaError(schema, _) => (of_schema(schema), place),
            DataFusionError::ResourcesExhausted(told) => (
                format!(
                    "the query needs more memory or disk than it may take. Allow more with --memory, or room with --spill: {told}"
                ),
                None,
            ),
            DataFusionError::Plan(told) => (of_plan(told), place),
            root => (root.message().into_owned(), place),
        };
        let at = place.and_then(|(line, column)| {
            let text = sql.lines().nth(usize::try_from(line).ok()?.checked_sub(1)?)?;
            Some((text.to_owned(), usize::try_from(column).ok()?))
        });
        Self { what, at }
    }
}

/// Text of the parser, which says the place in words.
fn with_place(told: String) -> (String, Option<(u64, u64)>) {
    let place = told.rsplit_once(" at Line: ").and_then(|(what, place)| {
        let (line, column) = place.split_once(", Column: ")?;
        Some((what.to_owned(), (line.parse().ok()?, column.trim().parse().ok()?)))
    });
    place.map_or((told, None), |(what, place)| (what, Some(place)))
}

fn of_plan(told: &str) -> String {
    let table = told.strip_prefix("table '").and_then(|rest| rest.strip_suffix("' not found"));
    table.map_or_else(
        || told.to_owned(),
        |table| {
            let name = table.rsplit('.').next().unwrap_or(table);
            format!("there is no table {name}. There are {}", TABLES.join(", "))
        },
    )
}

fn of_schema(error: &SchemaError) -> String {
    match error {
        SchemaError::FieldNotFound { field, valid_fields } => {
            let names: Vec<String> = valid_fields.iter().map(Column::quoted_flat_name).collect();
            format!("there is no column {}. There are {}", field.quoted_flat_name(), names.join(", "))
        }
        SchemaError::AmbiguousReference { .. }
        | SchemaError::DuplicateQualifiedField { .. }
        | SchemaError::DuplicateUnqualifiedField { .. } => error.to_string(),
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        match &self.at {
            Some((line, column)) => write!(f, "\n  {line}\n  {:>column$}", "^"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Problem {}
