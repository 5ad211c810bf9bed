//! Tokens of the text, before line ends are given their meaning.

use logos::{Lexer, Logos};
use unicode_ident::{is_xid_continue, is_xid_start};

/// The kind of a token; the text is that of its span.
#[derive(Logos, Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[logos(skip r"[ \t\r\u{c}\u{a0}\u{feff}]+")]
pub(crate) enum Token {
    Use,
    Fn,
    Deriv,
    Let,
    Model,
    Param,
    Input,
    Part,
    Require,
    For,
    In,
    If,
    Else,
    True,
    False,
    And,
    Or,
    Not,

    /// A name; its pattern is also that of the keywords.
    #[regex(r"[A-Za-z_]|[^\x00-\x7f\u{a0}\u{feff}]", word)]
    Name,
    /// A number with the letters that directly follow it: `3`, `0.5`, `1e-3m`; the unit is checked later.
    #[regex(r"[0-9][0-9_]*(\.[0-9][0-9_]*)?([eE][+\-]?[0-9][0-9_]*)?", letters_of_number)]
    Number,
    #[regex(r#""([^"\\\n]|\\[^\n])*""#)]
    Text,
    /// `'`
    #[token("'", |lexer| if take_name(lexer) { Token::PrimeName } else { Token::Prime })]
    Prime,
    /// `'u`
    PrimeName,

    #[token("(")]
    ParenOpen,
    #[token(")")]
    ParenClose,
    #[token("[")]
    BracketOpen,
    #[token("]")]
    BracketClose,
    #[token("{")]
    BraceOpen,
    #[token("}")]
    BraceClose,

    #[token("+")]
    Plus,
    #[token("-")]
    Minus,
    #[token("*")]
    Star,
    #[token("/")]
    Slash,
    #[token("%")]
    Percent,
    #[token("^")]
    Caret,
    #[token("&")]
    Ampersand,
    #[token("==")]
    EqEq,
    #[token("!=")]
    NotEq,
    #[token("<")]
    Less,
    #[token("<=")]
    LessEq,
    #[token(">")]
    Greater,
    #[token(">=")]
    GreaterEq,
    #[token("..")]
    DotDot,
    #[token(".")]
    Dot,
    #[token(",")]
    Comma,
    #[token(":")]
    Colon,
    #[token("=")]
    Equals,
    #[token("->")]
    Arrow,
    #[token("|")]
    Bar,
    #[token(";")]
    Semicolon,
    #[token("\n")]
    Newline,
    #[regex(r"//[^\n]*", allow_greedy = true)]
    Comment,

    // The layout pass makes the others from these.
    /// The end of a statement.
    Separator,
    /// The `{` of a record.
    RecordOpen,
    /// The `measure` that begins a statement.
    Measure,
    /// The `of` of a measure.
    Of,
    /// The `tolerance` of a part or measure.
    Tolerance,
    /// One or more lines of `///`.
    Doc,
    /// Characters that are no token; a diagnostic was given.
    Error,
    /// A statement that could not be parsed; a diagnostic was given.
    BadStatement,
    /// Stands before the first token of a file.
    FileStart,
    /// Stands before the first token of a lone expression.
    ExpressionStart,
}

/// A keyword or a name, of which the lexer has the first character. (Unicode's classes are looked up here: as patterns
/// they make a state machine whose compilation takes a third of the crate's.)
fn word(lexer: &mut Lexer<'_, Token>) -> Result<Token, ()> {
    if !lexer.slice().starts_with(begins_name) {
        return Err(());
    }
    take_while_continued(lexer);
    Ok(match lexer.slice() {
        "use" => Token::Use,
        "fn" => Token::Fn,
        "deriv" => Token::Deriv,
        "let" => Token::Let,
        "model" => Token::Model,
        "param" => Token::Param,
        "input" => Token::Input,
        "part" => Token::Part,
        "require" => Token::Require,
        "for" => Token::For,
        "in" => Token::In,
        "if" => Token::If,
        "else" => Token::Else,
        "true" => Token::True,
        "false" => Token::False,
        "and" => Token::And,
        "or" => Token::Or,
        "not" => Token::Not,
        _ => Token::Name,
    })
}

