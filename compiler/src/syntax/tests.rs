//! What trees come out, what is said where none can, and that nothing breaks the parser.

use super::*;
use crate::diagnostic::{Code, Diagnostic};
use proptest::prelude::*;

const FILE: FileId = FileId(0);

fn tree(text: &str) -> String {
    let (file, diagnostics) = parse(FILE, text);
    assert_eq!(diagnostics, [], "in {text}");
    print(&file)
}

fn expression(text: &str) -> String {
    let tree = one_line(&tree(&format!("let it = {text}")));
    tree.strip_prefix("(let it ").and_then(|t| t.strip_suffix(')')).expect("a declaration").to_owned()
}

/// An indented tree as nested parentheses, to compare small ones.
fn one_line(tree: &str) -> String {
    fn nodes<'t>(lines: &mut std::iter::Peekable<std::str::Lines<'t>>, depth: usize) -> Vec<String> {
        let indent = |line: &str| line.len() - line.trim_start().len();
        let mut out = Vec::new();
        while lines.peek().is_some_and(|line| indent(line) == depth) {
            let head = lines.next().unwrap_or("").trim();
            let below = nodes(lines, depth + 2);
            out.push(if below.is_empty() { head.to_owned() } else { format!("({head} {})", below.join(" ")) });
        }
        out
    }
    nodes(&mut tree.lines().peekable(), 0).join(" ")
}

/// Each finding with the source line under it, as a reader would see it.
fn findings(text: &str) -> String {
    render(text, &parse(FILE, text).1)
}

fn render(text: &str, diagnostics: &[Diagnostic]) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    for d in diagnostics {
        let (start, end) = (d.span.start as usize, d.span.end as usize);
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line = text[line_start..].lines().next().unwrap_or("");
        let number = text[..start].matches('\n').count() + 1;
        let indent = text[line_start..start].chars().count();
        let width = text[start..end].lines().next().unwrap_or("").chars().count().max(1);
        let _ = writeln!(out, "{}: {}", d.code, d.message);
        let _ = writeln!(out, "{number:4} | {line}\n     | {}{}", " ".repeat(indent), "^".repeat(width));
        if let Some(hint) = &d.hint {
            let _ = writeln!(out, "     = hint: {hint}");
        }
    }
    out
}

#[test]
fn the_cup_parses() {
    insta::assert_snapshot!(tree(include_str!("tests/cup.gml")));
}

#[test]
fn the_flange_parses() {
    insta::assert_snapshot!(tree(include_str!("tests/flange.gml")));
}

