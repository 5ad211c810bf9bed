//! Text from users inside XML and HTML.

/// Escapes text for element content and quoted attributes of XML and HTML. Characters that XML 1.0 forbids become
/// U+FFFD; line ends and tabs become references, so that attributes keep them.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' => out.push_str("&#9;"),
            '\n' => out.push_str("&#10;"),
            '\r' => out.push_str("&#13;"),
            '\0'..='\x1f' | '\x7f'..='\u{9f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn markup_is_escaped() {
        assert_eq!(escape("<a b=\"c\" d='e'>&amp;"), "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;amp;");
        assert_eq!(escape("hole[0] × ✓\t\n"), "hole[0] × ✓&#9;&#10;");
    }

    #[test]
    fn what_xml_forbids_is_replaced() {
        assert_eq!(escape("a\0b\u{1b}\u{ffff}\u{85}"), "a\u{fffd}b\u{fffd}\u{fffd}\u{fffd}");
    }
}
