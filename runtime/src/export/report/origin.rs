//! With what the results were made.

use super::Report;
use super::summary::file_name;
use super::tables::{row_of, table};
use crate::export::escape::escape;
use std::fmt::Write;

/// The section on files, options, the command line, and the scripts.
pub(super) fn origin(report: &Report<'_>) -> String {
    let mut out = String::from("<section>\n<h2>Provenance</h2>\n");
    if let Some(record) = report.record {
        let head = "<thead><tr><th>File</th><th>Is</th><th>SHA-256</th></tr></thead>\n";
        let row = |file: &crate::record::UsedFile| {
            let sum = format!("<code>{}</code>", escape(&file.sha256));
            row_of(&[escape(&file.name), escape(&file.role), sum])
        };
        table("Files that were read", head, record.files.iter().map(row), &mut out);
        let words: Vec<String> = record.command.iter().map(|word| escape(&shown(word))).collect();
        let _ = writeln!(out, "<h3>Command</h3>\n<p><code>{}</code></p>", words.join(" "));
        out.push_str("<details><summary>All settings</summary>\n");
        let head = "<thead><tr><th>Option</th><th>Value</th><th>By</th></tr></thead>\n";
        let row = |setting: &crate::record::Setting| {
            let values: Vec<String> = setting.values.iter().map(|value| escape(&shown(value))).collect();
            let by = if setting.given { "the command line" } else { "default" };
            row_of(&[format!("--{}", escape(&setting.name)), values.join(", "), by.to_owned()])
        };
        table(
            "Options and their values; those without a value are not listed",
            head,
            record.settings.iter().map(row),
            &mut out,
        );
        out.push_str("</details>\n");
    } else {
        let _ = writeln!(out, "<p>Scan SHA-256 <code>{}</code></p>", escape(&report.variance.scan.sha256));
    }
    for (name, text) in &report.scripts.texts {
        let (name, text) = (escape(name), escape(text));
        let _ = writeln!(out, "<details><summary>Script {name}</summary>\n<pre tabindex=\"0\">{text}</pre></details>");
    }
    let [width, height] = report.variance.resolution;
    let _ = writeln!(
        out,
        "<p class=\"convention\">Texture {width} &times; {height}; rays cast by {}.</p>\n</section>",
        escape(&report.variance.device)
    );
    out
}

/// A word of the command line: a path that begins at the root is nobody's business but for its end. Words with spaces
/// are in quotes.
fn shown(word: &str) -> String {
    let (option, value) = word.split_once('=').filter(|(o, _)| o.starts_with("--")).map_or(("", word), |(o, v)| (o, v));
    let is_rooted = value.starts_with('/') || value.starts_with("\\\\") || value.get(1..3) == Some(":\\");
    let value = if is_rooted { file_name(value) } else { value };
    let word = if option.is_empty() { value.to_owned() } else { format!("{option}={value}") };
    if word.contains(char::is_whitespace) { format!("\"{word}\"") } else { word }
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn folders_from_the_root_are_left_out() {
        for (word, expected) in [
            ("/home/roe/scans/cup.ply", "cup.ply"),
            ("scans/cup.ply", "scans/cup.ply"),
            ("--params=/home/roe/fit.json", "--params=fit.json"),
            ("C:\\Users\\roe\\cup.ply", "cup.ply"),
            ("Operator=R. Roe", "\"Operator=R. Roe\""),
        ] {
            assert_eq!(shown(word), expected);
        }
    }
}
