//! What the codes stand for: the sections of docs/diagnostics.md.

/// The page that lists all codes: `## code`, paragraphs, and an example that is diagnosed so.
const PAGE: &str = include_str!("../../../docs/diagnostics.md");

/// A code at length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Explanation {
    /// The code.
    pub code: &'static str,
    /// Paragraphs and an example, in Markdown.
    pub text: &'static str,
}

impl Explanation {
    /// The example: a script that is diagnosed so.
    #[must_use]
    pub fn example(&self) -> Option<&'static str> {
        let (_, rest) = self.text.split_once("```gml\n")?;
        Some(rest.split_once("```")?.0)
    }
}

/// All codes in alphabetical order.
pub fn explanations() -> impl Iterator<Item = Explanation> {
    PAGE.split("\n### ").skip(1).filter_map(|section| {
        let (code, text) = section.split_once('\n')?;
        let text = text.split("\n## ").next().unwrap_or(text);
        Some(Explanation { code: code.trim().trim_matches('`'), text: text.trim() })
    })
}

/// What a code stands for.
#[must_use]
pub fn explanation(code: &str) -> Option<Explanation> {
    explanations().find(|e| e.code == code)
}
