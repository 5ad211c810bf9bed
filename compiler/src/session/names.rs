//! Names in scope, for completion and help.

use super::Session;
use crate::check::scope::{Kind, Known};
use crate::check::typed::Type;
use crate::source::Loader;
use std::collections::BTreeMap;

impl Session {
    /// All names that can be used, with what they stand for, sorted.
    #[must_use]
    pub fn names(&self) -> BTreeMap<String, Kind> {
        self.scope.names()
    }

    /// What is known of a name (`mix`, `std.math.mix`): how it is declared, its doc comment, its arguments' labels.
    #[must_use]
    pub fn known(&self, name: &str) -> Option<Known> {
        self.scope.known(name)
    }

    /// The modules of the standard library: `std.math`.
    #[must_use]
    pub fn modules(&self) -> Vec<String> {
        self.scope.modules()
    }

    /// What may follow a value, or the name of a module, and a dot.
    pub fn fields(&mut self, text: &str, loader: &dyn Loader) -> Vec<String> {
        let members = self.scope.members(text);
        if !members.is_empty() {
            return members;
        }
        let found = self.with_expression(text, loader, |_, checked| {
            Ok(match checked.answers.last().and_then(|a| a.value.as_ref()).map(|v| &v.ty) {
                Some(Type::Record(fields)) => fields.iter().map(|(name, _)| name.to_string()).collect(),
                Some(Type::Tuple(parts)) if parts.len() <= 3 => {
                    ["x", "y", "z"].iter().take(parts.len()).map(|n| (*n).to_owned()).collect()
                }
                _ => Vec::new(),
            })
        });
        found.unwrap_or_default()
    }
}
