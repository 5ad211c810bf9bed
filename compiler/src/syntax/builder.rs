//! Makes the nodes of the tree for the grammar's actions.
//!
//! Every node knows its depth. One that would lie deeper than [`NESTING_LIMIT`] is replaced by an error node, so that
//! walking, printing and dropping a tree may recurse.

use super::ast::*;
use super::layout::too_deep;
use super::{NESTING_LIMIT, characters, depth, literal, spanned};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::operators::Compare;
use crate::source::{FileId, Span};

pub(in crate::syntax) struct Builder<'t> {
    file: FileId,
    source: &'t str,
    /// Mistakes in what the grammar accepts.
    pub(in crate::syntax) diagnostics: Vec<Diagnostic>,
    reported_depth: bool,
}

/// The result of the grammar: the items of a file, or one expression.
pub(in crate::syntax) enum Input {
    File(Vec<Item>),
    Expression(Expr),
}

/// A line of a block.
pub(in crate::syntax) enum Statement {
    Item(Item),
    Expr(Expr),
    /// It could not be parsed.
    Bad(Span),
}

/// A type that may become the left side of `->`, where parentheses list arguments.
pub(in crate::syntax) enum TypeAtom {
    Plain(TypeExpr),
    Paren(Vec<TypeExpr>, Span),
}

impl<'t> Builder<'t> {
    pub(in crate::syntax) fn new(file: FileId, source: &'t str) -> Self {
        Self { file, source, diagnostics: Vec::new(), reported_depth: false }
    }

    pub(in crate::syntax) fn span(&self, l: u32, r: u32) -> Span {
        spanned(self.file, l, r)
    }

    pub(in crate::syntax) fn slice(&self, l: u32, r: u32) -> &'t str {
        self.source.get(l as usize..r as usize).unwrap_or("")
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// The depth of a node above nodes of that depth, if it is allowed; the first that is not is reported.
    fn depth(&mut self, span: Span, below: u32) -> Option<u32> {
        if below < NESTING_LIMIT {
            return Some(below + 1);
        }
        if !self.reported_depth {
            self.reported_depth = true;
            self.report(too_deep(self.file, span.start, span.end));
        }
        None
    }

    pub(in crate::syntax) fn expr(&mut self, l: u32, kind: ExprKind, r: u32) -> Expr {
        let span = self.span(l, r);
        match self.depth(span, depth::below_expr(&kind)) {
            Some(depth) => Expr { span, kind, depth },
            None => Expr::error(span),
        }
    }

    pub(in crate::syntax) fn ty(&mut self, l: u32, kind: TypeKind, r: u32) -> TypeExpr {
        let span = self.span(l, r);
        match self.depth(span, depth::below_type(&kind)) {
            Some(depth) => TypeExpr { span, kind, depth },
            None => TypeExpr { span, kind: TypeKind::Error, depth: 1 },
        }
    }

    pub(in crate::syntax) fn item(&mut self, doc: Option<String>, l: u32, kind: ItemKind, r: u32) -> Item {
        let span = self.span(l, r);
        match self.depth(span, depth::below_item(&kind)) {
            Some(depth) => Item { doc: doc.unwrap_or_default(), span, kind, depth },
            None => Item::error(span),
        }
    }
}

// Leaves.
impl Builder<'_> {
    pub(in crate::syntax) fn ident(&self, l: u32, r: u32) -> Ident {
        Ident { text: characters::name(self.slice(l, r)), span: self.span(l, r) }
    }

    pub(in crate::syntax) fn part_path(&self, l: u32, name: Ident, r: u32) -> PartPath {
        // Comments may stand between its tokens.
        let lines = self.slice(l, r).lines().map(|line| line.split_once("//").map_or(line, |(before, _)| before));
        let text = lines.collect::<String>().replace(char::is_whitespace, "");
        PartPath { name, text, span: self.span(l, r) }
    }

    pub(in crate::syntax) fn text(&mut self, l: u32, r: u32) -> String {
        literal::text(self.span(l, r), self.slice(l, r), &mut self.diagnostics)
    }

    pub(in crate::syntax) fn doc(&self, l: u32, r: u32) -> String {
        literal::doc(self.slice(l, r))
    }

    pub(in crate::syntax) fn number(&mut self, l: u32, r: u32) -> ExprKind {
        literal::number(self.span(l, r), self.slice(l, r)).unwrap_or_else(|diagnostic| {
            let diagnostic = self.product_meant(*diagnostic);
            self.report(diagnostic);
            ExprKind::Error
        })
    }

    /// `2x` is a product if the script has a name `x`.
    fn product_meant(&self, diagnostic: Diagnostic) -> Diagnostic {
        let text = self.slice(diagnostic.span.start, diagnostic.span.end);
        let (number, name) = text.split_at(text.find(char::is_alphabetic).unwrap_or(text.len()));
        let other = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric() && c != '_');
        // The search goes through the whole text: it is not made for very many numbers.
        let known = !name.is_empty()
            && self.diagnostics.len() < 20
            && self.source.match_indices(name).any(|(at, _)| {
                other(self.source[..at].chars().next_back()) && other(self.source[at + name.len()..].chars().next())
            });
        if !known || !diagnostic.suggestions.is_empty() {
            return diagnostic;
        }
        let gap = Span { start: diagnostic.span.start + number.len() as u32, ..diagnostic.span };
        let gap = Span { end: gap.start, ..gap };
        let message = format!("'{name}' is not a unit, and a product needs '*'");
        Diagnostic::new(diagnostic.code, diagnostic.span, message)
            .suggest(format!("write '{number} * {name}'"), [Edit::replace(gap, " * ")])
    }
}

