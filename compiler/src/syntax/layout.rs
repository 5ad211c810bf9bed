//! Text to the tokens of the grammar: brackets are matched, line ends become separators where they end a statement, and
//! choices that need more than one token of look-ahead are made.
//!
//! All brackets of the result match, and are nested at most [`NESTING_LIMIT`] deep. A bracket that was added for that
//! has an empty span.

use super::characters::directions;
use super::lexer::lex;
use super::token::Token;
use super::{NESTING_LIMIT, spanned};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::FileId;

/// A token and its bytes in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lexeme {
    pub(crate) token: Token,
    pub(crate) start: u32,
    pub(crate) end: u32,
}

/// The tokens of a file.
pub(crate) fn layout(file: FileId, text: &str) -> (Vec<Lexeme>, Vec<Diagnostic>) {
    let (raw, mut diagnostics) = lex(file, text);
    diagnostics.extend(directions(file, text));
    let mut layout = Layout::new(file, text);
    let fits = layout.run(&raw);
    if fits && !layout.open.is_empty() {
        // A closing brace is missing somewhere: the indentation of the lines may tell where.
        let mut indented = Layout { by_indentation: true, ..Layout::new(file, text) };
        let fits = indented.run(&raw);
        indented.close_all(text.len() as u32);
        if fits && indented.diagnostics.len() <= layout.diagnostics.len() + layout.open.len() {
            layout = indented;
        }
    }
    if !fits {
        // Brackets are nested beyond the limit: the rest would only be misread.
        return (Vec::new(), [diagnostics, layout.diagnostics].concat());
    }
    layout.close_all(text.len() as u32);
    diagnostics.append(&mut layout.diagnostics);
    (layout.out, diagnostics)
}

/// The state at the end of a text of statements.
pub(super) struct End {
    /// A bracket is open.
    pub(super) open: bool,
    /// The last line is a doc comment, which needs an item.
    pub(super) doc: bool,
    /// There are characters or brackets that are wrong whatever follows.
    pub(super) wrong: bool,
}

/// The state at the end of a text of statements.
pub(super) fn end(text: &str) -> End {
    let (raw, wrong) = lex(FileId::default(), text);
    let mut layout = Layout::new(FileId::default(), text);
    let fits = layout.run(&raw);
    let wrong = !fits || !wrong.is_empty() || !layout.diagnostics.is_empty();
    End { open: !layout.open.is_empty(), doc: layout.doc.is_some(), wrong }
}

struct Layout<'t> {
    file: FileId,
    text: &'t str,
    out: Vec<Lexeme>,
    /// Open brackets.
    open: Vec<Lexeme>,
    diagnostics: Vec<Diagnostic>,
    /// A line end was passed since the last token.
    line_end: bool,
    /// A `;` was passed since the last token.
    semicolon: bool,
    /// The doc comment since the last token.
    doc: Option<Lexeme>,
    /// A line that is indented no further than the one that opened a brace ends the brace's block.
    by_indentation: bool,
}

