//! The typed tree as text, for `gmlc emit --stage typed`.

use super::typed::{Binary, Call, Expr, ExprKind, LocalId, Model, Statement, Type, Unary};
use super::types::Dimension;
use std::fmt::Write;

/// The typed tree as text in the manner of .gml. Locals are `name#number`, function instances `name@number`.
#[must_use]
pub fn print(model: &Model) -> String {
    let mut p = Printer { model, out: String::new() };
    p.model();
    p.out
}

struct Printer<'m> {
    model: &'m Model,
    out: String,
}

impl Printer<'_> {
    fn model(&mut self) {
        let model = self.model;
        for (id, function) in &model.functions {
            let captures: Vec<String> = function.captures.iter().map(|l| self.typed_local(*l)).collect();
            let params: Vec<String> = function.params.iter().map(|l| self.typed_local(*l)).collect();
            let result = self.ty(&function.body.ty);
            let _ = write!(self.out, "fn {}@{}", function.name, id.0);
            if !captures.is_empty() {
                let _ = write!(self.out, "[{}]", captures.join(", "));
            }
            let _ = write!(self.out, "({}) -> {result} = ", params.join(", "));
            if let Some(custom_derivative) = &function.custom_derivative {
                let _ = write!(self.out, "/* its derivative: @{} */ ", custom_derivative.function.0);
            }
            self.expr(&function.body, 0);
            self.out.push_str("\n\n");
        }
        let _ = writeln!(self.out, "model {} {{", model.name);
        for input in &model.inputs {
            let _ = writeln!(self.out, "  input {} = {}", input.name, input.value);
        }
        for param in &model.params {
            let _ = write!(self.out, "  param {}", self.typed_local(param.local));
            if let (Some(lower), Some(upper)) = (&param.lower, &param.upper) {
                self.out.push_str(" in ");
                self.expr(lower, 1);
                self.out.push_str("..");
                self.expr(upper, 1);
            }
            let _ = writeln!(self.out, " = {}", param.declared.default);
        }
        for statement in &model.body {
            self.statement(statement, 1);
        }
        for part in &model.parts {
            let _ = write!(self.out, "  part {} = ", part.name);
            self.expr(&part.shape, 1);
            let locals: Vec<String> = [part.local, part.u, part.v].iter().map(|l| self.typed_local(*l)).collect();
            let _ = write!(self.out, " as |{}| ", locals.join(", "));
            self.expr(&part.point, 1);
            self.out.push('\n');
        }
        for measure in &model.measures {
            let _ = write!(self.out, "  measure {}", measure.name);
            if let Some([lower, upper]) = &measure.limits {
                self.out.push_str(" tolerance ");
                self.expr(lower, 1);
                self.out.push_str("..");
                self.expr(upper, 1);
            }
            self.out.push_str(" = ");
            self.expr(&measure.value, 1);
            self.out.push('\n');
        }
        self.out.push_str("}\n");
    }

    fn statement(&mut self, statement: &Statement, depth: usize) {
        self.indent(depth);
        match statement {
            Statement::Let(local, e) => {
                let _ = write!(self.out, "let {} = ", self.typed_local(*local));
                self.expr(e, depth);
            }
            Statement::Require { condition, message, .. } => {
                self.out.push_str("require ");
                self.expr(condition, depth);
                let _ = write!(self.out, ", {message:?}");
            }
        }
        self.out.push('\n');
    }

    fn indent(&mut self, depth: usize) {
        (0..depth).for_each(|_| self.out.push_str("  "));
    }

    fn expr(&mut self, e: &Expr, depth: usize) {
        match &e.kind {
            ExprKind::Real(x) => {
                let _ = write!(self.out, "{x:?}");
            }
            ExprKind::Int(k) => {
                let _ = write!(self.out, "{k}");
            }
            ExprKind::Bool(b) => {
                let _ = write!(self.out, "{b}");
            }
            ExprKind::Text(text) => {
                let _ = write!(self.out, "{text:?}");
            }
            ExprKind::Local(id) => {
                let name = self.local(*id);
                self.out.push_str(&name);
            }
            ExprKind::Convert(a) => {
                let ty = self.ty(&e.ty);
                self.out.push_str("convert(");
                self.expr(a, depth);
                let _ = write!(self.out, ", {ty})");
            }
            ExprKind::Unary(op, a) => self.unary(*op, a, depth),
            ExprKind::Binary(op, a, b) => self.binary(*op, a, b, depth),
            ExprKind::Compare(op, a, b) => self.infix(op.sign(), a, b, depth),
            ExprKind::If(c, a, b) => {
                self.out.push_str("if ");
                self.expr(c, depth);
                self.out.push_str(" { ");
                self.expr(a, depth);
                self.out.push_str(" } else { ");
                self.expr(b, depth);
                self.out.push_str(" }");
            }
            ExprKind::Aggregate(items) => {
                let (open, close) = match &e.ty {
                    Type::Array(..) => ("[".to_owned(), "]"),
                    Type::Closure(id) => (format!("{}[", self.model.closures[id.0 as usize].name), "]"),
                    _ => ("(".to_owned(), ")"),
                };
                self.out.push_str(&open);
                self.list(items, depth);
                self.out.push_str(close);
            }
            ExprKind::Element(a, k) => {
                self.expr(a, depth);
                let _ = write!(self.out, ".{k}");
            }
            ExprKind::Index(a, i) => {
                self.expr(a, depth);
                self.out.push('[');
                self.expr(i, depth);
                self.out.push(']');
            }
            ExprKind::Block(statements, value) => {
                self.out.push_str("{\n");
                statements.iter().for_each(|s| self.statement(s, depth + 1));
                self.indent(depth + 1);
                self.expr(value, depth + 1);
                self.out.push('\n');
                self.indent(depth);
                self.out.push('}');
            }
            ExprKind::Call(call) => self.call(call, depth),
            ExprKind::Derivative { call, wrt } => {
                let _ = write!(self.out, "derivative[{wrt}] ");
                self.call(call, depth);
            }
            ExprKind::Fold { from, to, init, index, accumulator, body } => {
                self.out.push_str("fold(");
                self.expr(init, depth);
                self.out.push_str(", ");
                self.expr(from, depth);
                self.out.push_str("..");
                self.expr(to, depth);
                let _ = write!(self.out, ", |{}, {}| ", self.typed_local(*accumulator), self.local(*index));
                self.expr(body, depth);
                self.out.push(')');
            }
        }
    }

    fn unary(&mut self, op: Unary, a: &Expr, depth: usize) {
        match op {
            Unary::Neg => self.out.push('-'),
            Unary::ToInt => self.out.push_str("truncate"),
            op => self.out.push_str(&format!("{op:?}").to_lowercase()),
        }
        self.out.push('(');
        self.expr(a, depth);
        self.out.push(')');
    }

    fn binary(&mut self, op: Binary, a: &Expr, b: &Expr, depth: usize) {
        let sign = match op {
            Binary::Add => "+",
            Binary::Sub => "-",
            Binary::Mul => "*",
            Binary::Div => "/",
            Binary::Rem => "%",
            Binary::Pow => "^",
            op => {
                self.out.push_str(&format!("{op:?}(").to_lowercase());
                self.expr(a, depth);
                self.out.push_str(", ");
                self.expr(b, depth);
                return self.out.push(')');
            }
        };
        self.infix(sign, a, b, depth);
    }

    fn infix(&mut self, sign: &str, a: &Expr, b: &Expr, depth: usize) {
        self.out.push('(');
        self.expr(a, depth);
        let _ = write!(self.out, " {sign} ");
        self.expr(b, depth);
        self.out.push(')');
    }

    fn call(&mut self, call: &Call, depth: usize) {
        let name = self.model.functions.get(&call.function).map_or("?", |f| &f.name);
        let _ = write!(self.out, "{name}@{}", call.function.0);
        if let Some(closure) = &call.closure {
            self.out.push('[');
            self.expr(closure, depth);
            self.out.push(']');
        }
        self.out.push('(');
        self.list(&call.args, depth);
        self.out.push(')');
    }

    fn list(&mut self, items: &[Expr], depth: usize) {
        for (i, item) in items.iter().enumerate() {
            if i > 0 {
                self.out.push_str(", ");
            }
            self.expr(item, depth);
        }
    }

    fn local(&self, id: LocalId) -> String {
        let name = self.model.locals.get(id.0 as usize).map_or("", |l| &l.name);
        format!("{name}#{}", id.0)
    }

    fn typed_local(&self, id: LocalId) -> String {
        let ty = self.model.locals.get(id.0 as usize).map_or(String::new(), |l| self.ty(&l.ty));
        format!("{}: {ty}", self.local(id))
    }

    fn ty(&self, ty: &Type) -> String {
        let list = |types: &mut dyn Iterator<Item = String>| types.collect::<Vec<_>>().join(", ");
        match ty {
            Type::Error => "error".to_owned(),
            Type::Real(d) => dimension(*d),
            Type::Int(None) => "int".to_owned(),
            Type::Int(Some(k)) => format!("int = {k}"),
            Type::Bool(None) => "bool".to_owned(),
            Type::Bool(Some(b)) => format!("bool = {b}"),
            Type::Text(_) => "text".to_owned(),
            Type::Range(..) => "range".to_owned(),
            Type::Tuple(types) => match types.iter().map(|t| self.ty(t)).collect::<Vec<_>>() {
                parts if parts.len() > 3 && parts.iter().all(|p| *p == parts[0]) => {
                    format!("({}; {})", parts[0], parts.len())
                }
                parts => format!("({})", parts.join(", ")),
            },
            Type::Array(element, n) => format!("[{}; {n}]", self.ty(element)),
            Type::Record(fields) => {
                format!("{{{}}}", list(&mut fields.iter().map(|(name, t)| format!("{name}: {}", self.ty(t)))))
            }
            Type::Closure(id) => self.model.closures.get(id.0 as usize).map_or("fn", |c| &c.name).to_owned(),
        }
    }
}

fn dimension(d: Dimension) -> String {
    match d {
        Dimension::NONE => "real".to_owned(),
        Dimension::LENGTH => "length".to_owned(),
        Dimension::ANGLE => "angle".to_owned(),
        d => format!("length^{}", d.length),
    }
}
