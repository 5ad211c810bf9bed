//! The standard library: a page a module, and an index of them.

use super::Document;
use super::page::{Page, introduction, public_name, summary};
use crate::check::STANDARD_LIBRARY;
use crate::source::FileId;
use crate::syntax::{self, ast::Item, ast::ItemKind};
use std::fmt::Write;

/// The pages of the standard library; the index is the first.
#[must_use]
pub fn library() -> Vec<Document> {
    let modules: Vec<Module> = STANDARD_LIBRARY.iter().map(|(name, text)| Module::new(name, text)).collect();
    let mut pages = vec![Document { name: "README.md".to_owned(), text: index(&modules) }];
    pages.extend(modules.iter().map(|m| Document { name: format!("{}.md", m.short()), text: m.page() }));
    pages
}

struct Module {
    name: &'static str,
    text: &'static str,
    /// The public items.
    items: Vec<Item>,
}

impl Module {
    fn new(name: &'static str, text: &'static str) -> Module {
        let (tree, _) = syntax::parse(FileId(0), text);
        let items = tree.items.into_iter().filter(|item| public_name(item).is_some()).collect();
        Module { name, text, items }
    }

    fn short(&self) -> &'static str {
        self.name.rsplit('.').next().unwrap_or(self.name)
    }

    fn page(&self) -> String {
        let mut page = Page::new(self.text);
        page.heading(1, self.name);
        page.introduction();
        let first = self.items.first().and_then(public_name).unwrap_or("...");
        page.paragraph(&format!(
            "Its names are known everywhere; `use {} ({first})` says where one comes from.",
            self.name
        ));
        for item in &self.items {
            match &item.kind {
                ItemKind::Model(model) => page.model(&model.name.text, &item.doc, model),
                _ => page.definition(2, item),
            }
        }
        page.finish()
    }
}

fn index(modules: &[Module]) -> String {
    let mut out = String::from(
        "# The standard library\n\nWritten in the language itself; `gmlc doc std` makes these pages from its files. Its names are \
         known without `use`, and a script's own go before them. What is built into the compiler is listed in \
         [the language's reference](../language.md#built-in-functions).\n",
    );
    for module in modules {
        let _ = write!(out, "\n## [{}]({}.md)\n\n", module.name, module.short());
        let text = introduction(module.text);
        if !text.is_empty() {
            let _ = write!(out, "{text}\n\n");
        }
        for item in &module.items {
            let Some(name) = public_name(item) else { continue };
            // Anchors are in small letters.
            let anchor = name.to_lowercase();
            let _ = writeln!(out, "- [{name}]({}.md#{anchor}): {}", module.short(), summary(&item.doc));
        }
    }
    out
}
