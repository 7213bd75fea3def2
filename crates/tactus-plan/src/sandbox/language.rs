//! Refuses operations that can make a value far larger than their operands and that no function can replace.

use starlark::syntax::AstModule;
use starlark::syntax::ast::{AssignOp, AstExpr, AstStmt, Expr, Stmt};

use super::line;

/// Refused methods and their replacements.
const REFUSED_METHODS: [(&str, &str); 4] = [
    ("extend", "write `a += b`"),
    ("format", "write `\"... %s ...\" % (a, b)`, or give `log` several values"),
    ("join", "give `log` several values"),
    ("replace", "experiment scripts do not edit texts"),
];

/// An error at the line of the first refused operation.
pub(super) fn check(ast: &AstModule) -> Result<(), (u32, String)> {
    let refused = find_in_statement(ast.statement());
    refused.map_or(Ok(()), |(span, problem)| Err((line(&ast.file_span(span)), problem)))
}

type Refused = (starlark::codemap::Span, String);

fn find_in_statement(statement: &AstStmt) -> Option<Refused> {
    if let Stmt::AssignModify(_, op, _) = &statement.node {
        let op = match op {
            AssignOp::Multiply => Some('*'),
            AssignOp::Percent => Some('%'),
            AssignOp::Add
            | AssignOp::Subtract
            | AssignOp::Divide
            | AssignOp::FloorDivide
            | AssignOp::BitAnd
            | AssignOp::BitOr
            | AssignOp::BitXor
            | AssignOp::LeftShift
            | AssignOp::RightShift => None,
        };
        if let Some(op) = op {
            return Some((statement.span, format!("`{op}=` is not available: write `a = a {op} b`")));
        }
    }
    let mut refused = None;
    statement.node.visit_expr(|expression| {
        if refused.is_none() {
            refused = find_in_expression(expression);
        }
    });
    statement.node.visit_stmt(|inner| {
        if refused.is_none() {
            refused = find_in_statement(inner);
        }
    });
    refused
}

fn find_in_expression(expression: &AstExpr) -> Option<Refused> {
    if let Expr::Dot(_, name) = &expression.node {
        let refused = REFUSED_METHODS.iter().find(|(method, _)| *method == name.node);
        if let Some((method, instead)) = refused {
            return Some((name.span, format!("`.{method}()` is not available: {instead}")));
        }
    }
    let mut refused = None;
    expression.node.visit_expr(|inner| {
        if refused.is_none() {
            refused = find_in_expression(inner);
        }
    });
    refused
}
