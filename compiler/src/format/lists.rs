//! Lists in brackets.

use super::document::{DocId, Fit};
use super::writer::{Piece, Writer};
use crate::syntax::token::Token;

/// The way to break a list that does not fit on its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    /// Within its one argument that has brackets, or else one argument a line.
    Arguments,
    /// One element a line.
    Listed,
    /// As many elements a line as fit.
    Filled,
}

/// The elements of a list as documents.
#[derive(Default)]
struct Elements {
    /// Each without its comma.
    pieces: Vec<Piece>,
    /// The content of the brackets if the list is broken.
    within: Vec<DocId>,
    /// The list must be broken: it has comments between the elements, or a comma after the last.
    forced: bool,
    /// A filled list ends with a comma where it is broken.
    comma_after: bool,
}

impl Writer<'_> {
    /// A list from its opening bracket on. `end` tells where an element ends.
    pub(super) fn list<T>(
        &mut self,
        items: &[T],
        spread: Spread,
        end: impl Fn(&T) -> u32,
        element: impl Fn(&mut Self, &T) -> Piece,
    ) -> Piece {
        let open = self.token();
        let mut elements = Elements { forced: self.docs.forced(open), ..Elements::default() };
        for (i, item) in items.iter().enumerate() {
            let comments = self.separate(i, spread, &mut elements);
            self.ends.push(end(item));
            let piece = element(self, item);
            self.ends.pop();
            elements.pieces.push(piece);
            let last = i + 1 == items.len();
            self.comma(comments, piece, last, spread, &mut elements);
        }
        if items.is_empty() {
            elements.within = self.comments_before();
        }
        let close = self.token();
        self.bracketed(open, elements, close, spread)
    }

    /// The line end before an element and the comments above it; those of a filled list are returned.
    fn separate(&mut self, index: usize, spread: Spread, elements: &mut Elements) -> Vec<DocId> {
        let mut lines = Vec::new();
        let end = self.comments_above(index == 0, &mut lines);
        elements.forced |= !lines.is_empty();
        if spread == Spread::Filled {
            return lines;
        }
        let blank = (index > 0 || !lines.is_empty()) && self.cursor.blank_between(end, self.cursor.start());
        elements.within.append(&mut lines);
        elements.within.extend(blank.then(|| self.docs.blank()));
        elements.within.push(self.docs.line(if index == 0 { "" } else { " " }));
        Vec::new()
    }

    /// The comments above an element or closing bracket; returns the end of the last token or comment before it.
    fn comments_above(&mut self, first: bool, lines: &mut Vec<DocId>) -> u32 {
        let (mut end, mut first) = (self.cursor.end(), first);
        while let Some(comment) = self.cursor.comment_before() {
            if !first && self.cursor.blank_between(end, comment.start) {
                lines.push(self.docs.blank());
            }
            lines.push(self.docs.own_comment(comment.text));
            (end, first) = (comment.start + comment.text.len() as u32, false);
        }
        end
    }

    /// An element with its comma, the comments above it, and those around the comma.
    fn comma(&mut self, above: Vec<DocId>, piece: Piece, last: bool, spread: Spread, elements: &mut Elements) {
        let mut comments: Vec<DocId> = self.comment_after().into_iter().collect();
        if self.cursor.at(Token::Comma) {
            self.comments_above(false, &mut comments);
            self.cursor.take();
            comments.extend(self.comment_after());
            // A comma after the last element asks for one element a line.
            elements.forced |= last && spread != Spread::Filled;
        }
        if last {
            self.comments_above(false, &mut comments);
        }
        elements.forced |= !comments.is_empty();
        // The elements of a filled list are flat: its last comma stands behind them, unless a comment does.
        let after = last && spread == Spread::Filled && comments.is_empty();
        let comma = match (last, spread) {
            _ if after => self.docs.text(""),
            (true, Spread::Arguments | Spread::Listed) => self.docs.when_broken(","),
            _ => self.docs.text(","),
        };
        elements.comma_after = after;
        let mut docs = above;
        docs.extend([piece.doc, comma]);
        docs.append(&mut comments);
        if spread == Spread::Filled {
            elements.within.push(self.docs.concat(docs));
        } else {
            elements.within.append(&mut docs);
        }
    }

    fn bracketed(&mut self, open: DocId, elements: Elements, close: DocId, spread: Spread) -> Piece {
        if elements.within.is_empty() {
            return Piece::weak(self.docs.concat(vec![open, close]));
        }
        let empty = self.docs.line("");
        let within = if spread == Spread::Filled {
            let filled = self.docs.fill(elements.within);
            let comma = if elements.comma_after { self.docs.when_broken(",") } else { self.docs.text("") };
            self.docs.nest(vec![empty, filled, comma])
        } else {
            self.docs.nest(elements.within)
        };
        let mut docs = vec![open, within, empty, close];
        if elements.forced {
            docs.push(self.docs.force());
        }
        // This holds also for a list that must be broken: the comma that another layout wrote after its last element
        // must not change how the lists around it are broken.
        let strong = spread == Spread::Arguments && elements.pieces.iter().filter(|p| p.strong).count() == 1;
        let hugged = if spread == Spread::Arguments && !elements.forced { self.hugged(&elements.pieces) } else { None };
        let Some(index) = hugged else {
            return Piece { doc: self.docs.group(docs), strong };
        };
        let spread = self.docs.concat(docs);
        let hug = self.hug(open, &elements.pieces, index, close);
        let mut layouts = vec![(Fit::Flat, spread)];
        if !strong {
            layouts.push((Fit::Whole, spread));
        }
        layouts.extend([(Fit::First, hug), (Fit::Always, spread)]);
        Piece { doc: self.docs.choice(layouts), strong }
    }

    /// The argument that is broken in place of the list: the only one with brackets, or the only one.
    fn hugged(&self, pieces: &[Piece]) -> Option<usize> {
        let strong: Vec<usize> = (0..pieces.len()).filter(|i| pieces[*i].strong).collect();
        let index = match strong.as_slice() {
            [only] => *only,
            [] if pieces.len() == 1 => 0,
            _ => return None,
        };
        let others_forced = pieces.iter().enumerate().any(|(i, p)| i != index && self.docs.forced(p.doc));
        (!others_forced).then_some(index)
    }

    /// The list with one broken element.
    fn hug(&mut self, open: DocId, pieces: &[Piece], index: usize, close: DocId) -> DocId {
        let comma = self.docs.text(", ");
        let mut docs = vec![open];
        for (i, piece) in pieces.iter().enumerate() {
            if i > 0 {
                docs.push(comma);
            }
            docs.push(if i == index { piece.doc } else { self.docs.flat(piece.doc) });
        }
        docs.push(close);
        self.docs.concat(docs)
    }
}