// Types.
impl Builder<'_> {
    pub(in crate::syntax) fn power_type(&mut self, name: Ident, negative: bool, number: u32, r: u32) -> TypeAtom {
        let l = name.span.start;
        let kind = match self.slice(number, r).parse::<i32>() {
            Ok(n) => {
                let base = self.ty(l, TypeKind::Name(name.text), name.span.end);
                TypeKind::Power(Box::new(base), if negative { -n } else { n })
            }
            Err(_) => {
                let message = "the exponent of a dimension must be a whole number";
                self.report(Diagnostic::new(Code::BadNumber, self.span(number, r), message));
                TypeKind::Error
            }
        };
        TypeAtom::Plain(self.ty(l, kind, r))
    }

    pub(in crate::syntax) fn atom_type(&mut self, atom: TypeAtom) -> TypeExpr {
        match atom {
            TypeAtom::Plain(ty) => ty,
            TypeAtom::Paren(mut types, span) if types.len() == 1 => TypeExpr { span, ..types.remove(0) },
            TypeAtom::Paren(types, span) if types.is_empty() => {
                self.report(Diagnostic::new(Code::EmptyTuple, span, "expected a type inside the parentheses"));
                self.ty(span.start, TypeKind::Error, span.end)
            }
            TypeAtom::Paren(types, span) => self.ty(span.start, TypeKind::Tuple(types), span.end),
        }
    }

    pub(in crate::syntax) fn function_type(&mut self, l: u32, from: TypeAtom, to: TypeExpr, r: u32) -> TypeExpr {
        let args = match from {
            TypeAtom::Plain(ty) => vec![ty],
            TypeAtom::Paren(types, _) => types,
        };
        self.ty(l, TypeKind::Function(args, Box::new(to)), r)
    }
}

// Expressions.
impl Builder<'_> {
    pub(in crate::syntax) fn binary(&mut self, op: BinaryOp, a: Expr, b: Expr) -> Expr {
        let (l, r) = (a.span.start, b.span.end);
        self.expr(l, ExprKind::Binary(op, Box::new(a), Box::new(b)), r)
    }

    pub(in crate::syntax) fn compare(&mut self, op: Compare, a: Expr, b: Expr) -> Expr {
        // Parentheses widen the span, so a chain is where the spans begin together.
        if let ExprKind::Binary(BinaryOp::Compare(_), first, second) = &a.kind
            && first.span.start == a.span.start
        {
            let text = |e: &Expr| self.slice(e.span.start, e.span.end);
            let hint = format!("write '{} and {} {} {}'", text(&a), text(second), op.sign(), text(&b));
            let middle = Edit::after(second.span, format!(" and {}", text(second)));
            let span = a.span.to(b.span);
            let error = Diagnostic::new(Code::ComparisonChain, span, "comparisons cannot be chained");
            self.report(error.suggest(hint, [middle]));
            return Expr::error(span);
        }
        self.binary(BinaryOp::Compare(op), a, b)
    }

    pub(in crate::syntax) fn call(&mut self, f: Expr, args: Vec<Arg>, r: u32) -> Expr {
        let l = f.span.start;
        let kind = match f.kind {
            // Parentheses widen the span: `(a.f)(b)` calls a field, `a.f(b)` a method.
            ExprKind::Field(receiver, name) if receiver.span.start == l => ExprKind::Method(receiver, name, args),
            kind => ExprKind::Call(Box::new(Expr { kind, ..f }), args),
        };
        self.expr(l, kind, r)
    }

    pub(in crate::syntax) fn paren(&mut self, l: u32, mut items: Vec<Expr>, r: u32) -> Expr {
        match items.len() {
            0 => {
                let span = self.span(l, r);
                self.report(Diagnostic::new(Code::EmptyTuple, span, "expected a value inside the parentheses"));
                Expr::error(span)
            }
            1 => Expr { span: self.span(l, r), ..items.remove(0) },
            _ => self.expr(l, ExprKind::Tuple(items), r),
        }
    }

    pub(in crate::syntax) fn block(&mut self, l: u32, lines: Vec<Statement>, r: u32) -> Expr {
        let (mut items, mut value) = (Vec::new(), None);
        let count = lines.len();
        for (i, line) in lines.into_iter().enumerate() {
            let last = i + 1 == count;
            match line {
                Statement::Item(item) => items.push(item),
                Statement::Expr(expr) if last => value = Some(Box::new(expr)),
                Statement::Expr(expr) => {
                    let message = "this value is not used: only the last line of a block is its value";
                    let hint = "give it a name with 'let', or remove it";
                    self.report(Diagnostic::new(Code::UnusedValue, expr.span, message).hint(hint));
                }
                Statement::Bad(span) if last => value = Some(Box::new(Expr::error(span))),
                Statement::Bad(span) => items.push(Item::error(span)),
            }
        }
        self.expr(l, ExprKind::Block(items, value), r)
    }
}
