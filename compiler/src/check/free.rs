//! The names that a function uses from outside of itself, and all names of a file.

use super::walk::{Binder, Scope, Walk};
use crate::syntax::ast::{DerivativeDecl, Expr, FnParam, FunctionDecl, Ident, Item};
use std::collections::{HashMap, HashSet};

/// Names that occur free in a lambda, each once, in the order of their first use.
pub(crate) fn of_lambda<'a>(params: &'a [FnParam], body: &'a Expr) -> Vec<&'a str> {
    let mut walk = Walk(Free::default());
    walk.function(params, body);
    walk.0.free
}

/// Names that occur free in a function and its custom derivative, its own name not among them.
pub(super) fn of_function<'a>(decl: &'a FunctionDecl, derivative: Option<&'a DerivativeDecl>) -> Vec<&'a str> {
    let mut walk = Walk(Free::default());
    walk.0.bind(&decl.name, Binder::Function);
    walk.function(&decl.params, &decl.body);
    if let Some(derivative) = derivative {
        walk.derivative(derivative);
    }
    walk.0.free
}

/// Names that occur in items and are not bound within the same expression.
pub(crate) fn of_items(items: &[Item]) -> Vec<&str> {
    let mut walk = Walk(Free::default());
    walk.items(items, None);
    walk.0.free
}

#[derive(Default)]
struct Free<'a> {
    bound: Vec<&'a str>,
    /// How often each name is bound at present.
    counts: HashMap<&'a str, u32>,
    free: Vec<&'a str>,
    seen: HashSet<&'a str>,
}

impl<'a> Scope<'a> for Free<'a> {
    fn used(&mut self, name: &'a str) {
        if self.counts.get(name).is_none_or(|n| *n == 0) && self.seen.insert(name) {
            self.free.push(name);
        }
    }

    fn bind(&mut self, name: &'a Ident, _: Binder) {
        self.bound.push(&name.text);
        *self.counts.entry(&name.text).or_default() += 1;
    }

    fn len(&self) -> usize {
        self.bound.len()
    }

    fn truncate(&mut self, len: usize) {
        for name in self.bound.drain(len..) {
            if let Some(count) = self.counts.get_mut(name) {
                *count -= 1;
            }
        }
    }
}
