//! Characters by which a text is not what it looks like (Unicode TR 36 and 39): controls of the direction of writing
//! show it in another order than it is compiled in, invisible characters and letters of other alphabets make two names
//! of what looks like one, and composed and decomposed letters are one name.

use super::lexer::lex;
use super::spanned;
use super::token::Token;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::FileId;
use std::collections::{HashMap, HashSet};
use unicode_normalization::{UnicodeNormalization, is_nfc};
use unicode_security::skeleton;

/// A name as it is compared with others: composed (NFC).
#[must_use]
pub fn name(text: &str) -> String {
    if text.is_ascii() || is_nfc(text) { text.to_owned() } else { text.nfc().collect() }
}

/// Errors for the controls of the direction of writing, wherever they are: in comments, too, they can make code look
/// like text and text like code.
pub(super) fn directions(file: FileId, text: &str) -> Vec<Diagnostic> {
    if text.is_ascii() {
        return Vec::new();
    }
    let error = |(start, c): (usize, char)| {
        let span = spanned(file, start as u32, (start + c.len_utf8()) as u32);
        let what =
            format!("a control of the direction of writing (U+{:04X}) hides the order of the text", u32::from(c));
        Diagnostic::new(Code::HiddenCharacter, span, what).suggest("remove it", [Edit::remove(span)])
    };
    text.char_indices().filter(|(_, c)| is_direction(*c)).map(error).collect()
}

/// Warnings for names with invisible characters, and for names that look like another name of the text.
#[must_use]
pub fn look_alikes(file: FileId, text: &str) -> Vec<Diagnostic> {
    if text.is_ascii() {
        return Vec::new();
    }
    // Names by what they look like; each is warned of once.
    let mut seen: HashMap<String, String> = HashMap::new();
    let mut judged: HashSet<String> = HashSet::new();
    let mut warnings = Vec::new();
    for lexeme in lex(file, text).0.iter().filter(|lexeme| lexeme.token == Token::Name) {
        let span = spanned(file, lexeme.start, lexeme.end);
        let name = name(&text[lexeme.start as usize..lexeme.end as usize]);
        if !judged.insert(name.clone()) {
            continue;
        }
        if let Some(c) = name.chars().find(|c| is_invisible(*c)) {
            let what = format!("this name has an invisible character (U+{:04X})", u32::from(c));
            let visible: String = name.chars().filter(|c| !is_invisible(*c)).collect();
            warnings.push(
                Diagnostic::new(Code::LookAlike, span, what).suggest("remove it", [Edit::replace(span, visible)]),
            );
            continue;
        }
        let other = seen.entry(skeleton(&name).collect()).or_insert_with(|| name.clone());
        if *other != name && !(name.is_ascii() && other.is_ascii()) {
            let what = format!("'{name}' looks like '{other}' and is another name");
            let letters = name.chars().zip(other.chars()).find(|(a, b)| a != b);
            let hint =
                letters.map(|(a, b)| format!("'{a}' is U+{:04X}, '{b}' is U+{:04X}", u32::from(a), u32::from(b)));
            let warning = Diagnostic::new(Code::LookAlike, span, what);
            warnings.push(if let Some(hint) = hint { warning.hint(hint) } else { warning });
        }
    }
    warnings
}

fn is_direction(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Characters that names may have and that are not shown: joiners, fillers and selectors of variants.
fn is_invisible(c: char) -> bool {
    matches!(c,
        '\u{ad}' | '\u{34f}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' | '\u{180b}'..='\u{180f}'
        | '\u{200b}'..='\u{200d}' | '\u{2060}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}' | '\u{ffa0}'
        | '\u{e0100}'..='\u{e01ef}')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::parse;

    fn warnings(text: &str) -> Vec<String> {
        look_alikes(FileId(0), text).into_iter().map(|d| d.message).collect()
    }

    #[test]
    fn composed_and_decomposed_letters_are_one_name() {
        assert_eq!(name("gro\u{308}ße"), "größe");
        assert_eq!(name("größe"), "größe");
        assert_eq!(warnings("let größe = 1\nlet b = gro\u{308}ße"), Vec::<String>::new());
    }

    #[test]
    fn names_that_look_alike_are_named() {
        // Cyrillic letters: the one looks like r, the other like a.
        let found = warnings("let radius = 1mm\nlet \u{433}adius = 2mm\nlet r\u{430}dius = 3mm");
        assert!(found.len() == 2 && found.iter().all(|w| w.contains("looks like 'radius'")), "{found:?}");
        assert!(warnings("let höhe = 1mm\nlet hohe = 2mm").is_empty(), "an umlaut is seen");
        assert!(warnings("let l1 = 1mm // größe\nlet ll = 2mm").is_empty(), "plain letters are nobody's trick");
        assert!(warnings("let a\u{fe0f} = 1").iter().any(|w| w.contains("U+FE0F")));
    }

    #[test]
    fn controls_of_direction_are_errors_even_in_comments() {
        for text in ["let a = 1 // \u{202e} a", "let a\u{2066} = 1", "/// \u{200f}\nlet a = 1"] {
            let (_, diagnostics) = parse(FileId(0), text);
            assert!(diagnostics.iter().any(|d| d.code == Code::HiddenCharacter), "{diagnostics:?}");
        }
        assert!(parse(FileId(0), "let a = 1 // größe, 直径").1.is_empty());
    }
}
