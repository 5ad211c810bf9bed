//! Comments and Markdown are wrapped at one width, so that they can be read beside the code and compared line by line.

use crate::support::root;
use std::fs;
use std::path::{Path, PathBuf};

/// The last column of a comment or of a paragraph.
const WIDTH: usize = 120;

/// Files with one of the endings below a folder, except those that builds and runs write.
fn files(folder: &Path, endings: &[&str], into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.expect("a folder's entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            // docs/std is generated, each paragraph as one line.
            let skipped = ["target", "out", "node_modules", "std"].contains(&name.as_str());
            if !name.starts_with('.') && !skipped {
                files(&path, endings, into);
            }
        } else if path.extension().is_some_and(|e| endings.contains(&e.to_string_lossy().as_ref())) {
            into.push(path);
        }
    }
}

/// Places (file and line) of the lines that are too long, among those for which `counts` is true. The second argument
/// of `counts` tells whether the line is in a fenced block.
fn too_long(endings: &[&str], counts: impl Fn(&str, bool) -> bool) -> Vec<String> {
    let mut paths = Vec::new();
    files(root(), endings, &mut paths);
    assert!(!paths.is_empty(), "no files end in {endings:?}");
    let mut places = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut fenced = false;
        for (i, line) in text.lines().enumerate() {
            fenced ^= line.trim_start_matches(['/', '!', ' ']).starts_with("```");
            if line.chars().count() > WIDTH && counts(line.trim_start(), fenced) {
                places.push(format!("{}:{}", path.display(), i + 1));
            }
        }
    }
    places
}

/// A word that is longer than a line (an address, a path) cannot be wrapped.
fn can_be_wrapped(line: &str) -> bool {
    line.split_whitespace().all(|w| w.chars().count() < WIDTH - 10)
}

#[test]
fn comments_end_at_column_120() {
    let places = too_long(&["rs", "wgsl", "glsl"], |line, fenced| {
        line.starts_with("//") && !fenced && !line.contains('|') && can_be_wrapped(line)
    });
    assert!(places.is_empty(), "comments go beyond column {WIDTH}:\n{}", places.join("\n"));
}

#[test]
fn comments_of_scripts_end_at_column_120() {
    let places = too_long(&["gml"], |line, fenced| line.starts_with("//") && !fenced && can_be_wrapped(line));
    let kept = |p: &&String| !p.contains("tests/diagnostics") && !p.contains("tests/language");
    let places: Vec<&String> = places.iter().filter(kept).collect();
    assert!(places.is_empty(), "comments go beyond column {WIDTH}: {places:#?}");
}

#[test]
fn paragraphs_of_markdown_end_at_column_120() {
    let places = too_long(&["md"], |line, fenced| {
        !fenced && !line.starts_with(['|', '#', '!', '<', '[']) && can_be_wrapped(line)
    });
    assert!(places.is_empty(), "paragraphs go beyond column {WIDTH}:\n{}", places.join("\n"));
}
