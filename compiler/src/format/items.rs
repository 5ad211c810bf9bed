//! Items.

use super::branches::Branches;
use super::document::DocId;
use super::lists::Spread;
use super::writer::{Piece, Writer};
use crate::syntax::ast::*;
use crate::syntax::token::Token;

impl Writer<'_> {
    pub(super) fn item(&mut self, item: &Item) -> DocId {
        match &item.kind {
            ItemKind::Use(decl) => self.uses(decl),
            ItemKind::Function(decl) => self.function(decl),
            ItemKind::Derivative(decl) => {
                let keyword = self.token_between("", " ");
                // Up to the parenthesis after the tangents.
                let last = decl.tangents.last().map_or(0, |t| t.span.end);
                let header = self.plain(last);
                let comma = if self.cursor.at(Token::Comma) { self.plain(self.cursor.start() + 1) } else { header };
                let close = self.token();
                let mut docs = vec![keyword, header];
                docs.extend((comma != header).then_some(comma));
                docs.push(close);
                self.body(&decl.body, docs)
            }
            ItemKind::Let(decl) => {
                let keyword = self.token_between("", " ");
                let pattern = self.plain(decl.pattern.span().end);
                let ty = self.annotation(decl.ty.as_ref());
                let value = self.assigned(Some(&decl.value));
                self.docs.concat(vec![keyword, pattern, ty, value])
            }
            ItemKind::Model(decl) => {
                let keyword = self.token_between("", " ");
                let name = self.token_between("", " ");
                let block = self.block(&decl.items, None).doc;
                self.docs.concat(vec![keyword, name, block])
            }
            ItemKind::Param(decl) | ItemKind::Input(decl) => self.param(decl),
            ItemKind::Part(decl) => {
                let keyword = self.token_between("", " ");
                let mut docs = vec![keyword, self.token()];
                if let Some(tolerance) = &decl.tolerance {
                    docs.push(self.token_between(" ", " "));
                    docs.push(self.expr(tolerance).doc);
                }
                docs.push(self.assigned(Some(&decl.shape)));
                self.docs.concat(docs)
            }
            ItemKind::Measure(decl) => self.measure(decl),
            ItemKind::Require(decl) => self.require(decl),
            ItemKind::For(decl) => {
                let head = self.for_head(&decl.pattern, &decl.iterable);
                let block = self.block(&decl.items, None).doc;
                self.docs.concat(vec![head, block])
            }
            ItemKind::If(decl) => self.if_items(decl),
            // Files with errors are not formatted.
            ItemKind::Error => self.plain(item.span.end),
        }
    }

    fn uses(&mut self, decl: &Use) -> DocId {
        let keyword = self.token_between("", " ");
        let path = match &decl.path {
            UsePath::Module(path) => self.plain(path.last().map_or(0, |name| name.span.end)),
            UsePath::File(_, span) => self.plain(span.end),
        };
        let mut docs = vec![keyword, path];
        if let Some(names) = &decl.names {
            docs.push(self.docs.text(" "));
            let list = self.list(names, Spread::Filled, |n| n.span.end, |w, _| Piece::weak(w.token()));
            docs.push(list.doc);
        }
        self.docs.concat(docs)
    }

    fn function(&mut self, decl: &FunctionDecl) -> DocId {
        let keyword = self.token_between("", " ");
        let name = self.token();
        let params = self.list(&decl.params, Spread::Listed, param_end, |w, param| {
            let pattern = w.plain(param.pattern.span().end);
            let ty = w.annotation(param.ty.as_ref());
            let default = w.assigned(param.default.as_ref());
            Piece::weak(w.docs.concat(vec![pattern, ty, default]))
        });
        let mut docs = vec![keyword, name, params.doc];
        if let Some(result) = &decl.result {
            docs.push(self.token_between(" ", " "));
            docs.push(self.plain(result.span.end));
        }
        self.body(&decl.body, docs)
    }

    /// A function's body after its header: `= expr`, or a block.
    fn body(&mut self, body: &Expr, mut docs: Vec<DocId>) -> DocId {
        if self.cursor.at(Token::Equals) {
            docs.push(self.assigned(Some(body)));
        } else {
            docs.push(self.docs.text(" "));
            docs.push(self.expr(body).doc);
        }
        self.docs.concat(docs)
    }

    /// `: type`, if there is one.
    pub(super) fn annotation(&mut self, ty: Option<&TypeExpr>) -> DocId {
        let Some(ty) = ty else { return self.docs.text("") };
        let colon = self.token_between("", " ");
        let ty = self.plain(ty.span.end);
        self.docs.concat(vec![colon, ty])
    }

    /// `= value`, if there is one.
    fn assigned(&mut self, value: Option<&Expr>) -> DocId {
        let Some(value) = value else { return self.docs.text("") };
        let equals = self.token_between(" ", "");
        let value = self.after(value);
        self.docs.concat(vec![equals, value])
    }

    fn param(&mut self, decl: &ParamDecl) -> DocId {
        let keyword = self.token_between("", " ");
        let name = self.token();
        let ty = self.annotation(Some(&decl.ty));
        let mut docs = vec![keyword, name, ty];
        if let Some((low, high)) = &decl.bounds {
            docs.push(self.token_between(" ", " "));
            docs.push(self.expr(low).doc);
            docs.push(self.token());
            docs.push(self.expr(high).doc);
        }
        docs.push(self.assigned(decl.default.as_ref()));
        self.docs.concat(docs)
    }

    fn measure(&mut self, decl: &MeasureDecl) -> DocId {
        let keyword = self.token_between("", " ");
        let mut docs = vec![keyword, self.token()];
        if let Some(last) = decl.parts.last() {
            docs.push(self.token_between(" ", " "));
            docs.push(self.plain(last.span.end));
        }
        if decl.tolerance.is_some() {
            docs.push(self.token_between(" ", " "));
        }
        match &decl.tolerance {
            Some(Tolerance::Symmetric(value)) => docs.push(self.expr(value).doc),
            Some(Tolerance::Limits([first, second])) => {
                docs.extend(first.sign.map(|_| self.token()));
                docs.push(self.expr(&first.value).doc);
                docs.push(self.token());
                docs.extend(second.sign.map(|_| self.token()));
                docs.push(self.expr(&second.value).doc);
            }
            // Files with errors are not formatted.
            Some(Tolerance::Error) | None => {}
        }
        docs.push(self.assigned(Some(&decl.value)));
        self.docs.concat(docs)
    }

    fn require(&mut self, decl: &Require) -> DocId {
        let keyword = self.token_between("", " ");
        let mut docs = vec![keyword, self.expr(&decl.condition).doc];
        if decl.message.is_some() {
            docs.push(self.token());
            let line = self.docs.line(" ");
            let message = self.token();
            docs.push(self.docs.nest(vec![line, message]));
        }
        self.docs.group(docs)
    }

    /// `for pattern in iterable `
    pub(super) fn for_head(&mut self, pattern: &Pattern, iterable: &Expr) -> DocId {
        let keyword = self.token_between("", " ");
        let pattern = self.plain(pattern.span().end);
        let word = self.token_between(" ", " ");
        let iterable = self.expr(iterable).doc;
        let space = self.docs.text(" ");
        self.docs.concat(vec![keyword, pattern, word, iterable, space])
    }

    fn if_items(&mut self, decl: &IfItems) -> DocId {
        let mut branches = Branches::default();
        let (mut decl, mut word) = (decl, None);
        loop {
            let head = self.if_head(word, &decl.condition);
            branches.push(head, self.block(&decl.then, None));
            if !self.cursor.at(Token::Else) {
                break;
            }
            let otherwise = self.else_word(&mut branches);
            match decl.otherwise.as_slice() {
                [Item { kind: ItemKind::If(next), .. }] if self.cursor.at(Token::If) => {
                    (decl, word) = (next, Some(otherwise));
                }
                items => {
                    branches.push(otherwise, self.block(items, None));
                    break;
                }
            }
        }
        self.branches(&branches).here(&mut self.docs)
    }
}

/// The end of a function's parameter.
pub(super) fn param_end(param: &FnParam) -> u32 {
    let ty = param.ty.as_ref().map(|t| t.span.end);
    param.default.as_ref().map(|e| e.span.end).or(ty).unwrap_or_else(|| param.pattern.span().end)
}
