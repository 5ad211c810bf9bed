//! Documents: text with the places where its lines may be broken.
//!
//! The algebra is that of P. Wadler, *A prettier printer* (2003), with choices between whole layouts and with comments,
//! which end a line wherever they stand. Documents lie in an arena, so that several layouts can share their parts.

/// A document in [`Docs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DocId(u32);

/// When a layout of a [`Doc::Choice`] is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    /// All of it fits on the line.
    Flat,
    /// Every line fits, if all within it is flat but its own line breaks.
    Whole,
    /// Its first line fits.
    First,
    /// Always.
    Always,
}

/// A document.
#[derive(Clone, Debug)]
pub(super) enum Doc<'t> {
    /// Text without line ends.
    Text(&'t str),
    /// This text where it is flat, a line end where it is broken.
    Line(&'static str),
    /// A line end, whatever is around it.
    Newline,
    /// A line end of a layout that was chosen for it.
    Break,
    /// An empty line where it is broken.
    Blank,
    /// Text only where it is broken.
    WhenBroken(&'static str),
    /// Nothing, but all groups around it are broken.
    Force,
    /// A comment at the end of a line.
    TrailingComment(&'t str),
    /// A comment on a line of its own.
    OwnComment(&'t str),
    /// One after another.
    Concat(Vec<DocId>),
    /// Its lines are indented.
    Nest(DocId),
    /// Flat if it fits, else broken.
    Group(DocId),
    /// Flat.
    Flat(DocId),
    /// Broken.
    Broken(DocId),
    /// As many on a line as fit.
    Fill(Vec<DocId>),
    /// The first layout that can be taken.
    Choice(Vec<(Fit, DocId)>),
}

/// The arena.
#[derive(Debug, Default)]
pub(super) struct Docs<'t> {
    docs: Vec<Doc<'t>>,
    /// Whether a document holds something that cannot be flat.
    forced: Vec<bool>,
}

impl<'t> Docs<'t> {
    pub(super) fn get(&self, id: DocId) -> &Doc<'t> {
        &self.docs[id.0 as usize]
    }

    /// Whether it cannot be flat.
    pub(super) fn forced(&self, id: DocId) -> bool {
        self.forced[id.0 as usize]
    }

    fn add(&mut self, doc: Doc<'t>) -> DocId {
        let forced = match &doc {
            Doc::Newline | Doc::Force | Doc::TrailingComment(_) | Doc::OwnComment(_) => true,
            Doc::Text(_) | Doc::Line(_) | Doc::Break | Doc::Blank | Doc::WhenBroken(_) => false,
            Doc::Concat(docs) | Doc::Fill(docs) => docs.iter().any(|d| self.forced(*d)),
            Doc::Nest(d) | Doc::Group(d) | Doc::Flat(d) | Doc::Broken(d) => self.forced(*d),
            Doc::Choice(layouts) => layouts.first().is_some_and(|(_, d)| self.forced(*d)),
        };
        self.docs.push(doc);
        self.forced.push(forced);
        DocId(self.docs.len() as u32 - 1)
    }

    pub(super) fn text(&mut self, text: &'t str) -> DocId {
        self.add(Doc::Text(text))
    }

    pub(super) fn line(&mut self, flat: &'static str) -> DocId {
        self.add(Doc::Line(flat))
    }

    pub(super) fn newline(&mut self) -> DocId {
        self.add(Doc::Newline)
    }

    pub(super) fn blank(&mut self) -> DocId {
        self.add(Doc::Blank)
    }

    pub(super) fn force(&mut self) -> DocId {
        self.add(Doc::Force)
    }

    pub(super) fn when_broken(&mut self, text: &'static str) -> DocId {
        self.add(Doc::WhenBroken(text))
    }

    pub(super) fn trailing_comment(&mut self, text: &'t str) -> DocId {
        self.add(Doc::TrailingComment(text))
    }

    pub(super) fn own_comment(&mut self, text: &'t str) -> DocId {
        self.add(Doc::OwnComment(text))
    }

    pub(super) fn concat(&mut self, docs: Vec<DocId>) -> DocId {
        self.add(Doc::Concat(docs))
    }

    pub(super) fn fill(&mut self, docs: Vec<DocId>) -> DocId {
        self.add(Doc::Fill(docs))
    }

    pub(super) fn nest(&mut self, docs: Vec<DocId>) -> DocId {
        let inner = self.concat(docs);
        self.add(Doc::Nest(inner))
    }

    pub(super) fn group(&mut self, docs: Vec<DocId>) -> DocId {
        let inner = self.concat(docs);
        self.add(Doc::Group(inner))
    }

    pub(super) fn flat(&mut self, doc: DocId) -> DocId {
        self.add(Doc::Flat(doc))
    }

    pub(super) fn broken(&mut self, doc: DocId) -> DocId {
        self.add(Doc::Broken(doc))
    }

    pub(super) fn choice(&mut self, layouts: Vec<(Fit, DocId)>) -> DocId {
        self.add(Doc::Choice(layouts))
    }

    /// The document on a line below, indented.
    pub(super) fn below(&mut self, doc: DocId) -> DocId {
        let newline = self.add(Doc::Break);
        self.nest(vec![newline, doc])
    }

    /// The document after a space.
    pub(super) fn spaced(&mut self, doc: DocId) -> DocId {
        let space = self.text(" ");
        self.concat(vec![space, doc])
    }

    /// The document on a line below.
    pub(super) fn under(&mut self, doc: DocId) -> DocId {
        let newline = self.add(Doc::Break);
        self.concat(vec![newline, doc])
    }
}
