//! Documents to text: chooses the line breaks.

use super::document::{Doc, DocId, Docs, Fit};
use super::{INDENT, INDENT_LIMIT};

/// The text of a document, its last line ended.
pub(super) fn render(docs: &Docs, root: DocId, width: usize) -> String {
    let mut renderer = Renderer { docs, width, out: String::new(), column: 0, fresh: true, owed: false };
    renderer.run(root);
    let end = renderer.out.trim_end().len();
    renderer.out.truncate(end);
    if end > 0 {
        renderer.out.push('\n');
    }
    renderer.out
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    Flat,
    Broken,
}

/// A document that is still to be written; a sequence from an element on.
#[derive(Clone, Copy)]
struct Todo {
    indent: usize,
    mode: Mode,
    doc: DocId,
    at: usize,
}

impl Todo {
    fn with(self, mode: Mode, doc: DocId) -> Todo {
        Todo { mode, doc, at: 0, ..self }
    }
}

struct Renderer<'d, 't> {
    docs: &'d Docs<'t>,
    width: usize,
    out: String,
    column: usize,
    /// Nothing but indentation is on this line.
    fresh: bool,
    /// A comment ends this line: the next text begins another.
    owed: bool,
}

impl Renderer<'_, '_> {
    fn run(&mut self, root: DocId) {
        let mut stack = vec![Todo { indent: 0, mode: Mode::Broken, doc: root, at: 0 }];
        while let Some(todo) = stack.pop() {
            let docs = self.docs;
            match docs.get(todo.doc) {
                Doc::Text(text) => self.text(text, todo.indent),
                Doc::Line(flat) if todo.mode == Mode::Flat => self.text(flat, todo.indent),
                Doc::Line(_) | Doc::Newline | Doc::Break => self.newline(todo.indent),
                Doc::Blank if todo.mode == Mode::Broken => self.blank(),
                Doc::WhenBroken(text) if todo.mode == Mode::Broken => self.text(text, todo.indent),
                Doc::Blank | Doc::WhenBroken(_) | Doc::Force => {}
                Doc::TrailingComment(text) => self.comment(text, todo.indent, !self.fresh && !self.owed),
                Doc::OwnComment(text) => self.comment(text, todo.indent, false),
                Doc::Concat(items) => {
                    if let Some(item) = items.get(todo.at) {
                        stack.push(Todo { at: todo.at + 1, ..todo });
                        stack.push(todo.with(todo.mode, *item));
                    }
                }
                Doc::Fill(items) => {
                    if let Some(item) = items.get(todo.at) {
                        stack.push(Todo { at: todo.at + 1, ..todo });
                        let item = todo.with(Mode::Flat, *item);
                        if todo.at > 0 {
                            let fits = todo.mode == Mode::Flat || self.fits(item, &[], 1, false);
                            if fits { self.text(" ", todo.indent) } else { self.newline(todo.indent) }
                        }
                        stack.push(item);
                    }
                }
                Doc::Nest(inner) => {
                    stack.push(Todo { indent: deeper(todo.indent), ..todo.with(todo.mode, *inner) });
                }
                Doc::Group(inner) => {
                    let flat = todo.with(Mode::Flat, *inner);
                    let is_flat =
                        todo.mode == Mode::Flat || (!docs.forced(*inner) && self.fits(flat, &stack, 0, false));
                    stack.push(if is_flat { flat } else { todo.with(Mode::Broken, *inner) });
                }
                Doc::Flat(inner) => stack.push(todo.with(Mode::Flat, *inner)),
                Doc::Broken(inner) => stack.push(self.broken(todo, *inner)),
                Doc::Choice(layouts) => stack.push(self.choose(todo, layouts, &stack)),
            }
        }
    }

    /// A document that is to be broken; of a group, its content.
    fn broken(&self, todo: Todo, doc: DocId) -> Todo {
        match self.docs.get(doc) {
            Doc::Group(inner) => todo.with(Mode::Broken, *inner),
            _ => todo.with(Mode::Broken, doc),
        }
    }

    fn choose(&self, todo: Todo, layouts: &[(Fit, DocId)], rest: &[Todo]) -> Todo {
        let mut chosen = todo;
        for (fit, doc) in layouts {
            let forced = self.docs.forced(*doc);
            let mode = if *fit == Fit::Flat || todo.mode == Mode::Flat { Mode::Flat } else { Mode::Broken };
            chosen = todo.with(mode, *doc);
            let taken = match fit {
                _ if todo.mode == Mode::Flat => true,
                Fit::Flat => !forced && self.fits(chosen, rest, 0, false),
                Fit::Whole => !forced && self.fits(chosen, rest, 0, true),
                Fit::First => self.fits(chosen, rest, 0, false),
                Fit::Always => true,
            };
            if taken {
                break;
            }
        }
        chosen
    }

