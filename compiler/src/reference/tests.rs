//! The page of a script with everything that a page can have.

use super::{library, script};
use crate::source::FileId;

#[test]
fn the_page_of_a_script() {
    let text = include_str!("tests/flange.gml");
    insta::assert_snapshot!(script("flange.gml", FileId(0), text).expect("a page"));
}

#[test]
fn a_script_with_errors_has_no_page() {
    let diagnostics = script("wrong.gml", FileId(0), "model m {\n").expect_err("an error");
    assert!(!diagnostics.is_empty());
}

#[test]
fn private_names_are_left_out() {
    let page = script("a.gml", FileId(0), "/// One.\nfn _one() = 1\n/// Two.\nfn two() = 2\nlet _three = 3\n")
        .expect("a page");
    assert_eq!(page, "# a.gml\n\n## Functions\n\n### two\n\n```\nfn two()\n```\n\nTwo.\n");
}

#[test]
fn every_module_of_the_library_has_a_page() {
    let pages = library();
    assert_eq!(pages[0].name, "README.md");
    let curve = pages.iter().find(|p| p.name == "curve.md").expect("the page of std.curve");
    assert!(curve.text.starts_with("# std.curve\n"), "{}", curve.text);
    assert!(curve.text.contains("\n## bezier\n\n```\nfn bezier(points)\n```\n\nThe Bezier curve"), "{}", curve.text);
    assert!(pages[0].text.contains("- [bezier](curve.md#bezier): The Bezier curve"), "{}", pages[0].text);
    assert!(!pages.iter().any(|p| p.text.contains("## _")), "private names are left out");
}

/// Every comment, message and name of a script comes to its page as text.
#[test]
fn no_html_of_a_script_reaches_its_page() {
    const BAD: &str = "<img src=x onerror=alert(1)>";
    let text = format!(
        "// Head {BAD}\n\n/// Of a function {BAD}\nfn f(x: real) = x\n/// Of a value {BAD}\nlet c = 1\n/// Of a model {BAD}\n\
         model m {{\n/// Of an input `{BAD}\ninput n: int = 1\n/// Of a parameter {BAD}\nparam r: length = 1mm\n\
         require r > 0mm, \"{BAD}\"\nrequire r > 1mm or // ` {BAD}\nr > 2mm, \"x\"\n/// Of a part {BAD}\n\
         part p = sphere(r)\n/// Of a measure {BAD}\nmeasure d = 2 * r\n}}\n"
    );
    let page = script(&format!("{BAD}.gml"), FileId(0), &text).unwrap();
    assert_eq!(page.matches("&lt;img").count(), 10, "{page}");
    for (at, _) in page.match_indices("<img") {
        let line = page[..at].rsplit('\n').next().unwrap_or_default();
        assert!(line.contains("`` ") || line.contains("``r"), "{line}\n{page}");
    }
}

/// A comment that opens a block of code and does not close it neither hides what follows nor makes it live.
#[test]
fn blocks_of_code_end_with_their_comment() {
    for open in ["```", "~~~ gml", "  ```", "- a\n/// ```", "> ```"] {
        let text = format!(
            "/// A value.\n/// {open}\nlet a = 1\n/// ```\n/// <script>x</script> [x](javascript:a)\n/// ```\nlet b = 2\n"
        );
        let page = script("a.gml", FileId(0), &text).unwrap();
        let mut fence = None;
        for line in page.lines() {
            let marks = line.trim().trim_end_matches(char::is_alphabetic).trim();
            let is_fence = marks.len() >= 3 && (marks.chars().all(|c| c == '`') || marks.chars().all(|c| c == '~'));
            match fence {
                None if is_fence => fence = Some(marks),
                Some(open) if is_fence && marks == open => fence = None,
                _ => {}
            }
            assert!(!line.starts_with('#') || fence.is_none(), "{open} hides {line}:\n{page}");
            assert!(!line.starts_with("<script") || fence.is_some(), "{open} makes {line} live:\n{page}");
        }
        assert!(page.contains("<script>"), "{page}");
    }
}
