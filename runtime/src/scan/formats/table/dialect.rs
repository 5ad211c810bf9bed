//! How the numbers of a line are told apart.

use super::super::text::{missing, number};
use std::ops::Range;

/// What stands between two fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// This character, and blanks around it; fields may be empty.
    One(u8),
    /// A comma with a blank behind it.
    CommaBlank,
    /// Any number of blanks.
    Blanks,
}

/// How lines are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub(super) separator: Separator,
    /// The decimal mark.
    pub(super) mark: u8,
}

const fn dialect(separator: Separator, mark: u8) -> Dialect {
    Dialect { separator, mark }
}

/// All of them; the first that fits is taken. `1,5 2,5 3,5` fits none before that of blanks with decimal commas.
pub(super) const DIALECTS: [Dialect; 9] = [
    dialect(Separator::One(b';'), b'.'),
    dialect(Separator::One(b';'), b','),
    dialect(Separator::One(b'\t'), b'.'),
    dialect(Separator::One(b'\t'), b','),
    dialect(Separator::CommaBlank, b','),
    dialect(Separator::One(b','), b'.'),
    dialect(Separator::Blanks, b'.'),
    dialect(Separator::Blanks, b','),
    // Numbers in quotes.
    dialect(Separator::One(b','), b','),
];

/// A field of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    /// A number, and whether it has neither decimal mark nor exponent.
    Number(f64, bool),
    /// There is nothing, or it says so.
    Missing,
    Text,
}

impl Dialect {
    /// The places of a line's fields, without the blanks and quotes around them.
    pub(super) fn split(self, line: &[u8], fields: &mut Vec<Range<usize>>) {
        fields.clear();
        let runs = self.separator == Separator::Blanks;
        let mut at = 0;
        loop {
            while at < line.len() && (line[at] == b' ' || runs && self.ends(line, at)) {
                at += 1;
            }
            if runs && at == line.len() {
                return;
            }
            let start = at;
            let quoted = line.get(at) == Some(&b'"');
            let close = if quoted { line[at + 1..].iter().position(|b| *b == b'"') } else { None };
            if let Some(length) = close {
                at += length + 2;
            }
            let behind_quotes = at;
            while at < line.len() && !self.ends(line, at) {
                at += 1;
            }
            let field = match close {
                Some(_) => start + 1..behind_quotes - 1,
                None => start..start + line[start..at].trim_ascii_end().len(),
            };
            fields.push(field);
            if at == line.len() {
                return;
            }
            at += 1;
        }
    }

    /// Whether the byte at a place ends a field.
    fn ends(self, line: &[u8], at: usize) -> bool {
        match self.separator {
            Separator::One(separator) => line[at] == separator,
            Separator::CommaBlank => line[at] == b',' && line.get(at + 1).is_none_or(u8::is_ascii_whitespace),
            Separator::Blanks => line[at].is_ascii_whitespace(),
        }
    }

    pub(super) fn cell(self, field: &[u8]) -> Cell {
        match number(field, self.mark) {
            Some(value) => Cell::Number(value, !field.iter().any(|b| *b == self.mark || b.is_ascii_alphabetic())),
            None if missing(field) => Cell::Missing,
            None => Cell::Text,
        }
    }

    /// Whether a line is a remark.
    pub(super) fn is_comment(self, line: &[u8]) -> bool {
        let line = line.trim_ascii_start();
        match line {
            [b'#' | b'!' | b'%', ..] | [b'/', b'/', ..] => true,
            [b';', ..] => self.separator != Separator::One(b';'),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(separator: Separator, line: &str) -> Vec<&str> {
        let mut fields = Vec::new();
        dialect(separator, b'.').split(line.as_bytes(), &mut fields);
        fields.into_iter().map(|field| &line[field]).collect()
    }

    #[test]
    fn fields() {
        let comma = Separator::One(b',');
        assert_eq!(split(comma, "1, 2 ,3"), ["1", "2", "3"]);
        assert_eq!(split(comma, ",\"a,b\" ,\"\","), ["", "a,b", "", ""]);
        assert_eq!(split(comma, "\"open,1"), ["\"open", "1"]);
        assert_eq!(split(Separator::One(b'\t'), "1 \t\t 2"), ["1", "", "2"]);
        assert_eq!(split(Separator::Blanks, "  1\t2   \"3 x\" "), ["1", "2", "3 x"]);
        assert_eq!(split(Separator::CommaBlank, "1,5, 2,5, 3,5"), ["1,5", "2,5", "3,5"]);
        assert_eq!(split(Separator::Blanks, ""), [""; 0]);
        assert_eq!(split(comma, ""), [""]);
    }
}
