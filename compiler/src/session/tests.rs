//! Values against those computed by hand.

use super::*;
use crate::diagnostic::Code;
use crate::source::NoFiles;

/// Enters texts one after another; the answers of the last, as printed.
fn shown(texts: &[&str]) -> String {
    let mut session = Session::new(Options::default());
    let mut last = Vec::new();
    for text in texts {
        last = session.enter(text, &NoFiles).unwrap_or_else(|e| panic!("{text}: {e}\n{:?}", e.diagnostics));
    }
    let shown: Vec<String> = last.iter().filter_map(|a| a.value.as_ref().map(ToString::to_string)).collect();
    shown.join("; ")
}

fn error(session: &mut Session, text: &str) -> Code {
    match session.enter(text, &NoFiles) {
        Ok(answers) => panic!("{text}: {answers:?}"),
        Err(e) => e.diagnostics[0].code,
    }
}

fn value(session: &mut Session, text: &str) -> String {
    let answers = session.enter(text, &NoFiles).unwrap_or_else(|e| panic!("{text}: {e}\n{:?}", e.diagnostics));
    answers.last().and_then(|a| a.value.as_ref()).map_or_else(String::new, ToString::to_string)
}

const BEAKER: &str = "/// A beaker.
model beaker {
  param r: length in 15mm..80mm = 40mm
  param h: length in 30mm..200mm = 90mm
  param taper: real in 0..0.5 = 0.2
  param lean: angle = 30deg
  require r < h, \"too flat\"
  fn radius(t: real) -> length = r * (1 - taper * (1 - t))
  let rim = radius(1)
  part wall = revolve(|t| (radius(t), h * t))
  for i in 0..2 {
    part foot = |u, v| (r * u, r * v, 1mm * i)
  }
}";

#[test]
fn values_are_printed_with_their_dimension() {
    for (text, expected) in [
        ("42mm", "42 mm"),
        ("2cm * 6cm", "1200 mm^2"),
        ("30deg", "30 deg"),
        ("pi / 2", "90 deg"),
        ("1 / 2", "0.5"),
        ("1 / 3", "0.333333"),
        ("2 + 3", "5"),
        ("1e-9 * 2.5", "2.5e-9"),
        ("1234567.5", "1234568"),
        ("0.1 + 0.2", "0.3"),
        ("-0.0 * 1", "0"),
        ("1e20 / 3", "3.33333e19"),
        ("(1mm, 2mm, 3mm)", "(1, 2, 3) mm"),
        ("(1, 2, 3) / 1", "(1, 2, 3)"),
        ("(1mm, 0.5)", "(1 mm, 0.5)"),
        ("[1mm, 2cm]", "[1, 20] mm"),
        ("[1, 2]", "[1, 2]"),
        ("[(1mm, 2mm), (3mm, 4mm)]", "[(1, 2), (3, 4)] mm"),
        ("for i in 0..3 { i * 10deg }", "[0, 10, 20] deg"),
        ("1 < 2 and not false", "true"),
        ("{a: 1, b: 2mm}", "{a: 1, b: 2 mm}"),
        ("\"a \\\"text\\\"\"", "\"a \\\"text\\\"\""),
        ("0..5", "0..5"),
        ("sqrt(4mm * 9mm)", "6 mm"),
        ("sqrt(2mm)", "1.41421 mm^(1/2)"),
        ("1 / 4mm", "0.25 mm^-1"),
        ("sin(30deg)", "0.5"),
    ] {
        assert_eq!(shown(&[text]), expected, "{text}");
    }
}

#[test]
fn functions_are_named_by_what_they_are() {
    for (text, expected) in [
        ("|u, v| (u * 1mm, v * 1mm, 0mm)", "<surface (u, v) -> point3>"),
        ("|t| (t * 1mm, 2mm)", "<curve (t) -> point2>"),
        ("|x| x + 1", "<function (x)>"),
        ("|x: length| x * x", "<function (x: length) -> area>"),
        ("sin", "<function (angle)>"),
        ("{f: |x: real| x}", "{f: <function (x: real) -> real>}"),
    ] {
        assert_eq!(shown(&[text]), expected, "{text}");
    }
}

