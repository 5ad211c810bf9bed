//! Reference pages in Markdown, from doc comments.
//!
//! [`script`] describes the declarations of a script: models with their parameters, inputs, requirements, parts and
//! functions, everything as it is written. [`library`] describes the standard library, one page a module. Names that
//! begin with `_` are private and left out.

mod harmless;
mod library;
mod model;
mod page;

#[cfg(test)]
mod tests;

pub use library::library;

use crate::diagnostic::Diagnostic;
use crate::source::FileId;
use crate::syntax::{self, ast::ItemKind};
use page::Page;

/// A page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Document {
    /// The name of its file: `curve.md`.
    pub name: String,
    /// Markdown.
    pub text: String,
}

/// The page of a script, under a title such as the name of its file.
///
/// # Errors
/// The syntax errors of the script.
pub fn script(title: &str, file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    let (tree, diagnostics) = syntax::parse(file, text);
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let mut page = Page::new(text);
    page.heading(1, title);
    page.introduction();
    for item in &tree.items {
        if let ItemKind::Model(model) = &item.kind {
            page.model(&format!("Model {}", model.name.text), &item.doc, model);
        }
    }
    page.definitions(2, &tree.items);
    Ok(page.finish())
}