#[test]
fn precedence() {
    for (text, expected) in [
        ("1 + 2 * 3", "(+ 1 (* 2 3))"),
        ("1 - 2 - 3", "(- (- 1 2) 3)"),
        ("a / b % c", "(% (/ a b) c)"),
        ("-a ^ 2", "(negative (^ a 2))"),
        ("a ^ -b ^ c", "(^ a (negative (^ b c)))"),
        ("2 ^ 3 ^ 4", "(^ 2 (^ 3 4))"),
        ("a * -b", "(* a (negative b))"),
        ("--a", "(negative (negative a))"),
        ("not a == b and c or d", "(or (and (not (== a b)) c) d)"),
        ("0..n + 1", "(.. 0 (+ n 1))"),
        ("0..3", "(.. 0 3)"),
        ("1.5..2.5e1", "(.. 1.5 25.0)"),
        ("a..b == c", "(== (.. a b) c)"),
        ("(a < b) == (c < d)", "(== (< a b) (< c d))"),
        ("c'(t)", "(call (prime c) t)"),
        ("c''", "(prime (prime c))"),
        ("s'u(u, v).x", "(field x (call (prime u s) u v))"),
        ("s'u'v", "(prime v (prime u s))"),
        ("f(a)'", "(prime (call f a))"),
        ("a.f(b).g", "(field g (method f a b))"),
        ("(a.f)(b)", "(call (field f a) b)"),
        ("a[1][2]", "(index (index a 1) 2)"),
        ("2 * v.x^2", "(* 2 (^ (field x v) 2))"),
        ("|t| t + 1", "(lambda parameter t (+ t 1))"),
        ("|| 1", "(lambda 1)"),
        ("|(x, y), z: real| |w| x", "(lambda parameter (x, y) parameter z: real (lambda parameter w x))"),
        ("f(|t| t, radius: 5mm,)", "(call f (lambda parameter t t) (radius: 5.0mm))"),
        ("(a)", "a"),
        ("(a, b,)", "(tuple a b)"),
        ("[]", "array"),
        ("{}", "block"),
        ("{a: 1, b: {c}}", "(record (a: 1) (b: (block c)))"),
        ("1 + if a { 1 } else if b { 2 } else { 3 }", "(+ 1 (if a (block 1) (if b (block 2) (block 3))))"),
        ("for i in 0..3 { i * 2 }", "(for i (.. 0 3) (block (* i 2)))"),
        ("15mm..80mm", "(.. 15.0mm 80.0mm)"),
        ("5in + 1turn + 2e-3m + 3deg", "(+ (+ (+ 5.0in 1.0turn) 0.002m) 3.0deg)"),
        ("1_000", "1000"),
        ("1e1_0 + 1e+1_0 + 2e-0_3mm", "(+ (+ 10000000000.0 10000000000.0) 0.002mm)"),
        ("2.mix(3)", "(method mix 2 3)"),
        ("\"a \\\"b\\\"\\n\"", "\"a \\\"b\\\"\\n\""),
        ("größe + α", "(+ größe α)"),
    ] {
        assert_eq!(expression(text), expected, "in {text}");
    }
}

#[test]
fn line_ends() {
    for (text, expected) in [
        ("{ let a = 1\n a }", "(block (let a 1) a)"),
        ("{ let a = 1; let b = 2; a }", "(block (let a 1) (let b 2) a)"),
        ("{ let a =\n 1 +\n 2\n a }", "(block (let a (+ 1 2)) a)"),
        ("{ let a = f\n  .g(1)\n  .h\n a }", "(block (let a (field h (method g f 1))) a)"),
        ("{ let a = 1\n  + 2 // why\n\n  // not\n  - 3\n a }", "(block (let a (- (+ 1 2) 3)) a)"),
        ("{ let a = f\n (b) }", "(block (let a f) b)"),
        ("{ let a = f\n [b] }", "(block (let a f) (array b))"),
        ("f(\n a\n ,\n b\n)", "(call f a b)"),
        ("f(|t| {\n let a = t\n a\n})", "(call f (lambda parameter t (block (let a t) a)))"),
        ("|t|\n t", "(lambda parameter t t)"),
        ("{\n a:\n 1,\n b: 2\n}", "(record (a: 1) (b: 2))"),
        ("{ if a\n {\n 1 }\n else\n { 2 } }", "(block (if a (block 1) (block 2)))"),
        ("{;; let a = 1;; ;\n a; }", "(block (let a 1) a)"),
        ("a\n+ b", "(+ a b)"),
        ("{ let a = 1\r\n a\r\n}", "(block (let a 1) a)"),
    ] {
        assert_eq!(expression(text), expected, "in {text}");
    }
}

#[test]
fn items() {
    insta::assert_snapshot!(tree(
        r#"
use std.surface
use "parts/column.gml" (column, base)

/// Two lines
/// of text.
fn f(x: length, n = 3, c: curve) -> (length^2, [real]) = x
fn g(s: (real, real) -> point3, h: real -> real -> real)
{
  fn inner(a) = a
  deriv inner(a; da) = da
  require n > 0, "n must be positive"
  let (p, (q, _)) = pair
  p
}
model m
{
  param a: real
  input n: int in 1..4 = 2
  part handle tolerance 1mm = tube(c)
  if n > 2 { part top = s } else if n > 1 { let k = 1; part low = s } else { for i in 0..n { part b = s } }
  let tolerance = 2mm
}
"#
    ));
}