#[test]
fn definitions_stay_and_are_replaced_for_what_comes_later() {
    assert_eq!(shown(&["let a = 2mm", "let b = a * 3", "let a = 5mm", "b; a"]), "6 mm; 5 mm");
    assert_eq!(shown(&["fn f(x) = x + 1", "fn g(x) = f(x) * 10", "fn f(x) = x", "g(1)", "g(2); f(2)"]), "30; 2");
    assert_eq!(shown(&["let (a, b) = (1mm, 2deg)", "a; b"]), "1 mm; 2 deg");
    assert_eq!(shown(&["let (a, b) = (1mm, 2deg)"]), "(1 mm, 2 deg)");
    // In one text, too, and in any order.
    assert_eq!(shown(&["twice(4)\nfn twice(x) = 2 * one(x)\nfn one(x) = x"]), "8");
    assert_eq!(shown(&["let a = 1\na\nlet a = a + 1\na"]), "1; 1; 2; 2");
    assert_eq!(shown(&["fn fact(n: int) -> int = if n < 2 { 1 } else { n * fact(n - 1) }", "fact(10)"]), "3628800");
}

#[test]
fn the_library_and_what_is_used_are_known() {
    assert_eq!(shown(&["mix(2mm, 4mm, 0.5)"]), "3 mm");
    assert_eq!(shown(&["use std.math (mix)", "mix(0, 10, 0.25)"]), "2.5");
    assert_eq!(shown(&["use std.math", "math.mix(0, 10, 0.25)"]), "2.5");
    assert_eq!(shown(&["let c = |t| (1mm * t ^ 2, 2mm * t)", "c'(3)"]), "(6, 2) mm");
}

#[test]
fn after_an_error_the_session_is_as_before() {
    let mut session = Session::new(Options::default());
    assert_eq!(value(&mut session, "let a = 1mm"), "1 mm");
    for (text, code) in [
        ("a +* 2", Code::Syntax),
        ("let a = 2mm\nlet b = a + 1", Code::DimensionMismatch),
        ("use std.nothing", Code::UnknownModule),
        ("fn a(x: real) -> length = x", Code::DimensionMismatch),
        ("b", Code::UnknownName),
        ("1 / 0", Code::IntArithmetic),
        ("floor(1e300)", Code::IntArithmetic),
        ("int(-1e19)", Code::IntArithmetic),
        ("round(9223372036854775807.0)", Code::IntArithmetic),
        ("floor(0.0 / 0.0)", Code::RunTime),
        ("(|x: real| int(x))(1e300)", Code::RunTime),
        ("[1, 2, 3][int(0.0 / 0.0)]", Code::RunTime),
        ("(|x: real| abs(int(x)))(-9.223372036854775808e18)", Code::RunTime),
        ("sum([9223372036854775807, 1])", Code::RunTime),
        ("loop(1, 70, |a, i| a * 2)", Code::RunTime),
        ("let a = sqrt(0 - 1)", Code::NotFinite),
        ("part p = a", Code::Misplaced),
        ("model a { param r: length = 1mm; part p = |u, v| r }", Code::NotASurface),
        ("[1, 2][if sqrt(2) > 1 { 5 } else { 6 }]", Code::RunTime),
    ] {
        assert_eq!(error(&mut session, text), code, "{text}");
        assert_eq!(value(&mut session, "a"), "1 mm", "after {text}");
    }
    assert!(session.model().is_none());
}

