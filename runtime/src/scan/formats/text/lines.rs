//! Lines of a text that is read in blocks.

use crate::scan::cloud::{Input, Source};
use crate::scan::error::{ScanFault, shown};
use std::borrow::Cow;
use std::io::{ErrorKind, Read};

/// The longest line that is read, in bytes of UTF-8: there is a point in it.
const LONGEST: usize = 1 << 20;
/// Bytes that are read at a time.
const BLOCK: usize = 1 << 18;

/// How characters are bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    /// UTF-8, or any other that has ASCII's characters as ASCII has them.
    Ascii,
    Utf16Le,
    Utf16Be,
}

impl Encoding {
    /// The encoding of a text that begins so, and the length of its mark.
    fn of(head: &[u8]) -> (Self, usize) {
        // Without a mark digits, signs and blanks have every other byte 0.
        let zeros = |from: usize| head.iter().take(16).skip(from).step_by(2).all(|b| *b == 0);
        let some = |from: usize| head.iter().take(16).skip(from).step_by(2).all(|b| *b != 0);
        match head {
            [0xef, 0xbb, 0xbf, ..] => (Self::Ascii, 3),
            [0xff, 0xfe, ..] => (Self::Utf16Le, 2),
            [0xfe, 0xff, ..] => (Self::Utf16Be, 2),
            [_, _, _, _, ..] if some(0) && zeros(1) => (Self::Utf16Le, 0),
            [_, _, _, _, ..] if zeros(0) && some(1) => (Self::Utf16Be, 0),
            _ => (Self::Ascii, 0),
        }
    }

    /// Adds the characters of `bytes` to a text; what is left of `bytes` is the beginning of a character.
    fn decode(self, bytes: &mut Vec<u8>, text: &mut Vec<u8>) {
        let unit = |pair: &[u8; 2]| match self {
            Self::Utf16Be => u16::from_be_bytes(*pair),
            _ => u16::from_le_bytes(*pair),
        };
        let (pairs, _) = bytes.as_chunks();
        let is_half = pairs.last().is_some_and(|pair| (0xd800..0xdc00).contains(&unit(pair)));
        let whole = &pairs[..pairs.len() - usize::from(is_half)];
        let mut buffer = [0; 4];
        for character in char::decode_utf16(whole.iter().map(unit)) {
            let character = character.unwrap_or(char::REPLACEMENT_CHARACTER);
            text.extend_from_slice(character.encode_utf8(&mut buffer).as_bytes());
        }
        let length = 2 * whole.len();
        bytes.drain(..length);
    }
}

/// The beginning of a file as a text in UTF-8, without its mark.
pub(in crate::scan) fn decoded(head: &[u8]) -> Cow<'_, [u8]> {
    let (encoding, mark) = Encoding::of(head);
    if encoding == Encoding::Ascii {
        return Cow::Borrowed(&head[mark..]);
    }
    let mut text = Vec::new();
    encoding.decode(&mut head[mark..].to_vec(), &mut text);
    Cow::Owned(text)
}

/// The lines of a file, one after the other. They end with a line feed, a carriage return, or both.
pub(in crate::scan) struct Lines {
    format: &'static str,
    source: Box<dyn Source>,
    encoding: Encoding,
    /// Bytes in UTF-16 that are not in `block` yet.
    raw: Vec<u8>,
    block: Vec<u8>,
    /// The current line in `block`.
    line: std::ops::Range<usize>,
    /// The first byte of `block` behind that line.
    next: usize,
    /// Number of bytes that were read from the source.
    read: u64,
    ended: bool,
    number: u64,
}

impl Lines {
    /// The lines of a file of the format that messages name.
    pub(in crate::scan) fn new(input: Input, format: &'static str) -> Result<Self, ScanFault> {
        let mut lines = Self {
            format,
            source: input.bytes,
            encoding: Encoding::Ascii,
            raw: Vec::new(),
            block: Vec::new(),
            line: 0..0,
            next: 0,
            read: 0,
            ended: false,
            number: 0,
        };
        while lines.block.len() < 16 && !lines.ended {
            lines.fill()?;
        }
        let (encoding, mark) = Encoding::of(&lines.block);
        if encoding == Encoding::Ascii {
            lines.next = mark;
        } else {
            lines.raw = lines.block.split_off(mark);
            lines.block.clear();
            lines.encoding = encoding;
            encoding.decode(&mut lines.raw, &mut lines.block);
        }
        Ok(lines)
    }

    /// Goes on to the next line; false at the end of the file.
    #[inline]
    pub(in crate::scan) fn advance(&mut self) -> Result<bool, ScanFault> {
        loop {
            let rest = &self.block[self.next..];
            let end = rest.iter().position(|b| *b == b'\n' || *b == b'\r');
            match end {
                // What follows a carriage return must be known.
                Some(end) if rest[end] == b'\n' || end + 1 < rest.len() || self.ended => {
                    let pair = rest[end] == b'\r' && rest.get(end + 1) == Some(&b'\n');
                    self.line = self.next..self.next + end;
                    self.next += end + if pair { 2 } else { 1 };
                    self.number += 1;
                    return Ok(true);
                }
                None if self.ended => {
                    self.line = self.next..self.block.len();
                    self.next = self.block.len();
                    self.number += u64::from(!self.line.is_empty());
                    return Ok(!self.line.is_empty());
                }
                _ if rest.len() > LONGEST => {
                    let message = format!("the line has more than {LONGEST} bytes; a line for each point was expected");
                    return Err(ScanFault::malformed(self.format, format!("line {}", self.number + 1), message));
                }
                _ => self.fill()?,
            }
        }
    }

