//! Printing that does not end the program where standard output or error cannot be written to, as on a full disk: the
//! standard macros panic. `main` asks at the end whether all was printed. Names from files, comments and paths may hold
//! characters that a terminal obeys; they are written out.

use gml_runtime::reason::of_kind;
use std::borrow::Cow;
use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::sync::OnceLock;

/// Why standard output could not be written to, the first time.
static FAILED: OnceLock<ErrorKind> = OnceLock::new();

/// Prints to standard output.
pub(crate) fn output(text: Arguments) {
    keep(std::io::stdout().write_all(visible(&std::fmt::format(text)).as_bytes()));
}

/// Writes the bytes of a file to standard output, as they are.
pub(crate) fn bytes(bytes: &[u8]) {
    keep(std::io::stdout().write_all(bytes));
}

/// Prints to standard error. Where that fails nobody can be told.
pub(crate) fn error(text: Arguments) {
    styled(&visible(&std::fmt::format(text)));
}

/// Prints to standard error a text that may have colours, and no other control characters.
pub(crate) fn styled(text: &str) {
    _ = std::io::stderr().write_all(text.as_bytes());
}

/// A text whose control characters are written out, as JSON has them, but for line ends and tabs.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    written_out(text, |c| is_obeyed(c) && !matches!(c, '\n' | '\t'))
}

/// The same with line ends and tabs.
pub(crate) fn visible_in_line(text: &str) -> Cow<'_, str> {
    written_out(text, is_obeyed)
}

/// Whether terminals obey a character: controls, those of the direction of writing too, by which a text shows another
/// one than it holds, and ends of lines.
fn is_obeyed(c: char) -> bool {
    let directs = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || directs
}

fn written_out(text: &str, is_hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_hidden(c) { out.push_str(&format!("\\u{:04x}", u32::from(c))) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// The beginning of a text's first line, for messages that quote what may be long.
pub(crate) fn cut(text: &str, most: usize) -> String {
    let line = text.trim().lines().next().unwrap_or_default();
    match line.char_indices().nth(most) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    }
}

/// Whether all of standard output could be printed.
pub(crate) fn finish() -> Result<(), String> {
    keep(std::io::stdout().flush());
    let failed = |kind: &ErrorKind| Err(format!("standard output cannot be written to: {}", of_kind(*kind)));
    FAILED.get().map_or(Ok(()), failed)
}

fn keep(result: std::io::Result<()>) {
    if let Err(error) = result {
        _ = FAILED.set(error.kind());
    }
}

/// Prints a note to standard error, which is no warning and no error: nothing depends on it.
pub(crate) fn note(text: Arguments) {
    if !crate::verbosity::is_quiet() {
        error(text);
    }
}

macro_rules! print {
    ($($text:tt)*) => { $crate::print::output(format_args!($($text)*)) };
}

macro_rules! println {
    () => { $crate::print::output(format_args!("\n")) };
    ($($text:tt)*) => { $crate::print::output(format_args!("{}\n", format_args!($($text)*))) };
}

macro_rules! eprintln {
    () => { $crate::print::error(format_args!("\n")) };
    ($($text:tt)*) => { $crate::print::error(format_args!("{}\n", format_args!($($text)*))) };
}

macro_rules! note {
    ($($text:tt)*) => { $crate::print::note(format_args!("{}\n", format_args!($($text)*))) };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_written_out() {
        assert_eq!(visible("a\u{1b}[31mb\u{7}\u{9b}c\r größe\n\t"), "a\\u001b[31mb\\u0007\\u009bc\\u000d größe\n\t");
        assert!(matches!(visible("größe\n"), Cow::Borrowed(_)));
        assert_eq!(visible("a\u{202e}b\u{2066}c\n"), "a\\u202eb\\u2066c\n");
        assert_eq!(visible_in_line("a\n\t\u{202e}"), "a\\u000a\\u0009\\u202e");
    }
}