#[test]
fn doc_comments_elsewhere_are_comments() {
    assert_eq!(
        tree("let a = 1 /// no\n/// yes\nlet b = f(/// no\n 1)\n/// no\n"),
        "let a\n  1\n/// yes\nlet b\n  call\n    f\n    1\n"
    );
}

#[test]
fn several_errors_a_file() {
    insta::assert_snapshot!(findings(
        "modle cup {\n  param x = 3\n}\nmodel a {\n  param r length = 3\n  let b = (1 + \n  let c = 1 2\n  part p\n  \
         cylinder(3mm, 4mm)\n  x = 3\n  part q = { let s = ; s }\n  for i in 0..3 { part hole = f(a b) }\n}\nlet let = 3\n"
    ));
}

#[test]
fn errors_in_words() {
    let texts = [
        "let a = 1 +",
        "let a = )",
        "let a = [1, 2",
        "let a = f(1, 2",
        "let a = 3 kg",
        "let a = 3kg + 4degrees",
        "let a = 2 r",
        "let a = 2 mm",
        "let a = b == c == d",
        "let a = 0 < x < 1",
        "let a = b || c && !d",
        "let a = 'text'",
        "let a = \"text",
        "let a = \"te\\xt\"",
        "let a = 99999999999999999999",
        "let a = 1e999",
        "let a = 30°",
        "let a = ()",
        "let a = { let b = 1; c = 2; b }",
        "let a = { b\n c }",
        "let a = if b = c { 1 } else { 2 }",
        "let a = b ** 2",
        "let a = .5",
        "let a = |x + 1| 2",
        "fn f(x) -> = 3",
        "fn f(x) x + 1",
        "fn f x = 1",
        "deriv f(x) = 1",
        "model m { param x: length in 3mm = 4mm }",
        "}\nlet a = 1\n)",
        "use 3",
        "function f(x) = 1",
        "let in = 3",
        "model m {\n part p = f(1\n part q = 2 3\n}",
        "let a = b c",
        "let a: = 1",
        "let a: length^1.5 = b",
        "let a = f(x: )",
        "let a = @#$ + 1",
        "let a = for i 0..3 { i }",
    ];
    let all: Vec<String> = texts.iter().map(|text| findings(text)).collect();
    assert!(all.iter().all(|f| !f.is_empty()), "each of them is wrong");
    insta::assert_snapshot!(all.join("\n"));
}

#[test]
fn a_broken_statement_leaves_the_others() {
    let (file, diagnostics) = parse(FILE, "model a {\n  let b = 1 +\n  part p = q\n}\nmodel c {}");
    assert_eq!(diagnostics.len(), 1);
    assert_eq!(print(&file), "model a\n  error\n  part p\n    q\nmodel c\n");
}

