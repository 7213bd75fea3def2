//! Nesting depth of a source, computed from its tokens. The parser and the compiler recurse once per level, so a hostile
//! source would overflow the stack before they could refuse it.

use starlark_syntax::codemap::CodeMap;
use starlark_syntax::lexer::{Lexer, Token};

use super::{SOURCE_MAX_BYTES, dialect};

/// Greatest nesting of blocks, brackets and operators taken together.
const NESTING_MAX: usize = 150;

/// An error with its line if the source is nested too deeply. A source that is not Starlark passes: the
/// parser says what is wrong with it.
pub(super) fn check(source: &str) -> Result<(), (u32, String)> {
    debug_assert!(source.len() <= SOURCE_MAX_BYTES);
    let codemap = CodeMap::new(String::new(), source.to_owned());
    let mut depth = Depth::default();
    for token in Lexer::new(codemap.source(), &dialect(), codemap.clone()) {
        let Ok((start, token, _)) = token else { return Ok(()) };
        depth.take(&token);
        if depth.total() > NESTING_MAX {
            let before = source.get(..start).unwrap_or(source);
            let line = u32::try_from(before.matches('\n').count()).unwrap_or(u32::MAX).saturating_add(1);
            return Err((
                line,
                format!("nested more than {NESTING_MAX} deep: split it into several statements"),
            ));
        }
    }
    Ok(())
}

/// An upper bound of the depth of the syntax tree at the present token.
#[derive(Default)]
struct Depth {
    blocks: usize,
    /// An `elif` stands inside the `else` of the `if` before it.
    elifs: usize,
    outside: Level,
    brackets: Vec<Level>,
}

/// What stands between two brackets, so far.
#[derive(Default)]
struct Level {
    /// Operators since the last comma. Each may nest the next.
    operators: usize,
    /// The commas of a lambda's arguments end nothing.
    in_lambda: bool,
}

impl Depth {
    fn total(&self) -> usize {
        let brackets: usize = self.brackets.iter().map(|level| 1 + level.operators).sum();
        self.blocks + self.elifs + self.outside.operators + brackets
    }

    #[expect(
        clippy::wildcard_enum_match_arm,
        reason = "what is not named here counts, so new tokens are safe"
    )]
    fn take(&mut self, token: &Token) {
        match token {
            Token::Indent => self.blocks += 1,
            Token::Dedent => self.blocks = self.blocks.saturating_sub(1),
            Token::Newline | Token::Semicolon if self.brackets.is_empty() => self.outside = Level::default(),
            Token::OpeningRound | Token::OpeningSquare | Token::OpeningCurly => {
                // A call or an index nests what stands before it.
                self.level().operators += 1;
                self.brackets.push(Level::default());
            }
            Token::ClosingRound | Token::ClosingSquare | Token::ClosingCurly => drop(self.brackets.pop()),
            Token::Comma if !self.level().in_lambda => self.level().operators = 0,
            Token::Def if self.blocks == 0 => self.elifs = 0,
            Token::Elif => self.elifs += 1,
            Token::Lambda => {
                self.level().in_lambda = true;
                self.level().operators += 1;
            }
            token if stands_alone(token) => {}
            _ => self.level().operators += 1,
        }
    }

    fn level(&mut self) -> &mut Level {
        self.brackets.last_mut().unwrap_or(&mut self.outside)
    }
}

/// True for what nests nothing: values, and what stands between statements.
fn stands_alone(token: &Token) -> bool {
    matches!(
        token,
        Token::Identifier(_)
            | Token::Int(_)
            | Token::Float(_)
            | Token::String(_)
            | Token::Bytes(_)
            | Token::Newline
            | Token::Semicolon
            | Token::Comma
            | Token::Comment(_)
    )
}
