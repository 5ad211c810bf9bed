//! What the formats of text have in common: lines that are read in blocks, in the encodings that there are, and
//! numbers.

mod lines;
mod number;

pub(super) use lines::{Lines, decoded, shown_line};
pub(super) use number::{leading, missing, number};

/// The words of a line, which have blanks between them.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Reads a line of numbers with blanks between them into `numbers`, as many as there is room for, and tells how many
/// there are; none if there are more, or anything else.
pub(super) fn row(line: &[u8], numbers: &mut [f64]) -> Option<usize> {
    let (mut at, mut count) = (0, 0);
    loop {
        while line.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        if at == line.len() {
            return Some(count);
        }
        let place = numbers.get_mut(count)?;
        let rest = &line[at..];
        let length = match leading(rest, b'.') {
            Some((number, length)) if rest.get(length).is_none_or(u8::is_ascii_whitespace) => {
                *place = number;
                length
            }
            _ => {
                let word = words(rest).next()?;
                *place = number(word, b'.').or_else(|| missing(word).then_some(f64::NAN))?;
                word.len()
            }
        };
        (at, count) = (at + length, count + 1);
    }
}

/// A colour of three numbers from 0 to `most`; none if one is not.
pub(super) fn colour(numbers: [f64; 3], most: f64) -> Option<[u8; 3]> {
    let fits = numbers.iter().all(|c| (0.0..=most).contains(c));
    fits.then(|| numbers.map(|c| (c / most * 255.0).round() as u8))
}

/// The number of a line that has nothing else.
pub(super) fn lone_count(line: &[u8]) -> Option<u64> {
    let word = line.trim_ascii();
    if word.is_empty() || !word.iter().all(u8::is_ascii_digit) {
        return None;
    }
    str::from_utf8(word).ok()?.parse().ok()
}
