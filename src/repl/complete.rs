//! Completion of words.

use super::commands::{Argument, COMMANDS, SCRIPTS};
use gml_compiler::session::{Kind, Session};
use gml_compiler::source::NoFiles;
use gml_compiler::syntax::{Class, classes};
use std::ops::Range;
use std::path::{MAIN_SEPARATOR, Path};

/// Words of the language that may begin a line or a value.
const KEYWORDS: [&str; 17] = [
    "use", "fn", "deriv", "let", "model", "param", "input", "part", "measure", "require", "for", "if", "else", "true",
    "false", "not", "in",
];

/// The modules of the standard library.
const STD: &str = "std.";

/// The start of the word under the cursor, and its completions.
pub(crate) fn complete(session: &mut Session, line: &str, pos: usize) -> (usize, Vec<String>) {
    let before = &line[..pos];
    let Some(command) = before.trim_start().strip_prefix(':') else { return expression(session, before, 0) };
    let start = pos - command.len();
    let Some((name, rest)) = command.split_once(char::is_whitespace) else {
        let names = COMMANDS.iter().map(|c| c.name).filter(|n| n.starts_with(command));
        return (start, names.map(str::to_owned).collect());
    };
    let rest_start = pos - rest.len();
    let command = COMMANDS.iter().find(|c| c.name == name || (name.len() > 1 && c.name.starts_with(name)));
    match command.map_or(Argument::Expression, |c| c.argument) {
        Argument::Nothing => (pos, Vec::new()),
        Argument::Command => (rest_start, matching(rest, COMMANDS.iter().map(|c| c.name.to_owned()))),
        Argument::Parameter if !rest.contains('=') => {
            let parameters =
                session.names().into_iter().filter(|(_, kind)| matches!(kind, Kind::Parameter | Kind::Input));
            (rest_start, matching(rest, parameters.map(|(name, _)| format!("{name}="))))
        }
        Argument::File(extensions) => {
            let word = rest.rfind(char::is_whitespace).map_or(0, |i| i + 1);
            files(&rest[word..], rest_start + word, extensions)
        }
        _ => expression(session, before, rest_start),
    }
}

/// Completes an expression, or a line of the language, that begins at `from`.
fn expression(session: &mut Session, before: &str, from: usize) -> (usize, Vec<String>) {
    let text = &before[from..];
    let pieces: Vec<(Range<usize>, Class)> = classes(text).collect();
    match pieces.last() {
        Some((_, Class::Comment)) => return (before.len(), Vec::new()),
        // An unterminated text is a file's name.
        Some((range, Class::Wrong)) if text[range.start..].starts_with('"') => {
            return files(&text[range.start + 1..], from + range.start + 1, SCRIPTS);
        }
        _ => {}
    }
    let word = text.char_indices().rev().take_while(|(_, c)| c.is_alphanumeric() || *c == '_').last();
    let start = word.map_or(text.len(), |(i, _)| i);
    let prefix = &text[start..];
    if prefix.starts_with(|c: char| c.is_ascii_digit()) {
        return (before.len(), Vec::new());
    }
    if let Some(receiver) = text[..start].strip_suffix('.') {
        return (from + start, members(session, receiver, prefix));
    }
    let names = session.names().into_keys().filter(|n| n != "_");
    let mut completions = matching(prefix, labels(session, &text[..start]).into_iter());
    completions.extend(matching(prefix, names.chain(KEYWORDS.iter().map(|k| (*k).to_owned()))));
    if prefix.is_empty() {
        // A list of all names does not help; labels do.
        completions.retain(|c| c.ends_with(": "));
    }
    (from + start, completions)
}

/// Completions after a dot: fields, members of modules, and functions.
fn members(session: &mut Session, receiver: &str, prefix: &str) -> Vec<String> {
    let value = &receiver[operand(receiver)..];
    if value == "std" {
        let modules = session.modules().into_iter().filter_map(|m| m.strip_prefix(STD).map(str::to_owned));
        return matching(prefix, modules);
    }
    if value.is_empty() {
        return Vec::new();
    }
    let fields = session.fields(value, &NoFiles);
    let fields = matching(prefix, fields.into_iter());
    if !fields.is_empty() || prefix.is_empty() {
        return fields;
    }
    let names: Vec<String> = session.names().into_keys().collect();
    let functions = names.into_iter().filter(|n| n.starts_with(prefix));
    functions.filter(|n| session.known(n).is_some_and(|k| !k.labels.is_empty())).collect()
}

