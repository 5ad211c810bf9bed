//! Texts of scripts in Markdown: pages go to sites, where HTML in a comment of a foreign script would be run, and its
//! links followed.
//!
//! It takes a reader of Markdown to know where a paragraph, an item or a cell ends, and with it code that begins there.
//! A text counts as code only where it is that wherever they end.

/// What links may begin with, beside relative paths and places in the page.
const SCHEMES: [&str; 3] = ["http://", "https://", "mailto:"];

/// Lines of a block of code in an item of a list: to find its end must not take a time that grows with the square of
/// what a stranger wrote.
const MOST_LINES: usize = 1000;

/// A text of Markdown whose HTML is shown, not obeyed, and whose links lead to pages. Code stays as it is: nothing is
/// obeyed there. A block of code that is left open ends with the text: what follows on the page is not part of it.
pub(super) fn without_html(text: &str) -> String {
    let text = with_plain_line_ends(text);
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let mut out = String::new();
    let mut prose = String::new();
    // Whether it is clear where code begins. A fence may end with the item of a list that it is in, if it is indented.
    let mut clear = true;
    // Lines up to this one belong to a block of code, wherever it is.
    let mut enclosed = 0;
    let mut i = 0;
    while let Some(line) = lines.get(i).copied() {
        let fence = Fence::of(line);
        clear &= fence.is_none() || !line.starts_with(' ');
        if let Some(fence) = fence.as_ref().filter(|_| clear) {
            out.push_str(&paragraph(&std::mem::take(&mut prose), clear));
            i = fence.copy(&lines, i, &mut out);
            continue;
        }
        i += 1;
        let mut marks_at = 0;
        if let Some(fence) = fence.filter(|_| i > enclosed) {
            match fence.enclosing(&lines, i) {
                Some(behind) => enclosed = behind,
                None => {
                    // Nobody can tell where it would end: it is text.
                    marks_at = fence.indent;
                    prose.push_str(&line[..marks_at]);
                    prose.push('\\');
                }
            }
        }
        prose.push_str(&line[marks_at..]);
        if line.trim().is_empty() || i == lines.len() {
            out.push_str(&paragraph(&std::mem::take(&mut prose), clear));
        }
    }
    out
}

/// The same of a text that stands in one line, of which no line begins a block of code.
pub(super) fn inline(text: &str) -> String {
    paragraph(&in_one_line(text), true)
}

/// A carriage return ends a line of Markdown, also without a line feed.
fn with_plain_line_ends(text: &str) -> String {
    text.replace("\r\n", "\n").replace('\r', "\n")
}

fn in_one_line(text: &str) -> String {
    with_plain_line_ends(text).replace('\n', " ")
}

/// A text as a cell of a table, whose marks between cells are text.
pub(super) fn cell(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // A mark behind an odd number of backslashes is text already.
    let mut is_escaped = false;
    for c in inline(text).chars() {
        if c == '|' && !is_escaped {
            out.push('\\');
        }
        is_escaped = c == '\\' && !is_escaped;
        out.push(c);
    }
    // At the end a backslash would take the mark behind the cell.
    if is_escaped {
        out.push('\\');
    }
    out
}

/// The lines up to an empty one. Unless it is clear where code begins, backticks mean nothing.
fn paragraph(text: &str, clear: bool) -> String {
    let defined = without_definitions(text);
    let text = defined.as_deref().unwrap_or(text);
    let mut backticks = Backticks { paired: clear, in_table: text.lines().any(divides_a_table) };
    text.split_inclusive('\n').map(|line| escaped(line, &mut backticks)).collect()
}

/// Whether backticks make code.
struct Backticks {
    /// So far each line closes what it opens, so that it does not matter at which line the paragraph begins.
    paired: bool,
    /// Cells end at a `|`, even within backticks.
    in_table: bool,
}

/// A line without HTML and links that are not allowed.
fn escaped(line: &str, backticks: &mut Backticks) -> String {
    let mut out = String::with_capacity(line.len());
    let mut rest = line;
    while let Some(at) = rest.find(['`', '<', '\\', ']']) {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        let taken = if rest.starts_with('`') {
            backticks.code(rest)
        } else if rest.starts_with('<') {
            let page = linked_page(rest);
            let is_tag = rest[1..].starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '/' | '!' | '?'));
            if page == 0 && is_tag {
                out.push_str("&lt;");
                rest = &rest[1..];
                continue;
            }
            page.max(1)
        } else if let Some(behind) = rest.strip_prefix('\\') {
            // What is behind a backslash begins nothing, but `<` is escaped all the same.
            1 + behind.chars().next().filter(|c| *c != '<').map_or(0, char::len_utf8)
        } else {
            if rest[1..].strip_prefix('(').is_some_and(|target| !is_allowed(target)) {
                out.push_str("]\\");
                rest = &rest[1..];
                continue;
            }
            1
        };
        out.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    out + rest
}