#[test]
fn errors_quote_what_was_entered() {
    let mut session = Session::new(Options::default());
    let failed = session.enter("let a = 1mm\na + 1", &NoFiles).expect_err("an error");
    let span = failed.diagnostics[0].span;
    assert_eq!(failed.sources.line_column(span).0, 2, "{failed}");
    let failed = session.enter("5 + 1 / (1 - 1)", &NoFiles).expect_err("an error");
    assert_eq!(failed.diagnostics[0].message, "division by 0");
}

#[test]
fn a_models_parameters_and_parts_are_in_scope() {
    let mut session = Session::new(Options::default());
    assert_eq!(value(&mut session, BEAKER), "");
    assert_eq!(session.model().map(|m| m.name().to_owned()).as_deref(), Some("beaker"));
    for (text, expected) in [
        ("r * 2", "80 mm"),
        ("radius(0)", "32 mm"),
        ("rim", "40 mm"),
        ("wall(0, 1)", "(40, 0, 90) mm"),
        ("foot[1](0.5, 0.25)", "(20, 10, 1) mm"),
        ("let area = r * h", "3600 mm^2"),
        ("fn half(x) = x / 2 + 0 * r", ""),
        ("half(h)", "45 mm"),
    ] {
        assert_eq!(value(&mut session, text), expected, "{text}");
    }
    session.set("r", "4cm + 10mm", &NoFiles).expect("within its bounds");
    assert_eq!(value(&mut session, "r; area"), "4500 mm^2", "what depends on a parameter follows it");
    session.set("lean", "pi / 4", &NoFiles).expect("no bounds");
    assert_eq!(value(&mut session, "lean"), "45 deg");
    for (name, text, code) in [
        ("r", "200mm", Code::OutOfBounds),
        ("r", "3", Code::DimensionMismatch),
        ("q", "3mm", Code::UnknownName),
        ("h", "40mm", Code::Require),
        ("h", "nothing", Code::UnknownName),
    ] {
        let failed = session.set(name, text, &NoFiles).expect_err("refused");
        assert_eq!(failed.diagnostics[0].code, code);
        assert_eq!(value(&mut session, "r"), "50 mm");
    }
    // A new meaning for a parameter's name, for what comes later.
    assert_eq!(value(&mut session, "r\nlet r = 1deg\nr; area"), "4500 mm^2");
    assert_eq!(value(&mut session, "r"), "1 deg");
    assert_eq!(value(&mut session, "wall(0, 1)"), "(50, 0, 90) mm");
    // The lines of one text in order.
    let answers = session.enter("let h2 = h\nh\nlet h = 3\nh", &NoFiles).expect("well-formed");
    let shown: Vec<String> = answers.iter().filter_map(|a| a.value.as_ref().map(ToString::to_string)).collect();
    assert_eq!(shown, ["90 mm", "90 mm", "3", "3"]);
}

#[test]
fn another_model_takes_the_place_of_the_first() {
    let mut session = Session::new(Options::default());
    value(&mut session, BEAKER);
    value(&mut session, "let d = 2 * r");
    value(
        &mut session,
        "model disk { input n: int in 1..9 = 3; param q: length = 5mm; part p = |u, v| (q * u, q * v, n * 0mm) }",
    );
    assert_eq!(value(&mut session, "q * n"), "15 mm");
    assert_eq!(error(&mut session, "r"), Code::UnknownName);
    assert_eq!(error(&mut session, "d"), Code::UnknownName);
    session.set("n", "7", &NoFiles).expect("an input");
    assert_eq!(value(&mut session, "q * n"), "35 mm");
    assert_eq!(session.set("n", "70", &NoFiles).err().map(|e| e.diagnostics[0].code), Some(Code::OutOfBounds));
    assert_eq!(value(&mut session, "q * n"), "35 mm");
    // Expressions before a model see what was there before it.
    let answers = session.enter(&format!("q\n{BEAKER}\nr"), &NoFiles).expect("well-formed");
    let shown: Vec<String> = answers.iter().filter_map(|a| a.value.as_ref().map(ToString::to_string)).collect();
    assert_eq!(shown, ["5 mm", "40 mm"]);
    let options = crate::program::Options::default();
    assert_eq!(session.compile(&options).expect("compiles").program.parts().len(), 3);
}

