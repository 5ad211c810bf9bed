//! Makes the nodes of the tree for the grammar's actions.
//!
//! Every node is built with its depth. One that would lie deeper than [`NESTING_LIMIT`] is replaced by an error node,
//! so that walking, printing and dropping a tree may recurse.

use super::ast::*;
use super::layout::too_deep;
use super::{NESTING_LIMIT, literal, spanned};
use crate::diagnostic::Diagnostic;
use crate::source::{FileId, Span};

/// What the actions know and find.
pub(super) struct Builder<'t> {
    file: FileId,
    source: &'t str,
    /// What is well-formed but wrong.
    pub(super) diagnostics: Vec<Diagnostic>,
    reported_depth: bool,
}

/// A part of the tree with the number of levels in it.
pub(super) struct Deep<T> {
    pub(super) node: T,
    pub(super) depth: u32,
}

impl<T> Deep<T> {
    pub(super) fn flat(node: T) -> Deep<T> {
        Deep { node, depth: 1 }
    }

    pub(super) fn map<U>(self, f: impl FnOnce(T) -> U) -> Deep<U> {
        Deep { node: f(self.node), depth: self.depth }
    }

    fn split(self) -> (T, u32) {
        (self.node, self.depth)
    }
}

/// A line of a block.
pub(super) enum Statement {
    Item(Deep<Item>),
    Expr(Deep<Expr>),
    Bad(Span),
}

/// A type that may become the left side of `->`, where parentheses list arguments.
pub(super) enum TypeAtom {
    Plain(Deep<TypeExpr>),
    Paren(Vec<TypeExpr>, Span, u32),
}

/// The nodes and the greatest depth among them.
fn split_all<T>(list: Vec<Deep<T>>) -> (Vec<T>, u32) {
    let depth = list.iter().map(|d| d.depth).max().unwrap_or(0);
    (list.into_iter().map(|d| d.node).collect(), depth)
}

fn split_option<T>(option: Option<Deep<T>>) -> (Option<T>, u32) {
    option.map_or((None, 0), |d| (Some(d.node), d.depth))
}

impl<'t> Builder<'t> {
    pub(super) fn new(file: FileId, source: &'t str) -> Builder<'t> {
        Builder { file, source, diagnostics: Vec::new(), reported_depth: false }
    }

    pub(super) fn span(&self, start: u32, end: u32) -> Span {
        spanned(self.file, start, end)
    }

    fn slice(&self, start: u32, end: u32) -> &'t str {
        self.source.get(start as usize..end as usize).unwrap_or("")
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Whether a node above nodes of that depth is still allowed; the first that is not is reported.
    fn fits(&mut self, span: Span, below: u32) -> bool {
        if below < NESTING_LIMIT {
            return true;
        }
        if !self.reported_depth {
            self.reported_depth = true;
            self.report(too_deep(self.file, span.start, span.end));
        }
        false
    }

    fn expr(&mut self, span: Span, kind: ExprKind, below: u32) -> Deep<Expr> {
        if self.fits(span, below) {
            Deep { node: Expr { span, kind }, depth: below + 1 }
        } else {
            Deep::flat(Expr { span, kind: ExprKind::Error })
        }
    }

    fn ty(&mut self, span: Span, kind: TypeKind, below: u32) -> Deep<TypeExpr> {
        if self.fits(span, below) {
            Deep { node: TypeExpr { span, kind }, depth: below + 1 }
        } else {
            Deep::flat(TypeExpr { span, kind: TypeKind::Error })
        }
    }
}

// Leaves.
impl Builder<'_> {
    pub(super) fn ident(&mut self, l: u32, r: u32) -> Ident {
        Ident { text: self.slice(l, r).to_owned(), span: self.span(l, r) }
    }

    pub(super) fn text(&mut self, l: u32, r: u32) -> String {
        let span = self.span(l, r);
        literal::text(span, self.slice(l, r), &mut self.diagnostics)
    }

