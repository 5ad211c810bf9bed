//! The layout of values as scalars.

use crate::check::typed::{self, Type};
use crate::ir;

impl typed::Model {
    /// Calls `f` with the name and type of every scalar of a value of that name and type, in order. Names are like
    /// `p.x`, `xs[2]`, `c.radius`.
    pub(super) fn name_scalars(&self, name: &str, ty: &Type, f: &mut impl FnMut(String, ir::Type)) {
        match ty {
            Type::Real(_) => f(name.to_owned(), ir::Type::Real),
            Type::Int(_) => f(name.to_owned(), ir::Type::Int),
            Type::Bool(_) => f(name.to_owned(), ir::Type::Bool),
            Type::Text(_) | Type::Error => {}
            Type::Range(..) => {
                f(dotted(name, "from"), ir::Type::Int);
                f(dotted(name, "to"), ir::Type::Int);
            }
            Type::Tuple(types) => {
                let vector = types.len() <= 3 && types.iter().all(|t| matches!(t, Type::Real(_)));
                for (i, ty) in types.iter().enumerate() {
                    let name = if vector { dotted(name, ["x", "y", "z"][i]) } else { dotted(name, &i.to_string()) };
                    self.name_scalars(&name, ty, f);
                }
            }
            Type::Array(ty, n) => (0..*n).for_each(|i| self.name_scalars(&format!("{name}[{i}]"), ty, f)),
            Type::Record(fields) => {
                fields.iter().for_each(|(field, ty)| self.name_scalars(&dotted(name, field), ty, f))
            }
            Type::Closure(id) => {
                let captures = &self.closures[id.0 as usize].captures;
                captures.iter().for_each(|(field, ty)| self.name_scalars(&dotted(name, field), ty, f));
            }
        }
    }

    /// The types of a value's scalars.
    pub(super) fn scalars(&self, ty: &Type) -> Vec<ir::Type> {
        let mut types = Vec::new();
        self.push_scalars(ty, &mut types);
        types
    }

    fn push_scalars(&self, ty: &Type, out: &mut Vec<ir::Type>) {
        match ty {
            Type::Real(_) => out.push(ir::Type::Real),
            Type::Int(_) => out.push(ir::Type::Int),
            Type::Bool(_) => out.push(ir::Type::Bool),
            Type::Text(_) | Type::Error => {}
            Type::Range(..) => out.extend([ir::Type::Int; 2]),
            Type::Tuple(types) => types.iter().for_each(|ty| self.push_scalars(ty, out)),
            Type::Array(ty, n) => {
                let element = self.scalars(ty);
                (0..*n).for_each(|_| out.extend_from_slice(&element));
            }
            Type::Record(fields) => fields.iter().for_each(|(_, ty)| self.push_scalars(ty, out)),
            Type::Closure(id) => {
                self.closures[id.0 as usize].captures.iter().for_each(|(_, ty)| self.push_scalars(ty, out));
            }
        }
    }

    /// The number of a value's scalars.
    pub(super) fn width(&self, ty: &Type) -> usize {
        match ty {
            Type::Real(_) | Type::Int(_) | Type::Bool(_) => 1,
            Type::Text(_) | Type::Error => 0,
            Type::Range(..) => 2,
            Type::Tuple(types) => types.iter().map(|ty| self.width(ty)).sum(),
            Type::Array(ty, n) => self.width(ty).saturating_mul(*n),
            Type::Record(fields) => fields.iter().map(|(_, ty)| self.width(ty)).sum(),
            Type::Closure(id) => self.closures[id.0 as usize].captures.iter().map(|(_, ty)| self.width(ty)).sum(),
        }
    }

    /// The scalars of component k of a tuple, array, record or range: the index of the first, and how many.
    pub(super) fn component(&self, ty: &Type, k: usize) -> (usize, usize) {
        match ty {
            Type::Tuple(types) => self.field(types.iter(), k),
            Type::Record(fields) => self.field(fields.iter().map(|(_, ty)| ty), k),
            Type::Closure(id) => self.field(self.closures[id.0 as usize].captures.iter().map(|(_, ty)| ty), k),
            Type::Array(ty, _) => {
                let width = self.width(ty);
                (k * width, width)
            }
            _ => (k, 1),
        }
    }

    fn field<'t>(&self, mut types: impl Iterator<Item = &'t Type>, k: usize) -> (usize, usize) {
        let start = types.by_ref().take(k).map(|ty| self.width(ty)).sum();
        (start, types.next().map_or(0, |ty| self.width(ty)))
    }
}

fn dotted(name: &str, field: &str) -> String {
    if name.is_empty() { field.to_owned() } else { format!("{name}.{field}") }
}
