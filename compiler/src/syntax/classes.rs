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
    let tokens: Vec<_> = Token::lexer(text).spanned().collect();
    let declares = |before: &[(Result<Token, ()>, Range<usize>)]| match before {
        [.., (Ok(Token::Part), _), (Ok(Token::Name), _)] => true,
        [.., (Ok(Token::Name), word), (Ok(Token::Name), _)] => &text[word.clone()] == "measure",
        _ => false,
    };
    // Some words are keywords only where a name follows, or after the name of a declaration.
    let of_place = |k: usize| match (&tokens[k], tokens.get(k + 1)) {
        ((Ok(Token::Name), word), Some((Ok(Token::Name), _))) if &text[word.clone()] == "measure" => true,
        ((Ok(Token::Name), word), _) if &text[word.clone()] == "tolerance" => declares(&tokens[..k]),
        _ => false,
    };
    let keywords: Vec<bool> = (0..tokens.len()).map(of_place).collect();
    tokens.into_iter().zip(keywords).filter_map(|((token, range), keyword)| {
        use Token::*;
        if keyword {
            return Some((range, Class::Keyword));
        }
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

    #[test]
    fn words_of_a_place_are_keywords_there() {
        let words = |text: &'static str| -> Vec<&'static str> {
            classes(text).filter(|(_, class)| *class == Class::Keyword).map(|(range, _)| &text[range]).collect()
        };
        assert_eq!(words("measure d tolerance 1mm = 2 * r"), ["measure", "tolerance"]);
        assert_eq!(words("part p tolerance 1mm = s"), ["part", "tolerance"]);
        assert_eq!(words("measure.chord(s) + tolerance * measure"), Vec::<&str>::new());
    }
}