    /// Whether a document fits: its text up to the first line end on this line or, if `whole`, each of its lines; and
    /// the text after it up to the next line end.
    fn fits(&self, start: Todo, rest: &[Todo], before: usize, whole: bool) -> bool {
        let mut room =
            self.width.saturating_sub(if self.fresh || self.owed { start.indent } else { self.column } + before);
        let mut stack = vec![start];
        let mut rest = rest.iter().rev();
        let mut within = true;
        loop {
            let Some(todo) = stack.pop() else {
                let Some(next) = rest.next() else { return true };
                within = false;
                stack.push(*next);
                continue;
            };
            let whole = whole && within;
            let flat = todo.mode == Mode::Flat;
            let text = match self.docs.get(todo.doc) {
                Doc::Text(text) => text,
                Doc::Line(text) if flat => text,
                Doc::Line(_) | Doc::Newline | Doc::Break => {
                    if !whole {
                        return true;
                    }
                    room = self.width.saturating_sub(todo.indent);
                    ""
                }
                Doc::WhenBroken(text) if !flat => text,
                Doc::Blank | Doc::WhenBroken(_) | Doc::Force => "",
                Doc::TrailingComment(_) | Doc::OwnComment(_) => return true,
                Doc::Concat(items) => {
                    if let Some(item) = items.get(todo.at) {
                        stack.push(Todo { at: todo.at + 1, ..todo });
                        stack.push(todo.with(todo.mode, *item));
                    }
                    ""
                }
                Doc::Fill(items) if flat || todo.at == 0 => {
                    if let Some(item) = items.get(todo.at) {
                        stack.push(Todo { at: todo.at + 1, ..todo });
                        stack.push(todo.with(Mode::Flat, *item));
                    }
                    if todo.at > 0 && todo.at < items.len() { " " } else { "" }
                }
                Doc::Fill(_) => return true,
                Doc::Nest(inner) => {
                    stack.push(Todo { indent: deeper(todo.indent), ..todo.with(todo.mode, *inner) });
                    ""
                }
                Doc::Group(inner) => {
                    stack.push(todo.with(if whole { Mode::Flat } else { todo.mode }, *inner));
                    ""
                }
                Doc::Flat(inner) => {
                    stack.push(todo.with(Mode::Flat, *inner));
                    ""
                }
                Doc::Broken(inner) => {
                    stack.push(self.broken(todo, *inner));
                    ""
                }
                Doc::Choice(layouts) => {
                    // If flat, it has its first layout; if not, the last layout has the earliest line break.
                    let chosen = if whole || flat { layouts.first() } else { layouts.last() };
                    let mode = if whole { Mode::Flat } else { todo.mode };
                    stack.extend(chosen.map(|(_, doc)| todo.with(mode, *doc)));
                    ""
                }
            };
            let width = text.chars().count();
            if width > room {
                return false;
            }
            room -= width;
        }
    }

    fn newline(&mut self, indent: usize) {
        let end = self.out.trim_end_matches(' ').len();
        self.out.truncate(end);
        self.out.push('\n');
        (self.column, self.fresh, self.owed) = (indent, true, false);
    }

    /// An empty line, of which there is never more than one.
    fn blank(&mut self) {
        if !self.out.is_empty() && !self.out.ends_with("\n\n") {
            self.newline(0);
        }
    }

    fn text(&mut self, text: &str, indent: usize) {
        if text.is_empty() || ((self.owed || self.fresh) && text == " ") {
            return;
        }
        if self.owed {
            self.newline(indent);
        }
        self.begin(indent);
        self.out.push_str(text);
        self.column += text.chars().count();
    }

    /// Indents a line that nothing was written on.
    fn begin(&mut self, indent: usize) {
        if self.fresh {
            self.out.extend(std::iter::repeat_n(' ', indent));
            (self.column, self.fresh) = (indent, false);
        }
    }

    fn comment(&mut self, text: &str, indent: usize, trailing: bool) {
        if trailing {
            let end = self.out.trim_end_matches(' ').len();
            self.out.truncate(end);
            self.out.push_str("  ");
        } else if !self.fresh || self.owed {
            self.newline(indent);
        }
        self.begin(indent);
        self.out.push_str(text);
        self.owed = true;
    }
}

/// One level more, up to a limit: deeply nested text would consist mostly of indentation.
fn deeper(indent: usize) -> usize {
    (indent + INDENT).min(INDENT_LIMIT)
}