    pub(super) fn doc(&mut self, l: u32, r: u32) -> String {
        literal::doc(self.slice(l, r))
    }

    pub(super) fn number(&mut self, l: u32, r: u32) -> Deep<Expr> {
        let span = self.span(l, r);
        let kind = literal::number(span, self.slice(l, r)).unwrap_or_else(|diagnostic| {
            self.report(diagnostic);
            ExprKind::Error
        });
        Deep::flat(Expr { span, kind })
    }

    pub(super) fn leaf(&mut self, l: u32, kind: ExprKind, r: u32) -> Deep<Expr> {
        Deep::flat(Expr { span: self.span(l, r), kind })
    }
}

// Items.
impl Builder<'_> {
    pub(super) fn file(&self, items: Vec<Deep<Item>>) -> File {
        File { items: split_all(items).0 }
    }

    pub(super) fn item(&mut self, doc: Option<String>, l: u32, kind: Deep<ItemKind>, r: u32) -> Deep<Item> {
        let span = self.span(l, r);
        let doc = doc.unwrap_or_default();
        if self.fits(span, kind.depth) {
            Deep { depth: kind.depth + 1, node: Item { doc, span, kind: kind.node } }
        } else {
            Deep::flat(Item { doc, span, kind: ItemKind::Error })
        }
    }

    pub(super) fn bad_item(&mut self, l: u32, r: u32) -> Deep<Item> {
        Deep::flat(Item { doc: String::new(), span: self.span(l, r), kind: ItemKind::Error })
    }

    pub(super) fn function(
        &mut self,
        name: Ident,
        params: Vec<Deep<FnParam>>,
        result: Option<Deep<TypeExpr>>,
        body: Deep<Expr>,
    ) -> Deep<ItemKind> {
        let (params, a) = split_all(params);
        let (result, c) = split_option(result);
        let depth = a.max(c).max(body.depth);
        Deep { node: ItemKind::Function(FunctionDecl { name, params, result, body: body.node }), depth }
    }

    pub(super) fn derivative(
        &mut self,
        function: Ident,
        params: Vec<Ident>,
        tangents: Vec<Ident>,
        body: Deep<Expr>,
    ) -> Deep<ItemKind> {
        body.map(|body| ItemKind::Derivative(DerivativeDecl { function, params, tangents, body }))
    }

    pub(super) fn binding(
        &mut self,
        pattern: Pattern,
        ty: Option<Deep<TypeExpr>>,
        value: Deep<Expr>,
    ) -> Deep<ItemKind> {
        let (ty, a) = split_option(ty);
        let depth = a.max(value.depth);
        Deep { node: ItemKind::Let(Let { pattern, ty, value: value.node }), depth }
    }

    pub(super) fn model(&mut self, name: Ident, items: Vec<Deep<Item>>) -> Deep<ItemKind> {
        let (items, depth) = split_all(items);
        Deep { node: ItemKind::Model(Model { name, items }), depth }
    }

    pub(super) fn part(&mut self, name: Ident, tolerance: Option<Deep<Expr>>, shape: Deep<Expr>) -> Deep<ItemKind> {
        let (tolerance, a) = split_option(tolerance);
        let depth = a.max(shape.depth);
        Deep { node: ItemKind::Part(PartDecl { name, tolerance, shape: shape.node }), depth }
    }

    pub(super) fn param(
        &mut self,
        name: Ident,
        ty: Deep<TypeExpr>,
        bounds: Option<(Deep<Expr>, Deep<Expr>)>,
        default: Option<Deep<Expr>>,
    ) -> Deep<ParamDecl> {
        let (default, a) = split_option(default);
        let (ty, c) = ty.split();
        let (bounds, d) = match bounds {
            Some((lo, hi)) => {
                let depth = lo.depth.max(hi.depth);
                (Some((lo.node, hi.node)), depth)
            }
            None => (None, 0),
        };
        Deep { node: ParamDecl { name, ty, bounds, default }, depth: a.max(c).max(d) }
    }

    pub(super) fn fn_param(
        &mut self,
        pattern: Pattern,
        ty: Option<Deep<TypeExpr>>,
        default: Option<Deep<Expr>>,
    ) -> Deep<FnParam> {
        let (ty, a) = split_option(ty);
        let (default, c) = split_option(default);
        Deep { node: FnParam { pattern, ty, default }, depth: a.max(c) }
    }

    pub(super) fn for_items(
        &mut self,
        l: u32,
        pattern: Pattern,
        iterable: Deep<Expr>,
        items: Vec<Deep<Item>>,
        r: u32,
    ) -> Deep<Item> {
        let (iterable, a) = iterable.split();
        let (items, c) = split_all(items);
        let kind = ItemKind::For(ForItems { pattern, iterable, items });
        self.item(None, l, Deep { node: kind, depth: a.max(c) }, r)
    }

    pub(super) fn if_items(
        &mut self,
        l: u32,
        condition: Deep<Expr>,
        then: Vec<Deep<Item>>,
        otherwise: Option<Vec<Deep<Item>>>,
        r: u32,
    ) -> Deep<Item> {
        let (condition, a) = condition.split();
        let (then, c) = split_all(then);
        let (otherwise, d) = split_all(otherwise.unwrap_or_default());
        let kind = ItemKind::If(IfItems { condition, then, otherwise });
        self.item(None, l, Deep { node: kind, depth: a.max(c).max(d) }, r)
    }
}

