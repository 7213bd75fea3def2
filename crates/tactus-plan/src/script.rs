//! An experiment script: parsed and checked, not yet run.

use std::fmt;
use std::slice;
use std::sync::Arc;

use sha2::{Digest, Sha256};
use starlark::syntax::AstModule;
use starlark::syntax::ast::{AstLiteral, AstStmt, Expr, Stmt};

use crate::evaluate::{Evaluated, Purpose};
use crate::execute::converse;
use crate::{
    Arguments, Call, Host, Location, Parameter, Refusal, Reply, RigView, ScriptError, ScriptLimits, sandbox,
};

/// An experiment script.
#[derive(Clone)]
pub struct Script {
    name: String,
    source: Arc<str>,
    sha256: String,
    doc: String,
    run_line: u32,
    ast: AstModule,
}

/// Longest name of a script.
const NAME_MAX_BYTES: usize = 64;

impl Script {
    /// Parses a script. `name` appears in locations and file names; a suffix `.star` is dropped.
    ///
    /// # Errors
    /// [`ScriptError::Syntax`] with the line: not Starlark, nested too deeply, something that experiment
    /// scripts may not use, or no `def run(rig):`.
    pub fn parse(name: &str, source: &str) -> Result<Self, ScriptError> {
        let name = name.strip_suffix(".star").unwrap_or(name).to_owned();
        // The name becomes part of run ids and so of paths.
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > NAME_MAX_BYTES || !name.chars().all(is_plain) {
            return Err(ScriptError::Malformed(format!(
                "{name:?} is no name for an experiment: letters, digits, '-' and '_', at most {NAME_MAX_BYTES}"
            )));
        }
        let ast = sandbox::parse(&name, source)?;
        let Some(run_line) = definition_line(&ast, "run") else {
            let at = Location { script: name, line: 1, column: None };
            return Err(ScriptError::Syntax { at, problem: "there is no `def run(rig):`".into() });
        };
        Ok(Self {
            name,
            source: source.into(),
            sha256: hexadecimal(&Sha256::digest(source)),
            doc: docstring(ast.statement()).unwrap_or_default(),
            run_line,
            ast,
        })
    }

    /// The script's name, without the suffix.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The script's text.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// SHA-256 of the text, in hexadecimal.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The script's docstring: its first statement, if that is a text. The first line is the summary.
    pub fn doc(&self) -> &str {
        &self.doc
    }

    /// The first line of [`doc`](Self::doc).
    pub fn summary(&self) -> &str {
        self.doc.lines().next().unwrap_or_default()
    }

    /// The parameters in the order of their declarations. Evaluates the script's top level only.
    ///
    /// # Errors
    /// [`ScriptError`] if the top level fails.
    pub fn parameters(&self, rig: &RigView) -> Result<Vec<Parameter>, ScriptError> {
        Ok(declare(self, &Arguments::default(), rig, &ScriptLimits::default(), &|| false)?.parameters)
    }

    pub(crate) fn ast(&self) -> &AstModule {
        &self.ast
    }

    /// The line of `def run`.
    pub(crate) fn run_line(&self) -> u32 {
        self.run_line
    }
}

impl fmt::Debug for Script {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Script")
            .field("name", &self.name)
            .field("sha256", &self.sha256)
            .finish_non_exhaustive()
    }
}

/// The values that a script would see; evaluates its top level only.
pub(crate) fn resolve(
    script: &Script,
    arguments: &Arguments,
    rig: &RigView,
    limits: &ScriptLimits,
    stopped: &dyn Fn() -> bool,
) -> Result<Arguments, ScriptError> {
    Ok(declare(script, arguments, rig, limits, stopped)?.values)
}

/// The declarations of a script's top level, which is all that is evaluated.
pub(crate) fn declare(
    script: &Script,
    arguments: &Arguments,
    rig: &RigView,
    limits: &ScriptLimits,
    stopped: &dyn Fn() -> bool,
) -> Result<Evaluated, ScriptError> {
    converse(script, arguments, rig, limits, Purpose::Declare, &mut NoHost(stopped))
}

/// The host of an evaluation without steps.
struct NoHost<'a>(&'a dyn Fn() -> bool);

impl Host for NoHost<'_> {
    fn perform(&mut self, _call: &Call) -> Result<Reply, Refusal> {
        Err(Refusal::Failed("nothing is performed while parameters are declared".into()))
    }

    fn cancelled(&self) -> bool {
        self.0()
    }
}

fn definition_line(ast: &AstModule, name: &str) -> Option<u32> {
    let is_definition =
        |statement: &&AstStmt| matches!(&statement.node, Stmt::Def(def) if def.name.node.ident == name);
    let definition = statements(ast.statement()).iter().find(is_definition)?;
    Some(sandbox::line(&ast.file_span(definition.span)))
}

fn docstring(statement: &AstStmt) -> Option<String> {
    let Stmt::Expression(expression) = &statements(statement).first()?.node else { return None };
    let Expr::Literal(AstLiteral::String(text)) = &expression.node else { return None };
    let lines: Vec<_> = text.node.trim().lines().map(str::trim_end).collect();
    Some(lines.join("\n"))
}

/// The statements of a block; a single statement counts as a block.
fn statements(block: &AstStmt) -> &[AstStmt] {
    if let Stmt::Statements(statements) = &block.node { statements } else { slice::from_ref(block) }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

#[cfg(test)]
#[path = "script_tests.rs"]
mod tests;
