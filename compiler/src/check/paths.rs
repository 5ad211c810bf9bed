//! Paths: expressions that name something within another, as `plate.hole[2].wall`, and are not evaluated.

use super::context::Checker;
use super::typed::ExprKind;
use crate::syntax::ast;

/// A step of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Field(String),
    Index(i64),
}

/// A path as it is written: `plate.hole[2]`.
pub(super) fn text_of(steps: &[Step]) -> String {
    let mut text = String::new();
    for step in steps {
        match step {
            Step::Field(name) if text.is_empty() => text.push_str(name),
            Step::Field(name) => text.push_str(&format!(".{name}")),
            Step::Index(i) => text.push_str(&format!("[{i}]")),
        }
    }
    text
}

impl<'a> Checker<'a> {
    /// The steps of a path, as `plate.hole[2]`, if the expression is one.
    pub(super) fn steps_of(&mut self, path: &'a ast::Expr) -> Option<Vec<Step>> {
        let (mut steps, step) = match &path.kind {
            ast::ExprKind::Name(name) => return Some(vec![Step::Field(name.clone())]),
            ast::ExprKind::Field(of, field) => (self.steps_of(of)?, Step::Field(field.text.clone())),
            ast::ExprKind::Index(of, index) => {
                let steps = self.steps_of(of)?;
                let ExprKind::Int(i) = self.expr(index).kind else { return None };
                (steps, Step::Index(i))
            }
            _ => return None,
        };
        steps.push(step);
        Some(steps)
    }
}