#[test]
fn gradients_agree_with_finite_differences() {
    let mut session = Session::new(Options::default());
    value(&mut session, BEAKER);
    for text in ["wall(0.3, 0.6)", "sqrt(r * h) * cos(lean)", "{a: r ^ 2, b: [h, lean * h]}"] {
        let gradient = session.gradient(text, &NoFiles).unwrap_or_else(|e| panic!("{text}: {e}"));
        let x = session.model().expect("a model").values().to_vec();
        for (i, slope) in gradient.slopes.iter().enumerate() {
            let step = 1e-4 * x[i].abs().max(1.0);
            let at = |session: &mut Session, sign: f64| {
                let mut moved = x.clone();
                moved[i] += sign * step;
                session.set_all(&moved).expect("allowed");
                let mut flat = Vec::new();
                flatten(
                    &session.enter(text, &NoFiles).expect("a value")[0].value.as_ref().expect("a value").data,
                    &mut flat,
                );
                flat
            };
            let (high, low) = (at(&mut session, 1.0), at(&mut session, -1.0));
            for ((a, b), exact) in high.iter().zip(&low).zip(&slope.values) {
                let difference = (a - b) / (2.0 * step);
                // Central differences of smooth functions: the error is of the order of step^2.
                assert!(
                    (difference - exact).abs() <= 1e-6 * (1.0 + exact.abs()),
                    "{text} by {}: {exact} {difference}",
                    slope.parameter
                );
            }
        }
        session.set_all(&x).expect("allowed");
    }
    let gradient = session.gradient("r * sin(lean)", &NoFiles).expect("well-formed");
    let shown: Vec<Vec<String>> = gradient.slopes.iter().map(Slope::shown).collect();
    assert_eq!(shown, [["0.5"], ["0 "], ["0 mm"], ["34.641 mm/rad"]].map(|[s]| vec![s.trim().to_owned()]));
    assert_eq!(session.gradient("floor(r / 1mm)", &NoFiles).err().map(|e| e.diagnostics.len()), Some(1));
    assert_eq!(session.gradient("wall", &NoFiles).err().map(|e| e.diagnostics[0].code), Some(Code::NoDerivative));
}

fn flatten(data: &Data, out: &mut Vec<f64>) {
    match data {
        Data::Number { value, .. } => out.push(*value),
        Data::Tuple(parts) | Data::Array(parts) => parts.iter().for_each(|p| flatten(p, out)),
        Data::Record(fields) => fields.iter().for_each(|(_, p)| flatten(p, out)),
        other => panic!("{other:?} is no number"),
    }
}

#[test]
fn types_stages_and_names_can_be_asked_for() {
    let mut session = Session::new(Options::default());
    value(&mut session, BEAKER);
    let ty = session.type_of("r * h", &NoFiles).expect("well-formed");
    assert_eq!(ty, ("an area".to_owned(), "area".to_owned()));
    assert_eq!(session.type_of("wall", &NoFiles).expect("well-formed").1, "surface (u: real, v: real) -> point3");
    assert!(session.type_of("let a = 1", &NoFiles).is_err());
    for stage in [crate::program::EmitStage::Ir, crate::program::EmitStage::Clif, crate::program::EmitStage::Asm] {
        let text = session.emit("r * h", stage, &NoFiles).expect("well-formed");
        assert!(text.contains("mul") || text.contains("vmul"), "{text}");
    }
    assert!(session.derivative_text("r * h", &NoFiles).expect("well-formed").contains('h'));
    session.native("r * h", crate::jit::Limits::default(), &NoFiles).expect("well-formed").run().expect("ends");
    assert_eq!(session.fields("wall(0, 0)", &NoFiles), ["x", "y", "z"]);
    assert_eq!(session.fields("{a: 1, bc: 2}", &NoFiles), ["a", "bc"]);
    let names = session.names();
    assert_eq!((names["r"], names["wall"], names["sin"]), (Kind::Parameter, Kind::Part, Kind::Library));
    let known = session.known("revolve").expect("in the library");
    assert!(known.declaration.starts_with("fn revolve(") && !known.doc.is_empty(), "{known:?}");
    assert_eq!(session.known("radius").expect("of the model").declaration, "fn radius(t: real) -> length");
}

