//! All ways to compute a whole number from two numbers a and b.

use crate::oracle::Oracle;
use gml_compiler::program::{Compilation, Options, Order, Program, Sites, compile};
use gml_compiler::session::{self, Session};
use gml_compiler::source::{NoFiles, SourceFile};

/// No value.
#[derive(Debug)]
pub(crate) struct Failed {
    #[expect(dead_code, reason = "it is for people")]
    message: String,
    /// Whether the values of a and b were known when the expression was compiled.
    pub(crate) known: bool,
}

impl Failed {
    fn at_run_time(message: String) -> Failed {
        Failed { message, known: false }
    }
}

/// How it was computed, the value, and of which of the pairs.
type Found = (&'static str, Result<f64, Failed>, usize);

/// A number as a script has it.
pub(crate) fn literal(x: f64) -> String {
    match x {
        x if x.is_nan() => "(0.0 / 0.0)".to_owned(),
        x if x.is_infinite() => format!("({}1.0 / 0.0)", if x < 0.0 { "-" } else { "" }),
        // Debug has a point in every number.
        x => format!("({x:?})"),
    }
}

/// The values of an expression of `(a)` and `(b)`, for each pair of these.
pub(crate) fn ways(expression: &str, values: &[(f64, f64)]) -> Vec<Found> {
    let with = |a: &str, b: &str| expression.replace("(a)", a).replace("(b)", b);
    let mut found = Vec::new();
    let stopped = |x: &str| format!("(stop({x}))");
    // The second is computed anew at every point.
    let varied = |x: &str| format!("(stop(if u < 2 {{ {x} }} else {{ v }}))");
    let of_parameters = Scripts::new(&with(&stopped("a"), &stopped("b")));
    let of_points = Scripts::new(&with(&varied("a"), &varied("b")));
    for (k, (a, b)) in values.iter().copied().enumerate() {
        for (interpreter, native, grid, scripts) in [
            ("interpreter", "native code", "native code on a grid", &of_parameters),
            ("interpreter, at points", "native code, at points", "native code at points of a grid", &of_points),
        ] {
            found.push((interpreter, scripts.interpreted(a, b), k));
            found.push((native, scripts.native(a, b, Sites::Scattered(&[0.25, 0.5, 0.75], &[0.5; 3])), k));
            found.push((grid, scripts.native(a, b, Sites::Grid(&[0.25, 0.5, 0.75], &[0.25, 0.5])), k));
        }
        found.push(("constants", entered(&with(&literal(a), &literal(b))), k));
        let called = format!("(|a: real, b: real| {expression})({}, {})", literal(a), literal(b));
        found.push(("a function in a session", entered(&called), k));
    }
    found
}

/// A text in a session.
fn entered(text: &str) -> Result<f64, Failed> {
    let answers = Session::new(session::Options::default()).enter(text, &NoFiles);
    let answers = answers.map_err(|e| Failed { message: e.to_string(), known: true })?;
    let shown = answers.last().and_then(|a| a.value.as_ref()).map(ToString::to_string).unwrap_or_default();
    shown.parse().map(|x: i64| x as f64).map_err(|_| Failed { message: shown, known: true })
}

/// An expression as the coordinate of a part.
struct Scripts(Result<(Oracle, Program), String>);

impl Scripts {
    fn new(expression: &str) -> Scripts {
        let params = "  param a: real = 1\n  param b: real = 1\n";
        let point = format!("(real({expression}) * 1mm, u * 1mm, v * 1mm)");
        let text = format!("model m {{\n{params}  part p = |u, v| {point}\n}}\n");
        let script = SourceFile { name: "numbers.gml".to_owned(), text: text.clone() };
        // An expression of literals that has no value is an error of the script.
        Scripts(match compile(script, &NoFiles, &Options::default()) {
            Ok(Compilation { program, .. }) => Oracle::new(&text).map(|oracle| (oracle, program)),
            Err(failed) => Err(failed.to_string()),
        })
    }

    fn parts(&self) -> Result<&(Oracle, Program), Failed> {
        self.0.as_ref().map_err(|e| Failed::at_run_time(e.clone()))
    }

    fn interpreted(&self, a: f64, b: f64) -> Result<f64, Failed> {
        self.parts()?.0.point(0, &[a, b], [0.5, 0.5]).map(|p| p[0]).map_err(Failed::at_run_time)
    }

    /// The value at all points, which must be one.
    fn native(&self, a: f64, b: f64, sites: Sites<'_>) -> Result<f64, Failed> {
        let instance = self.parts()?.1.instantiate(&[a, b]).map_err(|e| Failed::at_run_time(e.message))?;
        let mut points = vec![0.0; 3 * sites.count()];
        instance.evaluate(0, sites, Order::Points, &mut points).map_err(|e| Failed::at_run_time(e.message))?;
        assert!(points.chunks(3).all(|p| p[0] == points[0]), "it is the same at all points: {points:?}");
        Ok(points[0])
    }
}
