//! The finished tree: the functions that are used.

use super::context::Checker;
use super::typed::{Closure, Expr, FunctionId, Model};

/// Copies the functions that the model uses into it, with closures and locals.
pub(super) fn finish(checker: &Checker<'_>, model: &mut Model) {
    let mut open = Vec::new();
    model.for_each_root(&mut |e| callees(e, &mut open));
    while let Some(id) = open.pop() {
        if let Some(function) = checker.function(id)
            && !model.functions.contains_key(&id)
        {
            callees(&function.body, &mut open);
            open.extend(function.custom_derivative.iter().map(|d| d.function));
            model.functions.insert(id, function.clone());
        }
    }
    model.closures = checker
        .closures
        .iter()
        .map(|c| Closure {
            name: c.name.to_string(),
            captures: c.captures.iter().map(|(name, ty)| ((*name).to_owned(), ty.clone())).collect(),
        })
        .collect();
    model.locals = checker.locals.clone();
}

fn callees(e: &Expr, out: &mut Vec<FunctionId>) {
    if let Some(call) = e.call() {
        out.push(call.function);
    }
    e.for_each_child(&mut |child| callees(child, out));
}