#[test]
fn evaluation_is_bounded_and_can_be_interrupted() {
    let mut session = Session::new(Options::default());
    session.options.limits.steps = 1000;
    let long = "fold(0.0, 0..1000000, |a, i| a + sin(1deg * i))";
    assert_eq!(error(&mut session, long), Code::Limit);
    session.options.limits.steps = u64::MAX;
    let flag = session.options.interrupt.clone();
    let endless = "fold(0.0, 0..1000000000000, |a, i| a + sin(1deg * i))";
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(std::time::Duration::from_millis(100));
            flag.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        assert_eq!(error(&mut session, endless), Code::Interrupted);
    });
    flag.store(false, std::sync::atomic::Ordering::Relaxed);
    assert_eq!(value(&mut session, "1 + 1"), "2");
}

/// What cannot end within the limits is not begun.
#[test]
fn limits_are_known_before_the_work() {
    let mut session = Session::new(Options::default());
    let begun = std::time::Instant::now();
    for text in [
        "fold(0, 0..3000000000, |a, i| a + i)",
        "fold(0, 0..100000, |a, i| fold(a, 0..100000, |b, j| b + j))",
        "fold(0, -9000000000000000000..9000000000000000000, |a, i| a + 1)",
        "fn f(n: int) -> real = fold(0.0, 0..1000000, |a, i| a + sin(1deg * i)); fold(0.0, 0..1000000, |a, i| a + f(i))",
    ] {
        assert_eq!(error(&mut session, text), Code::Limit, "{text}");
    }
    // To run up to the limit takes seconds, each time.
    assert!(begun.elapsed() < std::time::Duration::from_secs(1), "{:?}", begun.elapsed());
}

#[test]
fn whole_numbers_at_their_ends() {
    let mut session = Session::new(Options::default());
    for (text, expected) in [
        ("(-1) ^ 9223372036854775807", "-1"),
        ("(-1) ^ 9223372036854775806", "1"),
        ("(-1.0) ^ 9223372036854775807", "-1"),
        ("1 ^ 9223372036854775807", "1"),
        ("0 ^ 9223372036854775807", "0"),
        ("(|n: int| (-1) ^ n)(floor(stop(9.007199254740993e15)))", "1"),
        ("(|x: real, n: int| x ^ n)(-2, 3)", "-8"),
        ("(|x: real| x ^ floor(stop(1.0)))'(0)", "1"),
        ("len(9000000000000000000..-9000000000000000000)", "0"),
        ("fold(7, 9000000000000000000..-9000000000000000000, |a, i| a + i)", "7"),
        ("fold(0, 9223372036854775800..9223372036854775807, |a, i| a + i % 10)", "21"),
        ("sum([9223372036854775806, 2, -1]) - 1", ""),
    ] {
        if expected.is_empty() {
            assert_eq!(error(&mut session, text), Code::RunTime, "{text}");
        } else {
            assert_eq!(value(&mut session, text), expected, "{text}");
        }
    }
    for (text, code) in [
        ("2 ^ 9223372036854775807", Code::IntArithmetic),
        ("(-2) ^ 64", Code::IntArithmetic),
        ("len(-9000000000000000000..9000000000000000000)", Code::IntArithmetic),
        ("sum([9223372036854775807, 2, 3])", Code::RunTime),
        ("sum(-9000000000000000000..9000000000000000000)", Code::TooLarge),
        ("int(sign(0 / 0.0))", Code::RunTime),
        ("(|n: int| fold(0, (-n)..n, |a, i| a + 1))(floor(stop(9e18)))", Code::RunTime),
    ] {
        assert_eq!(error(&mut session, text), code, "{text}");
    }
}