/// The start of the last operand of a text: names, dots, and brackets with their contents.
fn operand(text: &str) -> usize {
    let mut depth = 0;
    let mut start = text.len();
    for (i, c) in text.char_indices().rev() {
        match c {
            ')' | ']' | '}' => depth += 1,
            '(' | '[' | '{' if depth == 0 => break,
            '(' | '[' | '{' => depth -= 1,
            c if depth == 0 && !(c.is_alphanumeric() || matches!(c, '_' | '.' | '\'')) => break,
            _ => {}
        }
        start = i;
    }
    start
}

/// The labels of the call around the end of a text: `radius: `.
fn labels(session: &Session, text: &str) -> Vec<String> {
    let known = called(text).and_then(|name| session.known(name));
    known.map(|k| k.labels.iter().map(|l| format!("{l}: ")).collect()).unwrap_or_default()
}

/// The name of the function in whose arguments a text ends.
pub(crate) fn called(text: &str) -> Option<&str> {
    let mut depth = 0;
    let open = text.char_indices().rev().find_map(|(i, c)| {
        match c {
            ')' | ']' | '}' => depth += 1,
            '(' | '[' | '{' if depth == 0 => return Some((i, c)),
            '(' | '[' | '{' => depth -= 1,
            _ => {}
        }
        None
    });
    let (open, _) = open.filter(|(_, c)| *c == '(')?;
    let callee = &text[..open];
    let start = callee.char_indices().rev().take_while(|(_, c)| c.is_alphanumeric() || *c == '_').last()?.0;
    Some(&callee[start..])
}

fn matching(prefix: &str, names: impl Iterator<Item = String>) -> Vec<String> {
    names.filter(|n| n.starts_with(prefix) && n != prefix).collect()
}

/// Folders, and files with one of the extensions, whose path begins with `path`.
fn files(path: &str, at: usize, extensions: &[&str]) -> (usize, Vec<String>) {
    let quotes = path.len() - path.trim_start_matches('"').len();
    let (path, at) = (&path[quotes..], at + quotes);
    let split = path.rfind(MAIN_SEPARATOR).map_or(0, |i| i + 1);
    let (folder, prefix) = path.split_at(split);
    let folder = if folder.is_empty() { Path::new(".") } else { Path::new(folder) };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(mut name) = entry.file_name().into_string() else { continue };
        let hidden = name.starts_with('.') && !prefix.starts_with('.');
        if !name.starts_with(prefix) || hidden {
            continue;
        }
        if entry.path().is_dir() {
            name.push(MAIN_SEPARATOR);
        } else if !extensions.is_empty()
            && !extensions.iter().any(|e| entry.path().extension().is_some_and(|x| x.eq_ignore_ascii_case(e)))
        {
            continue;
        }
        names.push(name);
    }
    names.sort();
    (at + split, names)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gml_compiler::session::Options;

    fn completed(line: &str) -> (usize, Vec<String>) {
        let mut session = Session::new(Options::default());
        let text = "let radius_in = 3mm\nlet shape = {width: 2mm, height: 3mm}\nmodel m { param rim: length = 1mm\n part p = |u, v| (rim * u, rim * v, 0mm) }";
        session.enter(text, &NoFiles).expect("well-formed");
        complete(&mut session, line, line.len())
    }

    #[test]
    fn names_fields_labels_commands_and_parameters_are_completed() {
        assert_eq!(completed("2 * radius_"), (4, vec!["radius_in".into()]));
        assert_eq!(completed("shape.wi"), (6, vec!["width".into()]));
        assert_eq!(completed("p(0.5, 0.5)."), (12, vec!["x".into(), "y".into(), "z".into()]));
        assert_eq!(completed("tube(c, radius: 5mm"), (19, vec![]));
        assert!(completed("tube(c, rad").1.contains(&"radius: ".to_owned()));
        assert_eq!(completed(":para"), (1, vec!["params".into()]));
        assert_eq!(completed(":set ri"), (5, vec!["rim=".into()]));
        assert_eq!(completed(":grad ri"), (6, vec!["rim".into()]));
        assert!(completed("std.ma").1.contains(&"math".to_owned()));
        assert_eq!(completed("mod").1, ["model"]);
        assert!(completed("sm").1.contains(&"smoothstep".to_owned()));
        assert_eq!(completed("1 // rad").1, Vec::<String>::new());
    }
    #[test]
    fn files_are_completed_by_what_a_command_reads() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["vase.gml", "vase.png", "vase.ply"] {
            std::fs::write(folder.path().join(name), "").expect("written");
        }
        let path = folder.path().join("va").display().to_string();
        let offered = |command: &str| completed(&format!("{command} {path}")).1;
        assert_eq!(offered(":load"), ["vase.gml"]);
        assert_eq!(offered(":fit"), ["vase.ply"]);
        assert_eq!(offered(":mesh").len(), 3);
        let quoted = format!(":load \"{path}");
        assert_eq!(completed(&quoted), (quoted.len() - 2, vec!["vase.gml".into()]));
    }
}
