//! Texts of scripts in Markdown: pages go to sites, where HTML in a comment of a foreign script would be run.

/// A text of Markdown whose HTML is shown, not obeyed. Code stays as it is: nothing is obeyed there.
pub(super) fn without_html(text: &str) -> String {
    let mut out = String::new();
    let mut lines = text.split_inclusive('\n').peekable();
    while let Some(line) = lines.next() {
        if let Some(fence) = Fence::of(line) {
            out.push_str(line);
            for line in lines.by_ref() {
                out.push_str(line);
                if fence.is_closed_by(line) {
                    break;
                }
            }
            continue;
        }
        // Code between backticks does not go beyond its paragraph.
        let mut paragraph = line.to_owned();
        while let Some(next) = lines.next_if(|next| !paragraph.trim().is_empty() && !next.trim().is_empty()) {
            if Fence::of(next).is_some() {
                out.push_str(&inline(&paragraph));
                paragraph = String::new();
                out.push_str(next);
                let fence = Fence::of(next);
                for line in lines.by_ref() {
                    out.push_str(line);
                    if fence.as_ref().is_some_and(|fence| fence.is_closed_by(line)) {
                        break;
                    }
                }
                break;
            }
            paragraph.push_str(next);
        }
        out.push_str(&inline(&paragraph));
    }
    out
}

/// The same of a text in one line, of which no line begins a block of code.
pub(super) fn inline(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['`', '<', '\\']) {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        if rest.starts_with('`') {
            let run = rest.len() - rest.trim_start_matches('`').len();
            let end = closing(&rest[run..], run).map_or(run, |end| run + end);
            out.push_str(&rest[..end]);
            rest = &rest[end..];
        } else if let Some(after) = rest.strip_prefix('<') {
            let is_tag = after.starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '/' | '!' | '?'));
            out.push_str(if is_tag { "&lt;" } else { "<" });
            rest = after;
        } else {
            // What is behind a backslash begins nothing, but `<` is escaped all the same.
            let escaped = rest[1..].chars().next().filter(|c| *c != '<').map_or(0, char::len_utf8);
            out.push_str(&rest[..=escaped]);
            rest = &rest[1 + escaped..];
        }
    }
    out + rest
}

/// The place behind the run of so many backticks that closes code.
fn closing(text: &str, run: usize) -> Option<usize> {
    let mut from = 0;
    while let Some(at) = text[from..].find('`') {
        let start = from + at;
        let length = text[start..].len() - text[start..].trim_start_matches('`').len();
        if length == run {
            return Some(start + length);
        }
        from = start + length;
    }
    None
}

/// The longest run of backticks in a text.
fn longest_run(text: &str) -> usize {
    text.split(|c| c != '`').map(str::len).max().unwrap_or(0)
}

/// A text as code within a line.
pub(super) fn code(text: &str) -> String {
    let ticks = "`".repeat(longest_run(text) + 1);
    let space = if text.starts_with('`') || text.ends_with('`') { " " } else { "" };
    format!("{ticks}{space}{text}{space}{ticks}")
}

/// Lines of code.
pub(super) fn block(text: &str) -> String {
    let ticks = "`".repeat(longest_run(text).max(2) + 1);
    format!("{ticks}\n{text}\n{ticks}")
}

/// The beginning of a block of code.
struct Fence {
    mark: char,
    length: usize,
}

impl Fence {
    fn of(line: &str) -> Option<Fence> {
        let text = line.trim_start_matches(' ');
        let mark = text.chars().next().filter(|c| matches!(c, '`' | '~'))?;
        let info = text.trim_start_matches(mark);
        let length = text.len() - info.len();
        let begins = line.len() - text.len() < 4 && length >= 3 && !(mark == '`' && info.contains('`'));
        begins.then_some(Fence { mark, length })
    }

    fn is_closed_by(&self, line: &str) -> bool {
        let text = line.trim();
        text.chars().all(|c| c == self.mark) && text.len() >= self.length && line.len() - line.trim_start().len() < 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn html_is_shown_and_code_stays() {
        for (text, expected) in [
            ("a < b and <b>c</b>", "a < b and &lt;b>c&lt;/b>"),
            ("`a<b>` <img src=x onerror=y>", "`a<b>` &lt;img src=x onerror=y>"),
            ("``a`<b>`` <b>", "``a`<b>`` &lt;b>"),
            ("an open ` <b>", "an open ` &lt;b>"),
            ("an escaped \\` <b> `", "an escaped \\` &lt;b> `"),
            ("a paragraph `\n\n<b>` ends", "a paragraph `\n\n&lt;b>` ends"),
            ("```\nx <b>\n```\n<b>", "```\nx <b>\n```\n&lt;b>"),
            ("text\n~~~ gml\n<b>\n~~~~\n<b>", "text\n~~~ gml\n<b>\n~~~~\n&lt;b>"),
            ("```a`b\n<b>", "```a`b\n&lt;b>"),
            ("<!-- --> \\<b>", "&lt;!-- --> \\&lt;b>"),
        ] {
            assert_eq!(without_html(text), expected);
        }
        assert_eq!((code("a"), code("`a``")), ("`a`".to_owned(), "``` `a`` ```".to_owned()));
        assert_eq!(block("a\n```\n<b>"), "````\na\n```\n<b>\n````");
    }
}