/// The number of a text names no other one, whether it had errors or not.
#[test]
fn places_name_the_text_and_its_line() {
    let mut session = Session::new(Options::default());
    let mut place = |text: &str| match session.enter(text, &NoFiles) {
        Ok(_) => String::new(),
        Err(failed) => failed.sources.place(failed.diagnostics[0].span).unwrap_or_default(),
    };
    assert_eq!(place("nothing"), "input 1:1:1");
    assert_eq!(place("let a =\n  1 +\n  nothing"), "input 2:3:3");
    assert_eq!(place("fn f(x: real) -> real {\n  floor(1 / x)\n}"), "");
    assert_eq!(place("let b = 2\n\nf(0)"), "input 3:2:3", "the place is in the function's text");
    assert_eq!(place("nothing"), "input 5:1:1");
    session.fields("nothing.", &NoFiles);
    assert_eq!(session.type_of("1", &NoFiles).map(|t| t.1).ok().as_deref(), Some("int"));
    let failed = session.enter("nothing", &NoFiles).expect_err("an error");
    assert_eq!(failed.sources.place(failed.diagnostics[0].span).as_deref(), Some("input 6:1:1"));
}

/// Files in memory.
struct Files(std::cell::RefCell<BTreeMap<String, String>>);

impl Loader for Files {
    fn load(&self, path: &str, _from: &str) -> Result<SourceFile, String> {
        let text = self.0.borrow().get(path).cloned().ok_or_else(|| format!("{path}: there is no such file"))?;
        Ok(SourceFile { name: path.to_owned(), text })
    }
}

#[test]
fn files_are_used_loaded_and_read_again() {
    let files = Files(std::cell::RefCell::default());
    let write = |name: &str, text: &str| files.0.borrow_mut().insert(name.to_owned(), text.to_owned());
    write("lib.gml", "fn f(x) = x + 1");
    write(
        "m.gml",
        "use \"lib.gml\" (f)\nlet k = 2\nmodel m { param a: length in 1mm..9mm = 3mm; param b: real = f(1); part p = |u, v| (a * u, a * v, k * a) }",
    );
    let mut session = Session::new(Options::default());
    session.load(files.load("m.gml", "").expect("written"), &files).expect("well-formed");
    let now = |s: &mut Session, text: &str| {
        let answers = s.enter(text, &files).unwrap_or_else(|e| panic!("{text}: {e}"));
        answers.last().and_then(|a| a.value.as_ref()).map_or_else(String::new, ToString::to_string)
    };
    assert_eq!(now(&mut session, "f(a / 1mm); k; b"), "2");
    assert_eq!(now(&mut session, "let w = a * k"), "6 mm");
    assert_eq!(now(&mut session, "let z = b"), "2");
    session.set("a", "4mm", &files).expect("allowed");
    assert_eq!(session.files(), ["m.gml", "lib.gml"]);
    write("lib.gml", "fn f(x) = x + 10");
    write(
        "m.gml",
        "use \"lib.gml\" (f)\nlet k = 5\nmodel m { param a: length in 1mm..9mm = 3mm; part p = |u, v| (a * u, a * v, f(k) * a) }",
    );
    session.reload(&files).expect("well-formed");
    assert_eq!(now(&mut session, "w"), "20 mm", "a keeps its value, k is new");
    assert_eq!(session.warnings().len(), 0, "warnings are of what was entered last");
    write("m.gml", "model m {");
    assert!(session.reload(&files).is_err());
    assert_eq!(now(&mut session, "w"), "20 mm");
}
