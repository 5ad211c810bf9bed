//! Shows functions: as an exact listing, node by node (`Display` of [`Module`] and [`Function`]), and as text that
//! reads like the language ([`gml`]).

use super::{Function, FunctionId, Module, Op, Type, Value};
use std::fmt::{Display, Formatter, Result};

mod expression;
mod product;
mod readable;

pub(crate) use readable::gml;

impl Display for Value {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "v{}", self.0)
    }
}

impl Display for FunctionId {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "f{}", self.0)
    }
}

impl Display for Type {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            Type::Real => "real",
            Type::Int => "int",
            Type::Bool => "bool",
            Type::Multi => "multi",
        })
    }
}

impl Display for Module {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (i, function) in self.functions.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "f{i} = {function}")?;
        }
        Ok(())
    }
}

impl Display for Function {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let params: Vec<String> =
            self.params.iter().enumerate().map(|(i, p)| format!("v{i} {}: {}", p.name, p.ty)).collect();
        writeln!(f, "{}({}):", self.name, params.join(", "))?;
        for (i, node) in self.nodes.iter().enumerate().skip(self.params.len()) {
            writeln!(f, "  v{i}: {} = {}", node.ty, node.op)?;
        }
        let results: Vec<String> =
            self.results.iter().zip(&self.result_names).map(|(v, name)| format!("{name} = {v}")).collect();
        writeln!(f, "  return {}", results.join(", "))
    }
}

impl Display for Op {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Op::Param(i) => write!(f, "param {i}"),
            Op::Real(bits) => write!(f, "{:?}", f64::from_bits(*bits)),
            Op::Int(i) => write!(f, "{i}"),
            Op::Bool(b) => write!(f, "{b}"),
            Op::Unary(op, a) => write!(f, "{} {a}", lower(op)),
            Op::Binary(op, a, b) => write!(f, "{} {a}, {b}", lower(op)),
            Op::PowInt(a, n) => write!(f, "powint {a}, {n}"),
            Op::Compare(op, a, b) => write!(f, "{} {a}, {b}", lower(op)),
            Op::Select(c, a, b) => write!(f, "select {c}, {a}, {b}"),
            Op::If { condition, then, otherwise, args } => {
                write!(f, "if {condition} then {then} else {otherwise} ({})", list(args))
            }
            Op::Loop { count, body, init, invariant } => {
                write!(f, "loop {count} times {body} ({}; {})", list(init), list(invariant))
            }
            Op::Call { function, args } => write!(f, "call {function} ({})", list(args)),
            Op::Tangent { function, args, seeds } => {
                let seeds: Vec<String> = seeds.iter().map(|(i, v)| format!("{i}: {v}")).collect();
                write!(f, "tangent {function} ({}; {})", list(args), seeds.join(", "))
            }
            Op::Project(multi, k) => write!(f, "{multi}.{k}"),
            Op::Guard { value, condition, failure } => {
                write!(f, "guard {value} if {condition} else failure {}", failure.0)
            }
        }
    }
}

fn lower(op: impl std::fmt::Debug) -> String {
    format!("{op:?}").to_lowercase()
}

fn list(values: &[Value]) -> String {
    values.iter().map(Value::to_string).collect::<Vec<_>>().join(", ")
}
