//! The tree as text: one node a line, indented by depth.

use super::ast::*;
use std::fmt::Write;

/// The tree of a file, for people and for snapshots.
#[must_use]
pub fn print(file: &File) -> String {
    let mut printer = Printer::default();
    printer.items(&file.items);
    printer.out
}

#[derive(Default)]
struct Printer {
    out: String,
    depth: usize,
}

impl Printer {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.out, "{:width$}{text}", "", width = 2 * self.depth);
    }

    /// A line with everything that `below` prints one level deeper.
    fn node(&mut self, text: &str, below: impl FnOnce(&mut Printer)) {
        self.line(text);
        self.depth += 1;
        below(self);
        self.depth -= 1;
    }

    fn items(&mut self, items: &[Item]) {
        for item in items {
            self.item(item);
        }
    }

    fn item(&mut self, item: &Item) {
        for line in item.doc.lines() {
            self.line(&format!("/// {line}"));
        }
        match &item.kind {
            ItemKind::Use(decl) => self.line(&format!("use {}", use_text(decl))),
            ItemKind::Function(decl) => self.function(decl),
            ItemKind::Derivative(decl) => {
                let text =
                    format!("deriv {}({}; {})", decl.function.text, idents(&decl.params), idents(&decl.tangents));
                self.node(&text, |p| p.expr(&decl.body));
            }
            ItemKind::Let(decl) => {
                let text = format!("let {}{}", pattern_text(&decl.pattern), annotation(decl.ty.as_ref()));
                self.node(&text, |p| p.expr(&decl.value));
            }
            ItemKind::Model(decl) => self.node(&format!("model {}", decl.name.text), |p| p.items(&decl.items)),
            ItemKind::Param(decl) => self.param("param", decl),
            ItemKind::Input(decl) => self.param("input", decl),
            ItemKind::Part(decl) => self.node(&format!("part {}", decl.name.text), |p| {
                if let Some(tolerance) = &decl.tolerance {
                    p.node("tolerance", |p| p.expr(tolerance));
                }
                p.expr(&decl.shape);
            }),
            ItemKind::Measure(decl) => self.node(&format!("measure {}", decl.name.text), |p| {
                decl.parts.iter().for_each(|part| p.line(&format!("of {}", part.text)));
                match &decl.tolerance {
                    Some(Tolerance::Symmetric(value)) => p.node("tolerance", |p| p.expr(value)),
                    Some(Tolerance::Limits(limits)) => p.node("tolerance", |p| limits.iter().for_each(|l| p.limit(l))),
                    Some(Tolerance::Error) => p.line("error"),
                    None => {}
                }
                p.expr(&decl.value);
            }),
            ItemKind::Require(decl) => {
                let message = decl.message.as_ref().map(|m| format!(" {m:?}")).unwrap_or_default();
                self.node(&format!("require{message}"), |p| p.expr(&decl.condition));
            }
            ItemKind::For(decl) => self.node(&format!("for parts {}", pattern_text(&decl.pattern)), |p| {
                p.expr(&decl.iterable);
                p.node("do", |p| p.items(&decl.items));
            }),
            ItemKind::If(decl) => self.node("if parts", |p| {
                p.expr(&decl.condition);
                p.node("then", |p| p.items(&decl.then));
                if !decl.otherwise.is_empty() {
                    p.node("else", |p| p.items(&decl.otherwise));
                }
            }),
            ItemKind::Error => self.line("error"),
        }
    }

    fn limit(&mut self, limit: &Limit) {
        let sign = match limit.sign {
            Some(Sign::Plus) => "+",
            Some(Sign::Minus) => "-",
            None => "zero",
        };
        self.node(sign, |p| p.expr(&limit.value));
    }

    fn function(&mut self, decl: &FunctionDecl) {
        let result = decl.result.as_ref().map(|t| format!(" -> {}", type_text(t))).unwrap_or_default();
        self.node(&format!("fn {}{result}", decl.name.text), |p| {
            p.params(&decl.params);
            p.expr(&decl.body);
        });
    }

    fn params(&mut self, params: &[FnParam]) {
        for param in params {
            let text = format!("parameter {}{}", pattern_text(&param.pattern), annotation(param.ty.as_ref()));
            self.node(&text, |p| {
                if let Some(default) = &param.default {
                    p.expr(default);
                }
            });
        }
    }

    fn param(&mut self, keyword: &str, decl: &ParamDecl) {
        self.node(&format!("{keyword} {}: {}", decl.name.text, type_text(&decl.ty)), |p| {
            if let Some((low, high)) = &decl.bounds {
                p.node("in", |p| {
                    p.expr(low);
                    p.expr(high);
                });
            }
            if let Some(default) = &decl.default {
                p.node("default", |p| p.expr(default));
            }
        });
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Int(n) => self.line(&format!("{n}")),
            ExprKind::Real(x, unit) => self.line(&format!("{x:?}{}", unit.map_or("", Unit::name))),
            ExprKind::Bool(b) => self.line(&format!("{b}")),
            ExprKind::Text(text) => self.line(&format!("{text:?}")),
            ExprKind::Name(name) => self.line(name),
            ExprKind::Tuple(items) => self.list("tuple", items),
            ExprKind::Array(items) => self.list("array", items),
            ExprKind::Record(fields) => self.node("record", |p| {
                for (name, value) in fields {
                    p.node(&format!("{}:", name.text), |p| p.expr(value));
                }
            }),
            ExprKind::Unary(UnaryOp::Neg, a) => self.node("negative", |p| p.expr(a)),
            ExprKind::Unary(UnaryOp::Not, a) => self.node("not", |p| p.expr(a)),
            ExprKind::Binary(op, a, b) => self.pair(op.text(), a, b),
            ExprKind::Range(a, b) => self.pair("..", a, b),
            ExprKind::Call(f, args) => self.node("call", |p| {
                p.expr(f);
                p.args(args);
            }),
            ExprKind::Method(receiver, name, args) => self.node(&format!("method {}", name.text), |p| {
                p.expr(receiver);
                p.args(args);
            }),
            ExprKind::Field(a, name) => self.node(&format!("field {}", name.text), |p| p.expr(a)),
            ExprKind::Index(a, i) => self.pair("index", a, i),
            ExprKind::Prime(f, name) => {
                let name = name.as_ref().map_or("", |n| &n.text);
                self.node(format!("prime {name}").trim_end(), |p| p.expr(f));
            }
            ExprKind::Lambda(params, body) => self.node("lambda", |p| {
                p.params(params);
                p.expr(body);
            }),
            ExprKind::If(condition, then, otherwise) => self.node("if", |p| {
                p.expr(condition);
                p.expr(then);
                if let Some(otherwise) = otherwise {
                    p.expr(otherwise);
                }
            }),
            ExprKind::For(pattern, iterable, body) => {
                self.node(&format!("for {}", pattern_text(pattern)), |p| {
                    p.expr(iterable);
                    p.expr(body);
                });
            }
            ExprKind::Block(items, value) => self.node("block", |p| {
                p.items(items);
                if let Some(value) = value {
                    p.expr(value);
                }
            }),
            ExprKind::Error => self.line("error"),
        }
    }

    fn list(&mut self, text: &str, items: &[Expr]) {
        self.node(text, |p| items.iter().for_each(|item| p.expr(item)));
    }

    fn pair(&mut self, text: &str, a: &Expr, b: &Expr) {
        self.node(text, |p| {
            p.expr(a);
            p.expr(b);
        });
    }

    fn args(&mut self, args: &[Arg]) {
        for arg in args {
            match &arg.label {
                Some(label) => self.node(&format!("{}:", label.text), |p| p.expr(&arg.value)),
                None => self.expr(&arg.value),
            }
        }
    }
}

