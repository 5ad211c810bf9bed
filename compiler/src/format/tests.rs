//! What is laid out how, and that nothing else changes.

use super::{FormatError, format, format_within};
use crate::source::FileId;
use crate::syntax;
use crate::syntax::token::Token;
use logos::Logos;
use std::path::{Path, PathBuf};

fn formatted(text: &str) -> String {
    format(FileId(0), text).unwrap_or_else(|e| panic!("{e:?}\n{text}"))
}

/// Asserts that it is laid out so, and that so it stays.
#[track_caller]
fn becomes(text: &str, expected: &str) {
    let expected = expected.strip_prefix('\n').unwrap_or(expected);
    let once = formatted(text);
    assert_eq!(once, expected, "\n--- found\n{once}\n--- expected\n{expected}");
    assert_eq!(formatted(&once), once, "formatting again changes it");
}

#[track_caller]
fn stays(text: &str) {
    becomes(text, text);
}

/// Every script of the repository.
fn scripts() -> Vec<PathBuf> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                collect(&path, found);
            } else if path.extension().is_some_and(|e| e == "gml") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    for folder in ["stdlib", "examples", "tests", "compiler/src", "compiler/tests"] {
        collect(&root.join(folder), &mut found);
    }
    found.sort();
    found
}

/// The cases of a language test, which are files of their own; other files are one case.
fn cases(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).expect("a script");
    let mut cases = vec![String::new()];
    for line in text.split_inclusive('\n') {
        if line.starts_with("// ---") {
            cases.push(String::new());
        }
        cases.last_mut().expect("one case at least").push_str(line);
    }
    cases.retain(|case| !case.trim().is_empty());
    cases
}

/// Asserts what always holds for a text that can be read: the tree and the comments stay, and formatting again changes
/// nothing.
fn check(text: &str, width: usize, name: &str) -> bool {
    let once = match format_within(FileId(0), text, width) {
        Ok(once) => once,
        Err(FormatError::Syntax(_)) => return false,
        Err(e) => panic!("{name}: {e}\n{text}"),
    };
    let tree = |text: &str| {
        let (tree, diagnostics) = syntax::parse(FileId(0), text);
        assert!(diagnostics.is_empty(), "{name}: {diagnostics:?}\n{text}");
        syntax::print(&tree)
    };
    assert_eq!(tree(text), tree(&once), "{name}: the tree changed\n--- from\n{text}\n--- to\n{once}");
    let twice = format_within(FileId(0), &once, width).unwrap_or_else(|e| panic!("{name}: {e}\n{once}"));
    assert!(once == twice, "{name}: formatting again changes it\n{}\n--- from\n{text}", difference(&once, &twice));
    assert!(!once.lines().any(|l| l.ends_with(' ')), "{name}: spaces at the end of a line\n{once}");
    true
}

/// The lines from the first to the last that differ.
fn difference(a: &str, b: &str) -> String {
    let (a, b): (Vec<&str>, Vec<&str>) = (a.lines().collect(), b.lines().collect());
    let head = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let tail = a[head..].iter().rev().zip(b[head..].iter().rev()).take_while(|(a, b)| a == b).count();
    format!("--- once\n{}\n--- twice\n{}", a[head..a.len() - tail].join("\n"), b[head..b.len() - tail].join("\n"))
}

#[test]
fn every_script_of_the_repository_at_several_widths() {
    let mut count = 0;
    for path in scripts() {
        for case in cases(&path) {
            for width in [110, 60, 30, 10, 0] {
                count += usize::from(check(&case, width, &path.display().to_string()));
            }
        }
    }
    assert!(count > 250, "only {count} scripts can be read");
}

/// Numbers that are the same in every run: splitmix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }
}

/// What may stand between two tokens in place of a space or a line end.
const BETWEEN: [&str; 12] = [
    " ",
    "\n",
    "\n\n",
    "\n\n\n",
    " // a comment\n",
    "\n// a comment\n",
    "\n/// a comment\n",
    "; ",
    ";\n",
    " // one\n  // two\n",
    "\n\n// apart\n\n",
    ",\n",
];

/// What may stand in place of a token.
const INSTEAD: [&str; 16] = [
    "",
    "(a)",
    "((a, b))",
    "a_rather_long_name",
    "[a, b,]",
    "|t| t",
    "{ a; b }",
    "-1",
    "-a",
    "if a { b } else { c }",
    "f(a,)",
    "a.b()",
    "{a: 1}",
    "1/2",
    "f''",
    "for i in 0..3 { i }",
];

