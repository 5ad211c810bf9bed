//! The classes of the tokens of a text, for highlighting.

use super::token::Token;
use logos::Logos;
use std::ops::Range;

/// The class of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// A word of the language.
    Keyword,
    /// A name.
    Name,
    /// A number with its unit.
    Number,
    /// A text in quotes.
    Text,
    /// A comment.
    Comment,
    /// An operator, a bracket or another sign.
    Sign,
    /// Characters without a meaning.
    Wrong,
}

/// The tokens of a text with their bytes and classes; white space is left out.
pub fn classes(text: &str) -> impl Iterator<Item = (Range<usize>, Class)> {
    Token::lexer(text).spanned().filter_map(|(token, range)| {
        use Token::*;
        let class = match token {
            Ok(Newline) => return None,
            Ok(
                Use | Fn | Deriv | Let | Model | Param | Input | Part | Require | For | In | If | Else | True | False
                | And | Or | Not,
            ) => Class::Keyword,
            Ok(Name) => Class::Name,
            Ok(Number) => Class::Number,
            Ok(Text) => Class::Text,
            Ok(Comment) => Class::Comment,
            Ok(_) => Class::Sign,
            Err(()) => Class::Wrong,
        };
        Some((range, class))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_has_its_class() {
        let text = "let r = 3mm + f'(x) // half\n\"t\" #";
        let found: Vec<(&str, Class)> = classes(text).map(|(range, class)| (&text[range], class)).collect();
        let expected = [
            ("let", Class::Keyword),
            ("r", Class::Name),
            ("=", Class::Sign),
            ("3mm", Class::Number),
            ("+", Class::Sign),
            ("f", Class::Name),
            ("'", Class::Sign),
            ("(", Class::Sign),
            ("x", Class::Name),
            (")", Class::Sign),
            ("// half", Class::Comment),
            ("\"t\"", Class::Text),
            ("#", Class::Wrong),
        ];
        assert_eq!(found, expected);
    }
}
