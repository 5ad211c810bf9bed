//! The fonts that a file names: those of its calls of `glyphs`.

use super::walk::{Binder, Scope, Walk};
use crate::syntax::ast::{Arg, ExprKind, Ident, Item};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The bytes of fonts by their paths as written, or why they cannot be read.
pub(crate) type Fonts = BTreeMap<String, Result<Arc<[u8]>, String>>;

/// The paths of fonts in calls of `glyphs`, as written.
pub(super) fn named_in(items: &[Item]) -> Vec<&str> {
    let mut walk = Walk(Named(Vec::new()));
    walk.items(items, None);
    walk.0.0
}

struct Named<'a>(Vec<&'a str>);

impl<'a> Scope<'a> for Named<'a> {
    fn used(&mut self, _name: &'a str) {}

    fn bind(&mut self, _name: &'a Ident, _binder: Binder) {}

    fn called(&mut self, name: &'a str, args: &'a [Arg], before: usize) {
        if name != "glyphs" {
            return;
        }
        let labelled = args.iter().find(|arg| arg.label.as_ref().is_some_and(|label| label.text == "font"));
        let font = labelled.or_else(|| args.iter().filter(|arg| arg.label.is_none()).nth(1 - before));
        if let Some(ExprKind::Text(path)) = font.map(|arg| &arg.value.kind) {
            self.0.push(path);
        }
    }

    fn len(&self) -> usize {
        0
    }

    fn truncate(&mut self, _len: usize) {}
}