    /// Goes on to the next line that has more than blanks.
    #[inline]
    pub(in crate::scan) fn advance_to_text(&mut self) -> Result<bool, ScanFault> {
        while self.advance()? {
            if !self.line().trim_ascii().is_empty() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn fill(&mut self) -> Result<(), ScanFault> {
        self.block.drain(..self.next);
        self.next = 0;
        self.line = 0..0;
        let into = if self.encoding == Encoding::Ascii { &mut self.block } else { &mut self.raw };
        let before = into.len();
        into.resize(before + BLOCK, 0);
        let count = read_some(&mut *self.source, &mut into[before..])?;
        into.truncate(before + count);
        self.ended = count == 0;
        self.read += count as u64;
        if self.encoding != Encoding::Ascii {
            self.encoding.decode(&mut self.raw, &mut self.block);
        }
        Ok(())
    }

    /// The current line, without its end.
    #[inline]
    pub(in crate::scan) fn line(&self) -> &[u8] {
        &self.block[self.line.clone()]
    }

    /// The number of the current line, counted from 1.
    pub(in crate::scan) fn number(&self) -> u64 {
        self.number
    }

    /// Number of bytes of the file that were read, for the progress.
    pub(in crate::scan) fn read(&self) -> u64 {
        self.read
    }

    /// The source, and the offset of the byte behind the current line in it. (Of a text in UTF-8.)
    pub(in crate::scan) fn into_source(self) -> (Box<dyn Source>, u64) {
        let unread = self.block.len() - self.next;
        (self.source, self.read - unread as u64)
    }

    /// A fault in the current line.
    #[cold]
    pub(in crate::scan) fn fault(&self, message: impl Into<String>) -> ScanFault {
        ScanFault::malformed(self.format, format!("line {}", self.number), message)
    }

    /// A fault of the current line, which is not what was expected.
    #[cold]
    pub(in crate::scan) fn unexpected(&self, expected: &str) -> ScanFault {
        self.fault(format!("expected {expected}, found `{}`", self.shown()))
    }

    /// The current line for a message.
    pub(in crate::scan) fn shown(&self) -> String {
        shown_line(self.line())
    }
}

/// A line for a message: its beginning, without what terminals obey to.
pub(in crate::scan) fn shown_line(line: &[u8]) -> String {
    // Lines may be long.
    let text = String::from_utf8_lossy(&line[..line.len().min(1000)]);
    let visible = |c: char| match c {
        '\t' => ' ',
        c if c.is_control() => char::REPLACEMENT_CHARACTER,
        c => c,
    };
    shown(&text.chars().map(visible).collect::<String>())
}

fn read_some(source: &mut dyn Read, into: &mut [u8]) -> Result<usize, ScanFault> {
    loop {
        match source.read(into) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            other => return other.map_err(ScanFault::Unreadable),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn lines(bytes: Vec<u8>) -> Result<Vec<String>, ScanFault> {
        let input = Input { size: bytes.len() as u64, bytes: Box::new(Cursor::new(bytes)), only: None };
        let mut lines = Lines::new(input, "text")?;
        let mut all = Vec::new();
        while lines.advance()? {
            all.push(String::from_utf8_lossy(lines.line()).into_owned());
            assert_eq!(all.len() as u64, lines.number());
        }
        Ok(all)
    }

    #[test]
    fn ends_and_encodings() {
        let text = "a 1\r\nb\n\nü\rc\r\n\r\nlast";
        let expected = ["a 1", "b", "", "ü", "c", "", "last"];
        let utf16 = |mark: bool, big: bool| -> Vec<u8> {
            let bytes = |unit: u16| if big { unit.to_be_bytes() } else { unit.to_le_bytes() };
            mark.then_some(0xfeff).into_iter().chain(text.encode_utf16()).flat_map(bytes).collect()
        };
        let files = [
            text.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            utf16(true, false),
            utf16(true, true),
            utf16(false, false),
            utf16(false, true),
        ];
        for file in files {
            assert_eq!(lines(file.clone()).unwrap(), expected);
            assert_eq!(*decoded(&file), *text.as_bytes());
        }
        assert_eq!(lines(Vec::new()).unwrap(), [""; 0]);
        assert_eq!(lines(b"\r".to_vec()).unwrap(), [""]);
    }

    #[test]
    fn lines_across_blocks() {
        for line in ["0123456789", "0123456789\r", "012345\u{1f600}89"] {
            let text = format!("{line}\n").repeat(100_000);
            let expected = line.trim_end();
            assert!(lines(text.clone().into_bytes()).unwrap().iter().all(|line| line == expected));
            let utf16 = std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
            let found = lines(utf16).unwrap();
            assert!(found.len() == 100_000 && found.iter().all(|line| line == expected));
        }
    }

    #[test]
    fn a_line_without_end_is_refused() {
        let error = lines(vec![b'1'; 3 << 20]).unwrap_err().to_string();
        assert!(error.contains("line 1") && error.contains("more than 1048576 bytes"), "{error}");
    }
}