// Types.
impl Builder<'_> {
    pub(super) fn plain_type(&mut self, l: u32, kind: TypeKind, r: u32) -> TypeAtom {
        TypeAtom::Plain(Deep::flat(TypeExpr { span: self.span(l, r), kind }))
    }

    pub(super) fn power_type(&mut self, l: u32, base: Ident, negative: bool, number: u32, r: u32) -> TypeAtom {
        let base = TypeExpr { span: base.span, kind: TypeKind::Name(base.text) };
        let exponent = match self.slice(number, r).parse::<i32>() {
            Ok(n) => n,
            Err(_) => {
                let message = "the exponent of a dimension must be a whole number";
                self.report(Diagnostic::error("bad-number", self.span(number, r), message));
                return self.plain_type(l, TypeKind::Error, r);
            }
        };
        let exponent = if negative { -exponent } else { exponent };
        let span = self.span(l, r);
        TypeAtom::Plain(self.ty(span, TypeKind::Power(Box::new(base), exponent), 1))
    }

    pub(super) fn array_type(&mut self, l: u32, element: Deep<TypeExpr>, r: u32) -> TypeAtom {
        let span = self.span(l, r);
        TypeAtom::Plain(self.ty(span, TypeKind::Array(Box::new(element.node)), element.depth))
    }

    pub(super) fn paren_type(&mut self, l: u32, types: Vec<Deep<TypeExpr>>, r: u32) -> TypeAtom {
        let (types, depth) = split_all(types);
        TypeAtom::Paren(types, self.span(l, r), depth)
    }

    pub(super) fn atom_type(&mut self, atom: TypeAtom) -> Deep<TypeExpr> {
        match atom {
            TypeAtom::Plain(ty) => ty,
            TypeAtom::Paren(mut types, span, depth) => {
                let kind = match types.pop() {
                    Some(only) if types.is_empty() => only.kind,
                    Some(last) => {
                        types.push(last);
                        TypeKind::Tuple(types)
                    }
                    None => {
                        self.report(Diagnostic::error("empty-tuple", span, "expected a type inside the parentheses"));
                        TypeKind::Error
                    }
                };
                self.ty(span, kind, depth)
            }
        }
    }

    pub(super) fn function_type(&mut self, l: u32, from: TypeAtom, to: Deep<TypeExpr>, r: u32) -> Deep<TypeExpr> {
        let (args, depth) = match from {
            TypeAtom::Plain(ty) => (vec![ty.node], ty.depth),
            TypeAtom::Paren(types, _, depth) => (types, depth),
        };
        let span = self.span(l, r);
        self.ty(span, TypeKind::Function(args, Box::new(to.node)), depth.max(to.depth))
    }
}

