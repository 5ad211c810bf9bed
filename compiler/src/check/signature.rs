//! Types and functions as they would be written.

use super::context::{Callee, Checker};
use super::typed::Type;
use super::types::{ClosureId, Dimension, Exponent};
use crate::source::Span;
use crate::syntax::ast::{self, FnParam, ItemKind};
use crate::syntax::type_text;

impl Checker<'_> {
    /// A function value in a line: `surface (u, v) -> point3`, `function (a: length, n) -> length`.
    pub(super) fn signature(&mut self, id: ClosureId) -> String {
        let (noun, params) = match self.closure(id).callee {
            Callee::Function(_, decl) => ("function", self::params(&decl.params)),
            Callee::Lambda(_, params, _) => ("function", self::params(params)),
            Callee::Model(_, model) => return format!("model {}{}", model.name.text, model_params(model)),
            Callee::Global(..) => ("function", Vec::new()),
            Callee::Builtin(_) | Callee::Derivative(..) => {
                ("function", self.parameters(id).iter().map(|p| p.name.to_owned()).collect())
            }
        };
        let params = params.join(", ");
        match self.result_of(id) {
            Some((Role::Surface, result)) => format!("surface ({params}) -> {result}"),
            Some((Role::Curve, result)) => format!("curve ({params}) -> {result}"),
            Some((Role::Other, result)) => format!("{noun} ({params}) -> {result}"),
            None => format!("{noun} ({params})"),
        }
    }

    /// A function's result, as far as it is known without arguments.
    fn result_of(&mut self, id: ClosureId) -> Option<(Role, String)> {
        let params = self.parameters(id);
        let written: Option<Vec<Option<Type>>> =
            params.iter().map(|p| p.ty.and_then(|ty| self.quietly(|c| c.expected(ty).exact())).map(Some)).collect();
        // A function over 0..1 is called with bare numbers; what else its parameters may be is not known.
        let tried = match written {
            Some(types) => types,
            None if params.iter().all(|p| p.ty.is_none()) && self.accepts(id, 2) => bare(2, params.len()),
            None if params.iter().all(|p| p.ty.is_none()) && self.accepts(id, 1) => bare(1, params.len()),
            None => return None,
        };
        let reals = tried.iter().flatten().filter(|t| **t == Type::REAL).count();
        let all = tried.iter().flatten().count();
        let annotated = params.iter().all(|p| p.ty.is_some());
        if matches!(self.closure(id).callee, Callee::Builtin(_)) {
            return None;
        }
        let (_, ty) = self.quietly(|c| c.instantiate(id, tried, Span::default()))?;
        let role = match &ty {
            ty if *ty == Type::point3() && reals == 2 && all == 2 => Role::Surface,
            Type::Tuple(parts)
                if parts.iter().all(|p| *p == Type::LENGTH)
                    && matches!(parts.len(), 2 | 3)
                    && reals == 1
                    && all == 1 =>
            {
                Role::Curve
            }
            _ => Role::Other,
        };
        // The result for bare numbers says little if other arguments may be meant.
        (annotated || !matches!(role, Role::Other)).then(|| (role, written_type(&ty)))
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Surface,
    Curve,
    Other,
}

fn bare(n: usize, all: usize) -> Vec<Option<Type>> {
    (0..all).map(|i| (i < n).then_some(Type::REAL)).collect()
}

/// Parameters as they are written, without their defaults.
fn params(params: &[FnParam]) -> Vec<String> {
    params
        .iter()
        .map(|p| {
            let name = p.pattern.name().map_or("(..)", |name| &name.text);
            let ty = p.ty.as_ref().map(|ty| format!(": {}", type_text(ty))).unwrap_or_default();
            let default = if p.default.is_some() { " = .." } else { "" };
            format!("{name}{ty}{default}")
        })
        .collect()
}

fn model_params(model: &ast::Model) -> String {
    let params = model.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Param(decl) | ItemKind::Input(decl) => Some(format!("{}: {}", decl.name.text, type_text(&decl.ty))),
        _ => None,
    });
    format!("({})", params.collect::<Vec<_>>().join(", "))
}

/// A function's first line, as it is declared.
pub(crate) fn declared(decl: &ast::FunctionDecl) -> String {
    let result = decl.result.as_ref().map(|ty| format!(" -> {}", type_text(ty))).unwrap_or_default();
    format!("fn {}({}){result}", decl.name.text, params(&decl.params).join(", "))
}

/// A type as it would be written; records and functions, which cannot be, in the same manner.
pub(crate) fn written_type(ty: &Type) -> String {
    let list = |types: &[Type]| types.iter().map(written_type).collect::<Vec<_>>().join(", ");
    match ty {
        Type::Error => "error".to_owned(),
        Type::Real(d) => written_dimension(*d),
        Type::Int(_) => "int".to_owned(),
        Type::Bool(_) => "bool".to_owned(),
        Type::Text(_) => "text".to_owned(),
        Type::Range(..) => "range".to_owned(),
        Type::Tuple(types) => match (types.len(), types.first()) {
            (n @ 2..=3, Some(first)) if types.iter().all(|t| t == first) && *first == Type::LENGTH => {
                format!("point{n}")
            }
            (n @ 2..=3, Some(first)) if types.iter().all(|t| t == first) && *first == Type::REAL => format!("vec{n}"),
            _ => format!("({})", list(types)),
        },
        Type::Array(element, _) => format!("[{}]", written_type(element)),
        Type::Record(fields) => {
            let fields: Vec<String> = fields.iter().map(|(name, ty)| format!("{name}: {}", written_type(ty))).collect();
            format!("{{{}}}", fields.join(", "))
        }
        Type::Closure(_) => "function".to_owned(),
    }
}

fn written_dimension(d: Dimension) -> String {
    if d == Dimension::ANGLE {
        return "angle".to_owned();
    }
    let named = [(Exponent::ZERO, "real"), (Exponent::ONE, "length")];
    if let Some((_, name)) = named.iter().find(|(e, _)| *e == d.length) {
        return (*name).to_owned();
    }
    match d.length.to_string().as_str() {
        "2" => "area".to_owned(),
        "3" => "volume".to_owned(),
        n => format!("length^{n}"),
    }
}
