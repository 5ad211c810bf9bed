//! Types in the user's words.

use super::context::{Callee, Checker};
use super::solids::is_solid;
use super::types::{Dimension, Type};

impl Checker<'_> {
    /// A type with an article: `a length`, `a point in space`, `a function of 2 arguments`.
    pub(super) fn describe(&self, ty: &Type) -> String {
        match ty {
            Type::Error => "something wrong".to_owned(),
            Type::Real(dimension) => dimension.to_string(),
            Type::Int(_) => "a whole number".to_owned(),
            Type::Bool(_) => "a truth value".to_owned(),
            Type::Text(_) => "a text".to_owned(),
            Type::Range(..) => "a range".to_owned(),
            Type::Tuple(types) => self.describe_tuple(types),
            Type::Array(_, 0) => "an empty array".to_owned(),
            Type::Array(element, n) => format!("an array of {n} ({} each)", self.describe(element)),
            Type::Record(fields) => {
                if is_solid(ty) {
                    return "a solid".to_owned();
                }
                let names: Vec<&str> = fields.iter().map(|(name, _)| &**name).collect();
                format!("a record with {}", names.join(", "))
            }
            Type::Closure(id) => {
                if let Callee::Model(_, model) = self.closure(*id).callee {
                    return format!("the model '{}'", model.name.text);
                }
                match self.arity(*id) {
                    0 => "a function without arguments".to_owned(),
                    1 => "a function of one argument".to_owned(),
                    n => format!("a function of {n} arguments"),
                }
            }
        }
    }

    fn describe_tuple(&self, types: &[Type]) -> String {
        if let Some(words) = vector_words(types) {
            return words;
        }
        if types.is_empty() {
            return "nothing".to_owned();
        }
        if types.len() > 4 {
            return format!("a tuple of {}", types.len());
        }
        let parts: Vec<String> = types.iter().map(|t| self.describe(t)).collect();
        match &parts[..] {
            [first @ .., last] if !first.is_empty() => format!("a tuple of {} and {last}", first.join(", ")),
            _ => format!("a tuple of {}", parts.join("")),
        }
    }
}

/// Words for tuples of two or three numbers of one kind.
pub(super) fn vector_words(types: &[Type]) -> Option<String> {
    let first = match types.first()? {
        Type::Int(_) => Dimension::NONE,
        Type::Real(d) => *d,
        _ => return None,
    };
    let same = types.iter().all(|t| match t {
        Type::Int(_) => first.is_none(),
        Type::Real(d) => *d == first,
        _ => false,
    });
    if !same || !(2..=3).contains(&types.len()) {
        return None;
    }
    let n = types.len();
    Some(match first {
        Dimension::LENGTH if n == 3 => "a point in space".to_owned(),
        Dimension::LENGTH => "a point in the plane".to_owned(),
        Dimension::NONE => format!("a vector of {n} bare numbers"),
        Dimension::ANGLE => format!("a tuple of {n} angles"),
        d => format!("a vector of {n}, {d} each"),
    })
}