/// The text with some of its spaces and tokens replaced.
fn mutant(text: &str, random: &mut Random) -> String {
    let mut pieces: Vec<&str> = Vec::new();
    let mut end = 0;
    for (_, range) in Token::lexer(text).spanned() {
        pieces.extend([&text[end..range.start], &text[range.clone()]]);
        end = range.end;
    }
    for _ in 0..1 + random.below(4) {
        let at = random.below(pieces.len());
        if at.is_multiple_of(2) || (random.below(2) == 0 && pieces[at] == "\n") {
            pieces[at] = BETWEEN[random.below(BETWEEN.len())];
        } else if random.below(4) == 0 {
            pieces[at] = INSTEAD[random.below(INSTEAD.len())];
        }
    }
    pieces.concat()
}

#[test]
fn scripts_with_other_spaces_comments_and_tokens() {
    let mut random = Random(2);
    let rounds = std::env::var("GMLC_FORMAT_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let texts: Vec<(String, PathBuf)> =
        scripts().into_iter().flat_map(|p| cases(&p).into_iter().map(move |c| (c, p.clone()))).collect();
    let mut count = 0;
    for _ in 0..rounds {
        for (text, path) in &texts {
            let mutant = mutant(text, &mut random);
            let width = [110, 40, 12][random.below(3)];
            count += usize::from(check(&mutant, width, &path.display().to_string()));
        }
    }
    assert!(count > 20 * rounds, "only {count} can be read");
}

#[test]
fn a_function_within_arguments_at_every_width() {
    for text in [
        "model m { part p = offset(revolve(|t| (r * (1 - t), r * t ^ 2)), 3mm) }",
        "part p = offset(revolve(|t| (r * (1 - t), r * t ^ 2)), 3mm)",
        "let a = f(g(|t| [r * (1 - t), r * t ^ 2]).h(|t| (a, b)), |u, v| k(|t| (u, v), t), 3mm)",
    ] {
        for width in 0..90 {
            assert!(check(text, width, &format!("at a width of {width}")));
        }
    }
}

#[test]
fn spaces_and_line_ends() {
    becomes("let  a=1+2*  3^2\n\n\n\nlet b = - a", "let a = 1 + 2 * 3 ^ 2\n\nlet b = -a\n");
    becomes("fn f( a:real,b=2 )->[ length ]=|t|a", "fn f(a: real, b = 2) -> [length] = |t| a\n");
    becomes("model m{part p=f(a)[ 0 ].b'u(c)}\r\n", "model m { part p = f(a)[0].b'u(c) }\n");
    becomes("let a = 1 / 2 + (3/4) ^ n / 5", "let a = 1/2 + (3/4) ^ n / 5\n");
    becomes("deriv norm( v ;dv,){ 0 }", "deriv norm(v; dv) { 0 }\n");
    becomes("use std . curve(bezier ,line,)", "use std.curve (bezier, line)\n");
    becomes("let t: (real,length^2)->(real -> point3) = x", "let t: (real, length ^ 2) -> (real -> point3) = x\n");
    becomes("\n\n// only a comment   \n\n\n// and another\n\n", "// only a comment\n\n// and another\n");
    becomes("", "");
}

#[test]
fn the_author_joins_statements() {
    stays("model m {\n  param x: length = 0mm; param y: length = 0mm\n  part p = f({ let a = 1; a })\n}\n");
    becomes("let a = 1;;\nlet b = 2;", "let a = 1\nlet b = 2\n");
    // Joined, they would be longer than a line.
    let long = "a".repeat(60);
    becomes(&format!("let {long} = 1; let b{long} = 2"), &format!("let {long} = 1\nlet b{long} = 2\n"));
    // Without its semicolon the last line would continue the one before.
    stays("fn f(a) {\n  let b = 1;\n  -a\n}\n");
    stays("fn f(a) = { let b = 1; -a }\n");
}

#[test]
fn lists_are_broken_where_they_are_long() {
    // Within the one argument that makes them long.
    becomes(
        "model m { part handle = pose(tube(bezier([(r * h1,  0mm, h * outer(h1)),(r * h2a, 0mm, h * h2b), (r * h3a, 0mm, h)]), radius: 5mm)) }",
        "
model m {
  part handle = pose(tube(bezier([
    (r * h1, 0mm, h * outer(h1)),
    (r * h2a, 0mm, h * h2b),
    (r * h3a, 0mm, h),
  ]), radius: 5mm))
}
",
    );
    // One a line.
    let (a, b, c) = ("a".repeat(40), "b".repeat(40), "c".repeat(40));
    becomes(&format!("let x = f({a}, {b}, {c})"), &format!("let x = f(\n  {a},\n  {b},\n  {c},\n)\n"));
    becomes(&format!("fn f({a}, {b}, {c}) = 1"), &format!("fn f(\n  {a},\n  {b},\n  {c},\n) = 1\n"));
    // A comma after the last element asks for it.
    stays("let x = [\n  1,\n  2,\n]\n");
    becomes("let x = [1, 2,]", "let x = [\n  1,\n  2,\n]\n");
    becomes("let x = [\n1,\n2\n]", "let x = [1, 2]\n");
    // Numbers fill their lines.
    let numbers = (100..140).map(|n| n.to_string()).collect::<Vec<_>>();
    let lines = format!("{},\n  {}", numbers[..21].join(", "), numbers[21..].join(", "));
    becomes(&format!("let x = [{}]", numbers.join(", ")), &format!("let x = [\n  {lines},\n]\n"));
}

#[test]
fn long_values() {
    let (a, b) = ("a".repeat(50), "b".repeat(52));
    becomes(&format!("let x = {a} + {b}"), &format!("let x =\n  {a} + {b}\n"));
    becomes(&format!("let x = {a} + {b} * {a}"), &format!("let x =\n  {a}\n  + {b} * {a}\n"));
    becomes(&format!("let x = {a} + {b} * {b}"), &format!("let x =\n  {a}\n  + {b}\n    * {b}\n"));
    becomes(&format!("let x = f({a}, {b})"), &format!("let x =\n  f({a}, {b})\n"));
    becomes(&format!("let x = f({b}, {b})"), &format!("let x = f(\n  {b},\n  {b},\n)\n"));
    becomes(
        &format!("let x = cylinder({a}).translate(b).rotate({b})"),
        &format!("let x = cylinder({a})\n  .translate(b)\n  .rotate({b})\n"),
    );
    becomes(&format!("let x = map({a}, |x| g({b}))"), &format!("let x = map({a}, |x|\n  g({b}))\n"));
    becomes(&format!("let x = |t| ({a}, {b})"), &format!("let x = |t| (\n  {a},\n  {b},\n)\n"));
}

#[test]
fn conditions() {
    stays("fn f(a) = if a > 0 { 1 } else { 2 }\n");
    stays("fn f(a) =\n  if a > 0 { 1 }\n  else if a < 0 { 2 }\n  else { 3 }\n");
    stays("fn f(a) = if a > 0 {\n  1\n} else {\n  2\n}\n");
    becomes("fn f(a) = if a > 0 {\n1 } else { 2 }", "fn f(a) = if a > 0 {\n  1\n} else {\n  2\n}\n");
}

#[test]
fn comments_stay_where_they_are() {
    stays(
        "/// Above.\nlet a = 1  // beside\n\n// apart\n\nfn f(\n  a,  // the first\n  // above the second\n  b,\n) {\n  // within\n\n  a  // the value\n  // below\n}\n",
    );
    becomes("let a = b + // why\n  c", "let a =\n  b\n  +  // why\n  c\n");
    becomes("model m { // here\n}", "model m {  // here\n}\n");
}

#[test]
fn what_cannot_be_read_is_refused() {
    let failed = format(FileId(0), "let a = (1 +\n").expect_err("a syntax error");
    assert!(matches!(&failed, FormatError::Syntax(diagnostics) if !diagnostics.is_empty()));
    let failed = format(FileId(0), "param x: real = 1 2\n").expect_err("a syntax error");
    assert_eq!(failed.to_string(), "the script has errors");
}

/// Indentation that grows without end would make a long text of a short one.
#[test]
fn deeply_nested_scripts_stay_short() {
    let text = format!("let a = {}{}{}", "[".repeat(150), "aaaaaaaaa(b), ".repeat(1000), "]".repeat(150));
    let formatted = formatted(&text);
    assert!(formatted.len() < 10 * text.len(), "{} bytes of {}", formatted.len(), text.len());
}

#[test]
fn measures() {
    becomes(
        "model m{\nmeasure d tolerance + 0.2 / - 0.1mm=2*r\nmeasure a tolerance 1deg*2=b // c\n}",
        "model m {\n  measure d tolerance +0.2/-0.1mm = 2 * r\n  measure a tolerance 1deg * 2 = b  // c\n}\n",
    );
    becomes(
        "model m{\nmeasure d of  a . b,c [ 2 ] tolerance 1mm=r\n}",
        "model m {\n  measure d of a.b, c[2] tolerance 1mm = r\n}\n",
    );
    stays("model m {\n  measure d tolerance 0/-(a + b) = 2 * r\n  measure e = {\n    let f = 1\n    f\n  }\n}\n");
}
