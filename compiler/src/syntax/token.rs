//! Tokens of the text, before line ends are given their meaning.

use logos::Logos;

/// The kind of a token; the text is that of its span.
#[derive(Logos, Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[logos(skip r"[ \t\r\u{c}\u{a0}\u{feff}]+")]
pub(crate) enum Token {
    #[token("use")]
    Use,
    #[token("fn")]
    Fn,
    #[token("deriv")]
    Deriv,
    #[token("let")]
    Let,
    #[token("model")]
    Model,
    #[token("param")]
    Param,
    #[token("input")]
    Input,
    #[token("part")]
    Part,
    #[token("require")]
    Require,
    #[token("for")]
    For,
    #[token("in")]
    In,
    #[token("if")]
    If,
    #[token("else")]
    Else,
    #[token("true")]
    True,
    #[token("false")]
    False,
    #[token("and")]
    And,
    #[token("or")]
    Or,
    #[token("not")]
    Not,

    #[regex(r"[\p{XID_Start}_]\p{XID_Continue}*")]
    Name,
    /// A number with the letters that directly follow it: `3`, `0.5`, `1e-3m`; the unit is checked later.
    #[regex(r"[0-9][0-9_]*(\.[0-9][0-9_]*)?([eE][+\-]?[0-9]+)?([\p{XID_Start}_]\p{XID_Continue}*)?")]
    Number,
    #[regex(r#""([^"\\\n]|\\[^\n])*""#)]
    Text,
    /// `'`
    #[token("'")]
    Prime,
    /// `'u`
    #[regex(r"'[\p{XID_Start}_]\p{XID_Continue}*")]
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
    /// The `tolerance` of a part.
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
            Plus | Minus | Star | Slash | Percent | Caret | EqEq | NotEq | Less | LessEq | Greater | GreaterEq
        ) || matches!(self, DotDot | Dot | Equals | Arrow | And | Or | In)
    }

    /// Whether this token begins an item and nothing else.
    pub(super) fn begins_item(self) -> bool {
        use Token::*;
        matches!(self, Use | Fn | Deriv | Let | Model | Param | Input | Part | Require)
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