/// Deep input of every kind is refused, and no tree is so deep that dropping or printing it would overflow a small
/// stack.
#[test]
fn deep_input_is_refused() {
    const MANY: usize = 100_000;
    let texts = [
        format!("let a = {}1{}", "(".repeat(MANY), ")".repeat(MANY)),
        format!("let a = {}", "(".repeat(MANY)),
        format!("let a = {}1{}", "[".repeat(MANY), "]".repeat(MANY)),
        format!("let a = {}1{}", "{".repeat(MANY), "}".repeat(MANY)),
        format!("let a = {}1{}", "{a:".repeat(MANY), "}".repeat(MANY)),
        format!("let a = {}1", "-".repeat(MANY)),
        format!("let a = {}1", "not ".repeat(MANY)),
        format!("let a = {}1", "|x|".repeat(MANY)),
        format!("let a = 1{}", "+1".repeat(MANY)),
        format!("let a = 1{}", "^1".repeat(MANY)),
        format!("let a = f{}", "()".repeat(MANY)),
        format!("let a = f{}", "'".repeat(MANY)),
        format!("let a = f{}", ".b".repeat(MANY)),
        format!("let a = f{}", "[0]".repeat(MANY)),
        format!("let a = {} {{ 1 }}", "if a { 1 } else ".repeat(MANY)),
        format!("model m {{ {} {{ }} }}", "if a { } else ".repeat(MANY)),
        format!("let a: {}b = 1", "b -> ".repeat(MANY)),
        format!("let a: {}b{} = 1", "[".repeat(MANY), "]".repeat(MANY)),
        format!("let {}b{} = 1", "(".repeat(MANY), ")".repeat(MANY)),
        "{".repeat(MANY),
        "model m {".repeat(MANY),
        "for i in a {".repeat(MANY),
        "fn f(x) = { ".repeat(MANY),
    ];
    for text in texts {
        let start = text[..30].to_owned();
        let check = move || {
            let (file, diagnostics) = parse(FILE, &text);
            assert!(!diagnostics.is_empty(), "in {start}...");
            let _ = print(&file);
        };
        let thread = std::thread::Builder::new().stack_size(1 << 20).spawn(check);
        thread.expect("a thread can be made").join().expect("no panic");
    }
}

#[test]
fn the_limit_itself_is_allowed() {
    let text = format!("let a = 1{}", " + 1".repeat(NESTING_LIMIT as usize - 3));
    assert_eq!(parse(FILE, &text).1, []);
}

#[test]
fn too_long_a_file_is_refused() {
    let text = " ".repeat(LENGTH_LIMIT + 1);
    assert_eq!(parse(FILE, &text).1[0].code, Code::TooLong);
}

/// Pieces from which random files are put together.
const PIECES: [&str; 59] = [
    "use",
    "fn",
    "deriv",
    "let",
    "model",
    "param",
    "input",
    "part",
    "measure",
    "require",
    "for",
    "in",
    "if",
    "else",
    "true",
    "and",
    "or",
    "not",
    "tolerance",
    "a",
    "f",
    "x",
    "1",
    "0..",
    "2.5mm",
    "\"t\"",
    "'",
    "'u",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "+",
    "-",
    "*",
    "/",
    "%",
    "^",
    "==",
    "!=",
    "<",
    ">=",
    "..",
    ".",
    ",",
    ":",
    "=",
    "->",
    "|",
    ";",
    "\n",
    "// c\n",
    "/// d\n",
    "{a:",
    "@",
    "3kg",
    "\"open",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_survived(text in any::<String>()) {
        sound(&text)?;
    }

    #[test]
    fn any_tokens_are_survived(pieces in prop::collection::vec((prop::sample::select(&PIECES[..]), any::<bool>()), 0..60)) {
        let text: String = pieces.iter().map(|(p, space)| format!("{p}{}", if *space { " " } else { "" })).collect();
        sound(&text)?;
    }

    /// A script with some bytes removed.
    #[test]
    fn damaged_scripts_are_survived(cuts in prop::collection::vec((any::<prop::sample::Index>(), 1usize..20), 1..6)) {
        let mut text = include_str!("tests/cup.gml").to_owned();
        for (at, length) in cuts {
            let (start, end) = (at.index(text.len()), text.len());
            let range = text.floor_char_boundary(start)..text.floor_char_boundary((start + length).min(end));
            text.replace_range(range, "");
        }
        sound(&text)?;
    }
}

/// Nothing panics, findings lie in the text, and a file without findings has no error nodes.
fn sound(text: &str) -> Result<(), TestCaseError> {
    let (file, diagnostics) = parse(FILE, text);
    for d in &diagnostics {
        prop_assert!(text.get(d.span.start as usize..d.span.end as usize).is_some(), "{:?} lies outside", d);
    }
    if diagnostics.is_empty() {
        prop_assert!(!print(&file).lines().any(|l| l.trim() == "error"), "an error without a finding");
    }
    let _ = parse_entries(FILE, text);
    Ok(())
}
