//! The sandbox: language restrictions and bounds that the evaluator does not have itself.
//!
//! The evaluator counts loop turns and calls and checks memory and time once in a thousand of them. That is too late
//! for a single operation that makes a huge value. Therefore the size of the source ([`SOURCE_MAX_BYTES`]) and its
//! nesting are bounded before it is parsed, operators that can make a value much larger than their operands are
//! replaced by functions that measure first (`operators`), and operations that cannot be replaced are refused with
//! their line (`language`).

mod globals;
mod language;
mod nesting;
mod operators;
mod text;

use std::num::NonZeroU32;

use starlark::codemap::FileSpan;
use starlark::syntax::{AstModule, Dialect};

use crate::{Location, ScriptError};

pub(crate) use globals::GLOBALS;
pub(crate) use text::{Numbers, SEQUENCE_MAX, write_text};

/// Longest source, in bytes.
pub(crate) const SOURCE_MAX_BYTES: usize = 256 << 10;

/// Parses and checks a script, and replaces its operators by functions that measure first.
pub(crate) fn parse(name: &str, source: &str) -> Result<AstModule, ScriptError> {
    let at = |line, column| Location { script: name.to_owned(), line, column };
    let syntax = |line, problem| ScriptError::Syntax { at: at(line, None), problem };
    if source.len() > SOURCE_MAX_BYTES {
        let problem = format!("a script of {} bytes, the limit is {SOURCE_MAX_BYTES}", source.len());
        return Err(syntax(1, problem));
    }
    nesting::check(source).map_err(|(line, problem)| syntax(line, problem))?;
    let mut ast =
        AstModule::parse(&format!("{name}.star"), source.to_owned(), &dialect()).map_err(|error| {
            let problem = error.without_diagnostic().to_string();
            let (line, column) = error.span().map_or((1, None), |span| (line(span), column(span)));
            let problem = problem.trim_start_matches("Parse error: ").to_owned();
            ScriptError::Syntax { at: at(line, column), problem }
        })?;
    language::check(&ast).map_err(|(line, problem)| syntax(line, problem))?;
    ast.replace_binary_operators(&operators::replacements());
    Ok(ast)
}

/// First line of a span, from 1.
pub(crate) fn line(span: &FileSpan) -> u32 {
    u32::try_from(span.resolve_span().begin.line).unwrap_or(u32::MAX).saturating_add(1)
}

/// First column of a span, from 1.
pub(crate) fn column(span: &FileSpan) -> Option<NonZeroU32> {
    NonZeroU32::new(u32::try_from(span.resolve_span().begin.column).ok()?.saturating_add(1))
}

fn dialect() -> Dialect {
    Dialect {
        enable_load: false,
        enable_keyword_only_arguments: true,
        enable_top_level_stmt: true,
        enable_f_strings: false,
        ..Dialect::Standard
    }
}

#[cfg(test)]
#[path = "sandbox_tests.rs"]
mod tests;