// Expressions.
impl Builder<'_> {
    pub(super) fn unary(&mut self, l: u32, op: UnaryOp, a: Deep<Expr>) -> Deep<Expr> {
        let span = self.span(l, a.node.span.end);
        self.expr(span, ExprKind::Unary(op, Box::new(a.node)), a.depth)
    }

    pub(super) fn binary(&mut self, op: BinaryOp, a: Deep<Expr>, c: Deep<Expr>) -> Deep<Expr> {
        let span = a.node.span.to(c.node.span);
        let depth = a.depth.max(c.depth);
        self.expr(span, ExprKind::Binary(op, Box::new(a.node), Box::new(c.node)), depth)
    }

    pub(super) fn compare(&mut self, op: BinaryOp, a: Deep<Expr>, c: Deep<Expr>) -> Deep<Expr> {
        use BinaryOp::{Eq, Ge, Gt, Le, Lt, Ne};
        // Parentheses widen the span, so a chain is where the spans begin together.
        if let ExprKind::Binary(Eq | Ne | Lt | Le | Gt | Ge, first, second) = &a.node.kind
            && first.span.start == a.node.span.start
        {
            let text = |e: &Expr| self.slice(e.span.start, e.span.end);
            let hint = format!("write '{} and {} {} {}'", text(&a.node), text(second), op.text(), text(&c.node));
            let span = a.node.span.to(c.node.span);
            self.report(Diagnostic::error("comparison-chain", span, "comparisons do not chain").hint(hint));
            return Deep::flat(Expr { span, kind: ExprKind::Error });
        }
        self.binary(op, a, c)
    }

    pub(super) fn range(&mut self, a: Deep<Expr>, c: Deep<Expr>) -> Deep<Expr> {
        let span = a.node.span.to(c.node.span);
        let depth = a.depth.max(c.depth);
        self.expr(span, ExprKind::Range(Box::new(a.node), Box::new(c.node)), depth)
    }

    pub(super) fn lambda(&mut self, l: u32, params: Vec<Deep<FnParam>>, body: Deep<Expr>, r: u32) -> Deep<Expr> {
        let (params, a) = split_all(params);
        let span = self.span(l, r);
        self.expr(span, ExprKind::Lambda(params, Box::new(body.node)), a.max(body.depth))
    }

    pub(super) fn call(&mut self, f: Deep<Expr>, args: Vec<Deep<Arg>>, r: u32) -> Deep<Expr> {
        let (args, a) = split_all(args);
        let depth = a.max(f.depth);
        let span = self.span(f.node.span.start, r);
        let kind = match f.node.kind {
            // Parentheses widen the span: `(a.f)(b)` calls a field, `a.f(b)` a method.
            ExprKind::Field(receiver, name) if receiver.span.start == f.node.span.start => {
                ExprKind::Method(receiver, name, args)
            }
            kind => ExprKind::Call(Box::new(Expr { span: f.node.span, kind }), args),
        };
        self.expr(span, kind, depth)
    }

    pub(super) fn index(&mut self, a: Deep<Expr>, i: Deep<Expr>, r: u32) -> Deep<Expr> {
        let span = self.span(a.node.span.start, r);
        let depth = a.depth.max(i.depth);
        self.expr(span, ExprKind::Index(Box::new(a.node), Box::new(i.node)), depth)
    }

    pub(super) fn field(&mut self, a: Deep<Expr>, name: Ident) -> Deep<Expr> {
        let span = a.node.span.to(name.span);
        self.expr(span, ExprKind::Field(Box::new(a.node), name), a.depth)
    }

    /// `name` is where a prime with a name begins.
    pub(super) fn prime(&mut self, f: Deep<Expr>, name: Option<u32>, r: u32) -> Deep<Expr> {
        let name = name.map(|l| self.ident(l + 1, r));
        let span = self.span(f.node.span.start, r);
        self.expr(span, ExprKind::Prime(Box::new(f.node), name), f.depth)
    }

    pub(super) fn paren(&mut self, l: u32, items: Vec<Deep<Expr>>, r: u32) -> Deep<Expr> {
        let span = self.span(l, r);
        let (mut items, depth) = split_all(items);
        match items.pop() {
            Some(only) if items.is_empty() => Deep { node: Expr { span, kind: only.kind }, depth },
            Some(last) => {
                items.push(last);
                self.expr(span, ExprKind::Tuple(items), depth)
            }
            None => {
                self.report(Diagnostic::error("empty-tuple", span, "expected a value inside the parentheses"));
                Deep::flat(Expr { span, kind: ExprKind::Error })
            }
        }
    }

    pub(super) fn array(&mut self, l: u32, items: Vec<Deep<Expr>>, r: u32) -> Deep<Expr> {
        let (items, depth) = split_all(items);
        let span = self.span(l, r);
        self.expr(span, ExprKind::Array(items), depth)
    }

    pub(super) fn record(&mut self, l: u32, fields: Vec<Deep<(Ident, Expr)>>, r: u32) -> Deep<Expr> {
        let (fields, depth) = split_all(fields);
        let span = self.span(l, r);
        self.expr(span, ExprKind::Record(fields), depth)
    }

    pub(super) fn for_expr(
        &mut self,
        l: u32,
        pattern: Pattern,
        iterable: Deep<Expr>,
        body: Deep<Expr>,
        r: u32,
    ) -> Deep<Expr> {
        let depth = iterable.depth.max(body.depth);
        let span = self.span(l, r);
        self.expr(span, ExprKind::For(pattern, Box::new(iterable.node), Box::new(body.node)), depth)
    }

    pub(super) fn if_expr(
        &mut self,
        l: u32,
        condition: Deep<Expr>,
        then: Deep<Expr>,
        otherwise: Option<Deep<Expr>>,
        r: u32,
    ) -> Deep<Expr> {
        let (otherwise, a) = split_option(otherwise);
        let depth = a.max(condition.depth).max(then.depth);
        let span = self.span(l, r);
        let kind = ExprKind::If(Box::new(condition.node), Box::new(then.node), otherwise.map(Box::new));
        self.expr(span, kind, depth)
    }

    pub(super) fn block(&mut self, l: u32, lines: Vec<Statement>, r: u32) -> Deep<Expr> {
        let (mut items, mut value, mut depth) = (Vec::new(), None, 0);
        let count = lines.len();
        for (i, line) in lines.into_iter().enumerate() {
            let last = i + 1 == count;
            match line {
                Statement::Item(item) => {
                    depth = depth.max(item.depth);
                    items.push(item.node);
                }
                Statement::Expr(expr) if last => {
                    depth = depth.max(expr.depth);
                    value = Some(Box::new(expr.node));
                }
                Statement::Expr(expr) => {
                    let message = "this value is not used: only the last line of a block is its value";
                    let hint = "give it a name with 'let', or remove it";
                    self.report(Diagnostic::error("unused-value", expr.node.span, message).hint(hint));
                }
                Statement::Bad(span) if last => value = Some(Box::new(Expr { span, kind: ExprKind::Error })),
                Statement::Bad(span) => items.push(Item { doc: String::new(), span, kind: ItemKind::Error }),
            }
        }
        let span = self.span(l, r);
        self.expr(span, ExprKind::Block(items, value), depth)
    }
}