impl<'t> Layout<'t> {
    fn new(file: FileId, text: &'t str) -> Layout<'t> {
        Layout {
            file,
            text,
            out: Vec::new(),
            open: Vec::new(),
            diagnostics: Vec::new(),
            line_end: false,
            semicolon: false,
            doc: None,
            by_indentation: false,
        }
    }

    /// Takes all raw tokens. False if brackets are nested too deep.
    fn run(&mut self, raw: &[Lexeme]) -> bool {
        raw.iter().enumerate().all(|(i, lexeme)| self.step(*lexeme, &raw[i + 1..]))
    }

    /// Takes one raw token; `rest` are those after it. False if brackets are nested too deep.
    fn step(&mut self, mut lexeme: Lexeme, rest: &[Lexeme]) -> bool {
        if self.is_measure(lexeme, rest) {
            lexeme.token = Token::Measure;
        }
        match lexeme.token {
            Token::Newline => self.line_end = true,
            Token::Comment => self.comment(lexeme),
            Token::Semicolon if self.in_statements() => self.semicolon = true,
            _ => {
                self.recover_unclosed(lexeme);
                self.separate(lexeme);
                self.emit_doc(lexeme);
                (self.line_end, self.semicolon, self.doc) = (false, false, None);
                return self.emit(lexeme, rest);
            }
        }
        true
    }

    /// Whether the place is outside of brackets, or directly in braces.
    fn in_statements(&self) -> bool {
        self.open.last().is_none_or(|b| b.token == Token::BraceOpen)
    }

    fn comment(&mut self, lexeme: Lexeme) {
        let text = &self.text[lexeme.start as usize..lexeme.end as usize];
        let own_line = self.line_end || self.out.is_empty();
        if own_line && text.starts_with("///") && !text.starts_with("////") {
            match &mut self.doc {
                Some(doc) => doc.end = lexeme.end,
                None => self.doc = Some(Lexeme { token: Token::Doc, ..lexeme }),
            }
        }
    }

    /// A line that begins with a keyword of an item cannot lie within parentheses or brackets: the closing one is
    /// missing.
    fn recover_unclosed(&mut self, lexeme: Lexeme) {
        if !self.line_end {
            return;
        }
        if lexeme.token.begins_item() {
            while !self.in_statements() && !self.open.is_empty() {
                self.close_unclosed(lexeme.start);
            }
        }
        if self.by_indentation && !lexeme.token.is_closer() {
            let indentation = self.indentation(lexeme.start);
            while let Some(brace) = self.open.last()
                && brace.token == Token::BraceOpen
                && self.indentation(brace.start) >= indentation
            {
                self.close_unclosed(lexeme.start);
            }
        }
    }

    /// The indentation of the line with that byte, in characters.
    fn indentation(&self, at: u32) -> usize {
        let start = self.text[..at as usize].rfind('\n').map_or(0, |n| n + 1);
        self.text[start..].chars().take_while(|c| matches!(c, ' ' | '\t')).count()
    }

    fn separate(&mut self, lexeme: Lexeme) {
        let Some(last) = self.out.last().copied() else { return };
        let begins = matches!(last.token, Token::Separator | Token::BraceOpen);
        if !self.in_statements() || begins || lexeme.token == Token::BraceClose {
            return;
        }
        // An item cannot follow an operator: the statement before it is unfinished.
        let goes_on = last.token.continues_after() && !lexeme.token.begins_item();
        let line_end = self.line_end && !goes_on && !lexeme.token.continues_before();
        if self.semicolon || line_end {
            self.out.push(Lexeme { token: Token::Separator, start: last.end, end: lexeme.start });
        }
    }

    /// A doc comment before an item becomes a token; any other is a comment.
    fn emit_doc(&mut self, next: Lexeme) {
        let at_start = self.out.last().is_none_or(|l| matches!(l.token, Token::Separator | Token::BraceOpen));
        if let Some(doc) = self.doc
            && at_start
            && self.in_statements()
            && next.token.begins_item()
        {
            self.out.push(doc);
        }
    }

    fn emit(&mut self, mut lexeme: Lexeme, rest: &[Lexeme]) -> bool {
        if lexeme.token.is_closer() {
            self.close(lexeme);
            return true;
        }
        match lexeme.token {
            Token::BraceOpen if opens_record(rest) => lexeme.token = Token::RecordOpen,
            Token::Name if self.is_tolerance(lexeme) => lexeme.token = Token::Tolerance,
            Token::Name if self.is_of(lexeme) => lexeme.token = Token::Of,
            _ => {}
        }
        if lexeme.token.closer().is_some() {
            self.open.push(lexeme);
            if self.open.len() > NESTING_LIMIT as usize {
                self.diagnostics.push(too_deep(self.file, lexeme.start, lexeme.end));
                return false;
            }
        }
        self.out.push(lexeme);
        true
    }

    /// `measure` is a keyword only at the start of a statement, before a name on the same line.
    fn is_measure(&self, lexeme: Lexeme, rest: &[Lexeme]) -> bool {
        let begins = self.line_end
            || self.semicolon
            || self.out.last().is_none_or(|last| matches!(last.token, Token::Separator | Token::BraceOpen));
        lexeme.token == Token::Name
            && begins
            && &self.text[lexeme.start as usize..lexeme.end as usize] == "measure"
            && matches!(rest.first(), Some(Lexeme { token: Token::Name | Token::Text, .. }))
    }

    /// `tolerance` is a keyword only after the name of a part or measure, or after the parts of a measure.
    fn is_tolerance(&self, lexeme: Lexeme) -> bool {
        &self.text[lexeme.start as usize..lexeme.end as usize] == "tolerance"
            && (self.after_name_of(&[Token::Part, Token::Measure]) || self.after_parts())
    }

    /// `of` is a keyword only after the name of a measure.
    fn is_of(&self, lexeme: Lexeme) -> bool {
        &self.text[lexeme.start as usize..lexeme.end as usize] == "of" && self.after_name_of(&[Token::Measure])
    }

    fn after_name_of(&self, declarations: &[Token]) -> bool {
        let last = self.out.last_chunk();
        last.is_some_and(|[keyword, name]| declarations.contains(&keyword.token) && name.token == Token::Name)
    }

    /// Whether the last tokens are `of` and names of parts. Two names in a row end the search, so that all searches of
    /// a text together take no longer than the text.
    fn after_parts(&self) -> bool {
        let mut before = None;
        for lexeme in self.out.iter().rev() {
            match (lexeme.token, before) {
                (Token::Of, Some(Token::Name)) => return true,
                (Token::Name, None | Some(Token::Comma | Token::Dot | Token::BracketOpen)) => {}
                (Token::BracketClose, None | Some(Token::Comma | Token::Dot)) => {}
                (Token::Number, Some(Token::BracketClose)) | (Token::BracketOpen, Some(Token::Number)) => {}
                (Token::Dot | Token::Comma, Some(Token::Name)) => {}
                _ => return false,
            }
            before = Some(lexeme.token);
        }
        false
    }

    /// Takes a closing bracket: those opened since its partner are closed first; without a partner it is an error.
    fn close(&mut self, lexeme: Lexeme) {
        if !self.open.iter().any(|b| b.token.closer() == Some(lexeme.token)) {
            let span = spanned(self.file, lexeme.start, lexeme.end);
            let text = &self.text[lexeme.start as usize..lexeme.end as usize];
            if let Some(token) = self.mistaken(lexeme) {
                self.open.pop();
                self.out.push(Lexeme { token, ..lexeme });
                return;
            }
            self.diagnostics.push(
                Diagnostic::new(Code::UnmatchedBracket, span, format!("'{text}' has no opening bracket"))
                    .suggest("remove it", [Edit::remove(span)]),
            );
            self.out.push(Lexeme { token: Token::Error, ..lexeme });
            return;
        }
        while self.open.last().is_some_and(|b| b.token.closer() != Some(lexeme.token)) {
            self.close_unclosed(lexeme.start);
        }
        self.open.pop();
        self.out.push(lexeme);
    }

    /// The right closing bracket in place of a wrong one on the line of the opening bracket.
    fn mistaken(&mut self, lexeme: Lexeme) -> Option<Token> {
        let bracket = *self.open.last()?;
        let meant = bracket.token.closer()?;
        let between = &self.text[bracket.end as usize..lexeme.start as usize];
        if between.contains('\n') {
            return None;
        }
        let spans = [bracket, lexeme].map(|l| spanned(self.file, l.start, l.end));
        let [opening, closing] = [bracket, lexeme].map(|l| &self.text[l.start as usize..l.end as usize]);
        let ours = closing_text(meant);
        self.diagnostics.push(
            Diagnostic::new(Code::UnmatchedBracket, spans[1], format!("'{closing}' does not close '{opening}'"))
                .related(spans[0], "opened here")
                .suggest(format!("did you mean '{ours}'?"), [Edit::replace(spans[1], ours)]),
        );
        Some(meant)
    }

    fn close_unclosed(&mut self, at: u32) {
        let Some(bracket) = self.open.pop() else { return };
        let span = spanned(self.file, bracket.start, bracket.end);
        let text = &self.text[bracket.start as usize..bracket.end as usize];
        let mut error = Diagnostic::new(Code::UnclosedBracket, span, format!("'{text}' is never closed"));
        let line = self.text[bracket.end as usize..].lines().next().unwrap_or_default();
        let is_in = |comment: &str| bracket.token.closer().is_some_and(|c| comment.contains(closing_text(c)));
        if line.split_once("//").is_some_and(|(_, comment)| is_in(comment)) {
            error = error.hint("`//` begins a comment, in which it is closed; a whole quotient is floor(a / b)");
        }
        self.diagnostics.push(error);
        if let Some(token) = bracket.token.closer() {
            let at = self.out.last().map_or(at, |l| l.end);
            self.out.push(Lexeme { token, start: at, end: at });
        }
    }

    fn close_all(&mut self, at: u32) {
        while !self.open.is_empty() {
            self.close_unclosed(at);
        }
    }
}

/// `{` opens a record if a name and a colon follow.
fn opens_record(rest: &[Lexeme]) -> bool {
    let mut tokens = rest.iter().map(|l| l.token).filter(|t| !matches!(t, Token::Newline | Token::Comment));
    tokens.next() == Some(Token::Name) && tokens.next() == Some(Token::Colon)
}

/// The diagnostic for a tree that would be too deep to walk.
pub(super) fn too_deep(file: FileId, start: u32, end: u32) -> Diagnostic {
    let message = format!("this is nested more than {NESTING_LIMIT} levels deep");
    Diagnostic::new(Code::TooDeep, spanned(file, start, end), message)
        .hint("split it up: give its parts names with 'let'")
}

/// A closing bracket as it is written.
fn closing_text(token: Token) -> &'static str {
    match token {
        Token::ParenClose => ")",
        Token::BracketClose => "]",
        _ => "}",
    }
}