/// Extends a number by the letters that follow. The first of them may be in it already: a `_` between its last digits,
/// or what looks like an exponent without a sign.
fn letters_of_number(lexer: &mut Lexer<'_, Token>) {
    let last_digits = lexer.slice().rsplit(['.', '+', '-']).next().unwrap_or_default();
    if last_digits.contains(['_', 'e', 'E']) {
        take_while_continued(lexer);
    } else {
        take_name(lexer);
    }
}

/// Extends a token by a name that follows directly; false where there is none.
fn take_name(lexer: &mut Lexer<'_, Token>) -> bool {
    let follows = lexer.remainder().starts_with(begins_name);
    if follows {
        take_while_continued(lexer);
    }
    follows
}

fn begins_name(c: char) -> bool {
    c == '_' || is_xid_start(c)
}

fn take_while_continued(lexer: &mut Lexer<'_, Token>) {
    let rest = lexer.remainder();
    lexer.bump(rest.find(|c| !is_xid_continue(c)).unwrap_or(rest.len()));
}

impl Token {
    /// Whether a line that ends with this token continues on the next one.
    pub(super) fn continues_after(self) -> bool {
        self.is_operator() || matches!(self, Token::Comma | Token::Colon | Token::Bar | Token::Not | Token::Else)
    }

    /// Whether a line that begins with this token continues the one before.
    pub(super) fn continues_before(self) -> bool {
        self.is_operator() || matches!(self, Token::Comma | Token::Else)
    }

    fn is_operator(self) -> bool {
        use Token::*;
        matches!(
            self,
            Plus | Minus
                | Star
                | Slash
                | Percent
                | Caret
                | Ampersand
                | EqEq
                | NotEq
                | Less
                | LessEq
                | Greater
                | GreaterEq
        ) || matches!(self, DotDot | Dot | Equals | Arrow | And | Or | In)
    }

    /// Whether this token begins an item and nothing else.
    pub(super) fn begins_item(self) -> bool {
        use Token::*;
        matches!(self, Use | Fn | Deriv | Let | Model | Param | Input | Part | Measure | Require)
    }

    /// The closing bracket of an opening one.
    pub(super) fn closer(self) -> Option<Token> {
        match self {
            Token::ParenOpen => Some(Token::ParenClose),
            Token::BracketOpen => Some(Token::BracketClose),
            Token::BraceOpen | Token::RecordOpen => Some(Token::BraceClose),
            _ => None,
        }
    }

    /// Whether it closes a bracket.
    pub(crate) fn is_closer(self) -> bool {
        matches!(self, Token::ParenClose | Token::BracketClose | Token::BraceClose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_numbers_take_the_letters_of_unicode() {
        let pieces = |text: &'static str| -> Vec<(Result<Token, ()>, &str)> {
            Token::lexer(text).spanned().map(|(token, range)| (token, &text[range])).collect()
        };
        let (name, number, prime) = (Ok(Token::Name), Ok(Token::Number), Ok(Token::PrimeName));
        assert_eq!(pieces("use useé in_π"), [(Ok(Token::Use), "use"), (name, "useé"), (name, "in_π")]);
        assert_eq!(pieces("f'α' a·b"), [(name, "f"), (prime, "'α"), (Ok(Token::Prime), "'"), (name, "a·b")]);
        assert_eq!(pieces("3µm 1e-3m 1e3·x 1_·"), ["3µm", "1e-3m", "1e3·x", "1_·"].map(|text| (number, text)));
        // A middle dot continues a word and begins none.
        assert_eq!(pieces("1e+3·2 ×"), [(number, "1e+3"), (Err(()), "·"), (number, "2"), (Err(()), "×")]);
    }
}