impl Backticks {
    /// The length of the code that begins with the backticks of a text, or that of these alone.
    fn code(&mut self, text: &str) -> usize {
        let run = text.len() - text.trim_start_matches('`').len();
        let Some(end) = closing(&text[run..], run) else {
            self.paired = false;
            return run;
        };
        let is_code = self.paired && !(self.in_table && text[..run + end].contains('|'));
        if is_code { run + end } else { run }
    }
}

/// The length of a link to a page that stands between angle brackets, else 0.
fn linked_page(text: &str) -> usize {
    let Some(end) = text.find('>') else { return 0 };
    let address = &text[1..end];
    let plain = address.chars().all(|c| c.is_ascii_graphic() && !matches!(c, '<' | '`' | '"' | '\\'));
    if plain && has_allowed_scheme(address) { end + 1 } else { 0 }
}

fn has_allowed_scheme(address: &str) -> bool {
    let address = address.to_ascii_lowercase();
    SCHEMES.iter().any(|scheme| address.starts_with(scheme))
}

/// Whether a link may lead to where a text begins with: to a page of the web, an address for mail, a relative path or a
/// place in the page. Characters that readers replace or leave out may hide anything.
fn is_allowed(target: &str) -> bool {
    let target = target.trim_start_matches([' ', '\t']);
    if target.trim_start().is_empty() || target.starts_with(['\n', '\r']) {
        // It is in the next line.
        return false;
    }
    let address = match target.strip_prefix('<') {
        Some(address) => address.split(['>', '\n']).next(),
        None => target.split([' ', '\t', '\n', ')']).next(),
    };
    let address = address.unwrap_or_default();
    let before_path = address.split(['/', '?', '#']).next().unwrap_or_default();
    let plain = !before_path.contains([':', '&', '\\']) && !before_path.chars().any(char::is_control);
    plain || has_allowed_scheme(address)
}

/// A paragraph whose definitions of links, `[name]: address`, are text where they are not allowed. They come before
/// everything else in a paragraph, so that backticks in them mean nothing.
fn without_definitions(paragraph: &str) -> Option<String> {
    let around = |c: char| c.is_whitespace() || c.is_ascii_digit() || matches!(c, '>' | '-' | '*' | '+' | '.' | ')');
    if !paragraph.lines().any(|line| line.trim_start_matches(around).starts_with('[')) {
        return None;
    }
    let mut out = String::with_capacity(paragraph.len());
    let mut rest = paragraph;
    while let Some((before, after)) = rest.split_once("]:") {
        out.push_str(before);
        out.push_str(if is_allowed(after) { "]:" } else { "]\\:" });
        rest = after;
    }
    Some(out + rest)
}

/// Whether a line divides the head of a table from its rows: `|---|:-:|`.
fn divides_a_table(line: &str) -> bool {
    line.contains('-') && line.chars().all(|c| matches!(c, '|' | ':' | '-' | '>') || c.is_whitespace())
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
    let text = in_one_line(text);
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
    indent: usize,
}

impl Fence {
    fn of(line: &str) -> Option<Fence> {
        let text = line.trim_start_matches(' ');
        let mark = text.chars().next().filter(|c| matches!(c, '`' | '~'))?;
        let info = text.trim_start_matches(mark);
        let (length, indent) = (text.len() - info.len(), line.len() - text.len());
        let begins = indent < 4 && length >= 3 && !(mark == '`' && info.contains('`'));
        begins.then_some(Fence { mark, length, indent })
    }

    /// Other white space than this, before or behind the marks, makes them text.
    fn is_closed_by(&self, line: &str) -> bool {
        let text = line.trim_start_matches(' ');
        let marks = text.trim_end_matches([' ', '\t', '\n']);
        marks.chars().all(|c| c == self.mark) && marks.len() >= self.length && line.len() - text.len() < 4
    }

    /// Copies the block that begins in a line, and closes it; the place behind it.
    fn copy(&self, lines: &[&str], first: usize, out: &mut String) -> usize {
        let end = (first + 1..lines.len()).find(|i| self.is_closed_by(lines[*i]));
        let behind = end.map_or(lines.len(), |end| end + 1);
        lines[first..behind].iter().for_each(|line| out.push_str(line));
        if end.is_none() {
            let line_end = if out.ends_with('\n') { "" } else { "\n" };
            out.push_str(&format!("{line_end}{}", String::from(self.mark).repeat(self.length)));
        }
        behind
    }