impl BinaryOp {
    /// As it is written.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            BinaryOp::Add => "+",
            BinaryOp::Sub => "-",
            BinaryOp::Mul => "*",
            BinaryOp::Div => "/",
            BinaryOp::Rem => "%",
            BinaryOp::Pow => "^",
            BinaryOp::Common => "&",
            BinaryOp::Compare(op) => op.sign(),
            BinaryOp::And => "and",
            BinaryOp::Or => "or",
        }
    }
}

/// A `use` as it is written, without its keyword.
pub(crate) fn use_text(decl: &Use) -> String {
    let path = match &decl.path {
        UsePath::Module(path) => path.iter().map(|i| i.text.as_str()).collect::<Vec<_>>().join("."),
        UsePath::File(path, _) => format!("{path:?}"),
    };
    match &decl.names {
        Some(names) => format!("{path} ({})", idents(names)),
        None => path,
    }
}

fn idents(idents: &[Ident]) -> String {
    idents.iter().map(|i| i.text.as_str()).collect::<Vec<_>>().join(", ")
}

fn pattern_text(pattern: &Pattern) -> String {
    match pattern {
        Pattern::Name(name) => name.text.clone(),
        Pattern::Tuple(items, _) => format!("({})", items.iter().map(pattern_text).collect::<Vec<_>>().join(", ")),
    }
}

fn annotation(ty: Option<&TypeExpr>) -> String {
    ty.map(|t| format!(": {}", type_text(t))).unwrap_or_default()
}

/// A type as it is written.
#[must_use]
pub fn type_text(ty: &TypeExpr) -> String {
    let list = |types: &[TypeExpr]| types.iter().map(type_text).collect::<Vec<_>>().join(", ");
    match &ty.kind {
        TypeKind::Name(name) => name.clone(),
        TypeKind::Power(base, n) => format!("{}^{n}", type_text(base)),
        TypeKind::Tuple(items) => format!("({})", list(items)),
        TypeKind::Array(element) => format!("[{}]", type_text(element)),
        TypeKind::Function(params, result) => format!("({}) -> {}", list(params), type_text(result)),
        TypeKind::Error => "error".to_owned(),
    }
}
