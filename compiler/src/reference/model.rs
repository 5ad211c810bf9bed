//! Models.

use super::harmless::code;
use super::page::Page;
use crate::syntax::ast::{Expr, Item, ItemKind, Limit, Model, ParamDecl, Pattern, Sign, Tolerance};

impl Page<'_> {
    /// A model, under a heading of level 2.
    pub(super) fn model(&mut self, heading: &str, doc: &str, model: &Model) {
        self.heading(2, heading);
        self.paragraph(doc);
        self.declared("Parameters", "Parameter", &model.items, |kind| match kind {
            ItemKind::Param(decl) => Some(decl),
            _ => None,
        });
        self.declared("Inputs", "Input", &model.items, |kind| match kind {
            ItemKind::Input(decl) => Some(decl),
            _ => None,
        });
        let mut lists = Lists::default();
        self.within(&model.items, &Place::default(), &mut lists);
        for (title, list) in
            [("Requirements", &lists.requirements), ("Parts", &lists.parts), ("Measures", &lists.measures)]
        {
            if !list.is_empty() {
                self.heading(3, title);
                self.list(list);
            }
        }
        self.definitions(3, &model.items);
    }

    /// The table of parameters or of inputs.
    fn declared(&mut self, title: &str, head: &str, items: &[Item], pick: fn(&ItemKind) -> Option<&ParamDecl>) {
        let mut rows = Vec::new();
        for (item, decl) in items.iter().filter_map(|i| pick(&i.kind).map(|decl| (i, decl))) {
            let (low, high) = decl.bounds.as_ref().map_or((None, None), |(low, high)| (Some(low), Some(high)));
            let written = |e: Option<&Expr>| self.code(e.map(|e| e.span));
            rows.push(vec![
                format!("`{}`", decl.name.text),
                self.written(decl.ty.span),
                written(low),
                written(high),
                written(decl.default.as_ref()),
                item.doc.clone(),
            ]);
        }
        if !rows.is_empty() {
            self.heading(3, title);
            self.table(&[head, "Quantity", "From", "To", "Default", "Description"], &rows);
        }
    }

    /// Requirements, parts and measures among items, and within their loops and conditions.
    fn within(&self, items: &[Item], place: &Place, lists: &mut Lists) {
        for item in items {
            match &item.kind {
                ItemKind::Require(decl) => {
                    let message = decl.message.as_deref().map(|m| format!(": {m}")).unwrap_or_default();
                    lists.requirements.push(format!(
                        "{}{}{message}",
                        code(&self.written(decl.condition.span)),
                        place.text()
                    ));
                }
                ItemKind::Part(decl) => {
                    let doc = if item.doc.is_empty() { String::new() } else { format!(": {}", item.doc) };
                    let tolerance = decl.tolerance.as_ref().map(|t| self.code(Some(t.span)));
                    let tolerance = tolerance.map(|t| format!(", tolerance {t}")).unwrap_or_default();
                    lists.parts.push(format!("`{}{}`{tolerance}{}{doc}", decl.name.text, place.index(), place.text()));
                }
                ItemKind::Measure(decl) => {
                    let doc = if item.doc.is_empty() { String::new() } else { format!(": {}", item.doc) };
                    let tolerance = decl.tolerance.as_ref().map(|t| format!(", tolerance {}", code(&self.limits(t))));
                    let (name, tolerance) = (&decl.name.text, tolerance.unwrap_or_default());
                    let value = self.written(decl.value.span);
                    let parts: Vec<String> = decl.parts.iter().map(|p| format!("`{}`", p.text)).collect();
                    let of = if parts.is_empty() { String::new() } else { format!(", of {}", parts.join(" and ")) };
                    lists.measures.push(format!(
                        "{}{of}{tolerance}{}{doc}",
                        code(&format!("{name}{} = {value}", place.index())),
                        place.text()
                    ));
                }
                ItemKind::For(decl) => {
                    let turns = format!(
                        "for {} in {}",
                        code(&self.pattern(&decl.pattern)),
                        self.code(Some(decl.iterable.span))
                    );
                    self.within(&decl.items, &place.and(turns, true), lists);
                }
                ItemKind::If(decl) => {
                    let condition = self.code(Some(decl.condition.span));
                    self.within(&decl.then, &place.and(format!("where {condition}"), false), lists);
                    let otherwise = place.and(format!("where not {condition}"), false);
                    self.within(&decl.otherwise, &otherwise, lists);
                }
                _ => {}
            }
        }
    }

    /// A tolerance as it is written.
    fn limits(&self, tolerance: &Tolerance) -> String {
        let limit = |limit: &Limit| {
            let sign = match limit.sign {
                Some(Sign::Plus) => "+",
                Some(Sign::Minus) => "-",
                None => "",
            };
            format!("{sign}{}", self.written(limit.value.span))
        };
        match tolerance {
            Tolerance::Symmetric(value) => self.written(value.span),
            Tolerance::Limits(limits) => limits.each_ref().map(limit).join("/"),
            Tolerance::Error => String::new(),
        }
    }

    fn pattern(&self, pattern: &Pattern) -> String {
        self.written(pattern.span())
    }
}

/// What a model's body has beside its parameters, inputs and functions, as items of lists.
#[derive(Default)]
struct Lists {
    requirements: Vec<String>,
    parts: Vec<String>,
    measures: Vec<String>,
}

/// The loops and conditions around an item.
#[derive(Clone, Default)]
struct Place {
    around: Vec<String>,
    repeated: bool,
}

impl Place {
    fn and(&self, text: String, repeated: bool) -> Place {
        let mut around = self.around.clone();
        around.push(text);
        Place { around, repeated: self.repeated || repeated }
    }

    fn text(&self) -> String {
        self.around.iter().map(|text| format!(", {text}")).collect()
    }

    /// The parts of loops are numbered.
    fn index(&self) -> &'static str {
        if self.repeated { "[0], [1], ..." } else { "" }
    }
}