    /// The place behind the line that closes the block whose inside begins at a line, if all of it is in the same item
    /// of a list, or in none: nothing is indented less than the fences.
    fn enclosing(&self, lines: &[&str], from: usize) -> Option<usize> {
        let indent = |line: &str| line.len() - line.trim_start_matches(' ').len();
        let inside = |line: &&&str| line.trim().is_empty() || indent(line) >= self.indent;
        let block = lines[from..].iter().take(MOST_LINES).take_while(inside);
        let end = block.take_while(|line| !self.is_closed_by(line)).count() + from;
        lines.get(end).filter(|line| self.is_closed_by(line) && indent(line) == self.indent).map(|_| end + 1)
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
            // Code ends with its block, and a heading, an item and a cell are blocks.
            ("# a `\n<b> `", "# a `\n&lt;b> `"),
            ("- a `\n- ` <b> `", "- a `\n- ` &lt;b> `"),
            ("| ` |\n|---|\n| ` | <b> ` |", "| ` |\n|---|\n| ` | &lt;b> ` |"),
            ("| a |\n|---|\n| ` | <b> ` |", "| a |\n|---|\n| ` | &lt;b> ` |"),
            ("- a\n  ```\n<b>\n\n`<b>`", "- a\n  \\```\n&lt;b>\n\n`&lt;b>`"),
            ("- a\n  ```\n  <b>\n\n  ```\n", "- a\n  ```\n  &lt;b>\n\n  ```\n"),
            ("`|t| <b>`\n`<b>`", "`|t| <b>`\n`<b>`"),
        ] {
            assert_eq!(without_html(text), expected);
        }
        assert_eq!((code("a"), code("`a``")), ("`a`".to_owned(), "``` `a`` ```".to_owned()));
        assert_eq!(block("a\n```\n<b>"), "````\na\n```\n<b>\n````");
    }

    #[test]
    fn blocks_of_code_end_with_their_text() {
        for (text, expected) in [
            ("```", "```\n```"),
            ("a\n~~~~ gml\n<b>", "a\n~~~~ gml\n<b>\n~~~~"),
            ("```\na\n```", "```\na\n```"),
            ("```\n````", "```\n````"),
            // These close nothing: other white space makes them text.
            ("```\n\t```\n<b>\n```", "```\n\t```\n<b>\n```"),
            ("```\n```\u{a0}\n<b>", "```\n```\u{a0}\n<b>\n```"),
            // A carriage return alone ends a line.
            ("~~~\r~~~\r<b>", "~~~\n~~~\n&lt;b>"),
            ("~~~\r\n~~~", "~~~\n~~~"),
            // In an item of a list or not, nothing is open behind these.
            ("  ```", "  \\```"),
            (" ~~~ a\nb", " \\~~~ a\nb"),
            ("- a\n  ```\nb\n  ```", "- a\n  \\```\nb\n  \\```"),
            ("- a\n  ```\n  b\n```\n<b>", "- a\n  \\```\n  b\n\\```\n&lt;b>"),
            ("  ```\n  ```\n~~~", "  ```\n  ```\n\\~~~"),
        ] {
            assert_eq!(without_html(text), expected);
        }
    }

    #[test]
    fn one_line_stays_one() {
        assert_eq!(inline("a\r```\n<b>"), "a ``` &lt;b>");
        assert_eq!(code("a\r# <b>\nc"), "`a # <b> c`");
        for (text, expected) in [("a|b", "a\\|b"), ("a\\|b", "a\\|b"), ("a\\\\|b", "a\\\\\\|b"), ("a\\", "a\\\\")] {
            assert_eq!(cell(text), expected);
        }
    }

    #[test]
    fn links_lead_to_pages() {
        for link in [
            "[x](https://a.b/c:d)",
            "[x](HTTP://a.b)",
            "[x](mailto:a@b.c)",
            "[x](curve.md#bezier)",
            "[x](../a/b.md?c=d:e \"title: x\")",
            "[x](#place)",
            "![x](a.png)",
            "[x]()",
            "[x]: https://a.b\n",
            "[x]: a.md 'title'\n[y]: #b",
            "<https://a.b/c>",
            "<mailto:a@b.c>",
            "`[x](javascript:a)`",
            "a[i] (x: y)",
            "[x]\\(javascript:a)",
            "in [0, 1]: b",
        ] {
            assert_eq!(without_html(link), link);
        }
        for link in [
            "[x](javascript:alert(1))",
            "[x]( JavaScript:a)",
            "[x](<javascript:a>)",
            "[x](java\\script:a)",
            "[x](javascript&colon;a)",
            "[x](&#106;avascript:a)",
            "[x](<java\tscript:a>)",
            "[x](\u{1}javascript:a)",
            "[x](data:text/html;base64,PHN)",
            "[x](vbscript:a)",
            "[x](file:///etc/passwd)",
            "![x](javascript:a)",
            "[`x`](javascript:a)",
            "[x](\njavascript:a)",
            "> [x](\n> javascript:a)",
        ] {
            assert!(without_html(link).contains("]\\("), "{link}: {}", without_html(link));
        }
        for link in [
            "[x]: javascript:a",
            "[x]:\njavascript:a",
            "> [x]:\n> javascript:a",
            "- [x]: <javascript:a> 'title'",
            "1. [x]: data:a",
            "[a`b]: javascript:c '`'",
            "[a\nb]: javascript:c",
            "[x]: a.md\n[y]: javascript:a",
        ] {
            assert!(without_html(link).contains("]\\:"), "{link}: {}", without_html(link));
        }
        assert_eq!(without_html("<javascript:a> <data:b>"), "&lt;javascript:a> &lt;data:b>");
    }
}
