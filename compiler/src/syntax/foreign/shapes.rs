//! Shapes as OpenSCAD and Python build them: moved by a word before them, combined as solids.

use super::super::token::Token;
use super::Slip;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// Transformations of shapes: OpenSCAD writes them before a shape, this language as methods after it.
const MOVES: [&str; 6] = ["translate", "rotate", "scale", "mirror", "transform", "resize"];

impl Slip<'_, '_> {
    /// `translate(...) sphere(3mm)`.
    pub(super) fn second_shape(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let before = self.back(1).filter(|i| self.token(*i) == Some(Token::ParenClose))?;
        let moved = self.text(self.opening(before)?.checked_sub(1)?);
        let two = self.expected.operator() && self.token(self.here() + 1) == Some(Token::ParenOpen);
        (two && MOVES.contains(&moved)).then(|| {
            self.error(span, "a shape is moved by a method after it").hint(format!("write '{word}(...).{moved}(...)'"))
        })
    }

    /// A statement that begins with a call of OpenSCAD or Python.
    pub(super) fn shape_of_another_language(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let called = self.token(self.here() + 1) == Some(Token::ParenOpen);
        Some(match word {
            "union" | "difference" | "intersection" | "hull" | "minkowski" if called => {
                let message = format!("there is no '{word}': solids are joined and cut by operators");
                self.error(span, message).hint("write 'part NAME = a + b', 'a - b' or 'a & b'")
            }
            "echo" | "print" | "println" if called => self.error(span, "a script cannot print").hint(
                "use `gmlc repl` to see the values of expressions, and 'require' to reject values that make no sense",
            ),
            _ if called && MOVES.contains(&word) => self
                .error(span, "a shape needs a name, and is moved by a method after it")
                .hint(format!("write 'part NAME = sphere(3mm).{word}(...)'")),
            "with" => self
                .error(span, "'with' is not a keyword")
                .hint("a model is written 'model NAME { ... }', and its surfaces 'part NAME = ...'"),
            _ => return None,
        })
    }

    /// Whether the statement is in a model or block.
    pub(super) fn in_braces(&self) -> bool {
        let depth = (0..self.start).fold(0_i64, |depth, i| match self.token(i) {
            Some(Token::BraceOpen) => depth + 1,
            Some(Token::BraceClose) => depth - 1,
            _ => depth,
        });
        depth > 0
    }
}
