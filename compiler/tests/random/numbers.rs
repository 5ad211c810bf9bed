//! Random expressions of whole numbers near their ends, and of reals among which are infinities and NaN: the constants
//! of the checker, the interpreter of sessions, that of lowered functions, and native code for the parameters and for
//! points agree on the value that the rules of the language give, or fail where these give none.
//!
//! What is cancelled may take an error with it: `0 * x` and `x - x` are 0 whatever x is. So where the rules give no
//! value, evaluators may have one if there is anything to cancel. The reals have no such operations.

use crate::ways::{Failed, ways};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Number of expressions by default, and of values that each is computed of.
const EXPRESSIONS: u32 = 150;

/// An expression: its text, and its value for a and b.
#[derive(Clone, Debug)]
enum Int {
    Of(Real),
    Literal(i64),
    Round(&'static str, Real),
    Unary(&'static str, Box<Int>),
    Binary(&'static str, Box<Int>, Box<Int>),
    Sum(Vec<Int>),
    Fold(&'static str, Box<Int>, Box<Int>, i64),
    If(Box<Bool>, Box<Int>, Box<Int>),
}

#[derive(Clone, Debug)]
enum Real {
    A,
    B,
    Literal(f64),
    Unary(&'static str, Box<Real>),
    Extreme(&'static str, Box<Real>, Box<Real>),
    Sign(Box<Int>),
    If(Box<Bool>, Box<Real>, Box<Real>),
}

#[derive(Clone, Debug)]
enum Bool {
    Reals(&'static str, Real, Real),
    Ints(&'static str, Int, Int),
    Not(Box<Bool>),
    Both(&'static str, Box<Bool>, Box<Bool>),
}

fn holds<T: PartialOrd>(op: &str, a: T, b: T) -> bool {
    match op {
        "==" => a == b,
        "!=" => a != b,
        "<" => a < b,
        "<=" => a <= b,
        ">" => a > b,
        _ => a >= b,
    }
}

/// Of two whole numbers.
fn of_two(op: &str, a: i64, b: i64) -> Option<i64> {
    match op {
        "+" => a.checked_add(b),
        "-" => a.checked_sub(b),
        "*" => a.checked_mul(b),
        "%" => {
            let r = a.checked_rem(b).or((b == -1).then_some(0))?;
            Some(if r != 0 && (r < 0) != (b < 0) { r + b } else { r })
        }
        "min" => Some(a.min(b)),
        _ => Some(a.max(b)),
    }
}

fn whole(x: f64) -> Option<i64> {
    (x >= -(2f64.powi(63)) && x < 2f64.powi(63)).then_some(x as i64)
}

impl Int {
    fn text(&self) -> String {
        match self {
            Int::Of(x) => format!("int({})", x.text()),
            Int::Literal(i) if *i < 0 => format!("({} - 1)", i + 1),
            Int::Literal(i) => i.to_string(),
            Int::Round(how, x) => format!("{how}({})", x.text()),
            Int::Unary(op, x) => format!("({op}({}))", x.text()),
            Int::Binary(op @ ("min" | "max"), x, y) => format!("{op}({}, {})", x.text(), y.text()),
            Int::Binary(op, x, y) => format!("({} {op} {})", x.text(), y.text()),
            Int::Sum(xs) => format!("sum([{}])", xs.iter().map(Int::text).collect::<Vec<_>>().join(", ")),
            Int::Fold(op, x, y, n) => format!("fold({}, 0..{n}, |s, i| s {op} {})", x.text(), y.text()),
            Int::If(c, x, y) => format!("(if {} {{ {} }} else {{ {} }})", c.text(), x.text(), y.text()),
        }
    }

    fn value(&self, a: f64, b: f64) -> Option<i64> {
        match self {
            Int::Of(x) => whole(x.value(a, b)?),
            Int::Literal(i) => Some(*i),
            Int::Round(how, x) => whole(match *how {
                "floor" => x.value(a, b)?.floor(),
                "ceil" => x.value(a, b)?.ceil(),
                _ => x.value(a, b)?.round(),
            }),
            Int::Unary("-", x) => x.value(a, b)?.checked_neg(),
            Int::Unary(_, x) => x.value(a, b)?.checked_abs(),
            Int::Binary(op, x, y) => of_two(op, x.value(a, b)?, y.value(a, b)?),
            Int::Sum(xs) => {
                let values: Vec<i64> = xs.iter().map(|x| x.value(a, b)).collect::<Option<_>>()?;
                values[1..].iter().try_fold(values[0], |sum, x| sum.checked_add(*x))
            }
            Int::Fold(op, x, y, n) => {
                let (first, other) = (x.value(a, b)?, y.value(a, b)?);
                (0..*n).try_fold(first, |s, _| of_two(op, s, other))
            }
            Int::If(c, x, y) => if c.value(a, b)? { x } else { y }.value(a, b),
        }
    }
}

impl Real {
    fn text(&self) -> String {
        match self {
            Real::A => "(a)".to_owned(),
            Real::B => "(b)".to_owned(),
            Real::Literal(x) => crate::ways::literal(*x),
            Real::Unary(op, x) => format!("{op}({})", x.text()),
            Real::Extreme(op, x, y) => format!("{op}({}, {})", x.text(), y.text()),
            Real::Sign(n) => format!("((-1.0) ^ {})", n.text()),
            Real::If(c, x, y) => format!("(if {} {{ {} }} else {{ {} }})", c.text(), x.text(), y.text()),
        }
    }

    fn value(&self, a: f64, b: f64) -> Option<f64> {
        Some(match self {
            Real::A => a,
            Real::B => b,
            Real::Literal(x) => *x,
            Real::Unary(op, x) => {
                let x = x.value(a, b)?;
                match *op {
                    "-" => -x,
                    "abs" => x.abs(),
                    "sqrt" => x.sqrt(),
                    _ if x > 0.0 => 1.0,
                    _ if x < 0.0 => -1.0,
                    _ => x,
                }
            }
            Real::Extreme(op, x, y) => {
                let (x, y) = (x.value(a, b)?, y.value(a, b)?);
                match *op {
                    _ if x.is_nan() || y.is_nan() => f64::NAN,
                    "min" => x.min(y),
                    _ => x.max(y),
                }
            }
            Real::Sign(n) => 1.0 - 2.0 * (n.value(a, b)? % 2).abs() as f64,
            Real::If(c, x, y) => if c.value(a, b)? { x } else { y }.value(a, b)?,
        })
    }
}

impl Bool {
    fn text(&self) -> String {
        match self {
            Bool::Reals(op, x, y) => format!("({} {op} {})", x.text(), y.text()),
            Bool::Ints(op, x, y) => format!("({} {op} {})", x.text(), y.text()),
            Bool::Not(x) => format!("(not {})", x.text()),
            Bool::Both(op, x, y) => format!("({} {op} {})", x.text(), y.text()),
        }
    }

    fn value(&self, a: f64, b: f64) -> Option<bool> {
        Some(match self {
            Bool::Reals(op, x, y) => holds(op, x.value(a, b)?, y.value(a, b)?),
            Bool::Ints(op, x, y) => holds(op, x.value(a, b)?, y.value(a, b)?),
            Bool::Not(x) => !x.value(a, b)?,
            Bool::Both(op, x, y) => {
                let decides = *op == "or";
                let first = x.value(a, b)?;
                if first == decides { decides } else { y.value(a, b)? }
            }
        })
    }
}

/// A part of an expression.
#[derive(Clone, Copy)]
enum Part<'e> {
    Int(&'e Int),
    Real(&'e Real),
    Bool(&'e Bool),
}

impl<'e> Part<'e> {
    fn inner(self) -> Vec<Part<'e>> {
        use Part::{Bool as B, Int as I, Real as R};
        match self {
            I(Int::Literal(_)) | R(Real::A | Real::B | Real::Literal(_)) => Vec::new(),
            I(Int::Of(x) | Int::Round(_, x)) => vec![R(x)],
            I(Int::Unary(_, x)) | R(Real::Sign(x)) => vec![I(x)],
            I(Int::Binary(_, x, y) | Int::Fold(_, x, y, _)) => vec![I(x), I(y)],
            I(Int::Sum(xs)) => xs.iter().map(I).collect(),
            I(Int::If(c, x, y)) => vec![B(c), I(x), I(y)],
            R(Real::Unary(_, x)) => vec![R(x)],
            R(Real::Extreme(_, x, y)) => vec![R(x), R(y)],
            R(Real::If(c, x, y)) => vec![B(c), R(x), R(y)],
            B(Bool::Reals(_, x, y)) => vec![R(x), R(y)],
            B(Bool::Ints(_, x, y)) => vec![I(x), I(y)],
            B(Bool::Not(x)) => vec![B(x)],
            B(Bool::Both(_, x, y)) => vec![B(x), B(y)],
        }
    }

    /// Whether some part of it has no value: it need not be needed, but the compiler reports what it knows to be wrong.
    /// `known` are a and b, where it knows these.
    fn has_error(self, known: Option<(f64, f64)>) -> bool {
        let text = match self {
            Part::Int(x) => x.text(),
            Part::Real(x) => x.text(),
            Part::Bool(x) => x.text(),
        };
        let closed = !text.contains("(a)") && !text.contains("(b)");
        let values = known.or(closed.then_some((0.0, 0.0)));
        let fails = values.is_some_and(|(a, b)| match self {
            Part::Int(x) => x.value(a, b).is_none(),
            Part::Real(x) => x.value(a, b).is_none(),
            Part::Bool(x) => x.value(a, b).is_none(),
        });
        fails || self.inner().into_iter().any(|part| part.has_error(known))
    }
}

/// Expressions of a type, up to a depth.
fn reals(depth: u32) -> BoxedStrategy<Real> {
    let literals = prop::sample::select(vec![0.0, -2.5, 1.0, f64::INFINITY, f64::NAN]);
    let leaf = prop_oneof![3 => Just(Real::A), 3 => Just(Real::B), 1 => literals.prop_map(Real::Literal)];
    let Some(d) = depth.checked_sub(1) else { return leaf.boxed() };
    let one = prop::sample::select(vec!["-", "abs", "sqrt", "sign"]);
    let two = prop::sample::select(vec!["min", "max"]);
    prop_oneof![
        2 => leaf,
        3 => (one, reals(d)).prop_map(|(op, x)| Real::Unary(op, x.into())),
        2 => (two, reals(d), reals(d)).prop_map(|(op, x, y)| Real::Extreme(op, x.into(), y.into())),
        1 => ints(d).prop_map(|n| Real::Sign(n.into())),
        1 => (bools(d), reals(d), reals(d)).prop_map(|(c, x, y)| Real::If(c.into(), x.into(), y.into())),
    ]
    .boxed()
}

fn ints(depth: u32) -> BoxedStrategy<Int> {
    let end = i64::MAX;
    let literals = prop::sample::select(vec![0, 1, 3, -2, end, end - 1, end / 2, end / 2 + 1, -end, i64::MIN]);
    let leaf = prop_oneof![literals.prop_map(Int::Literal), reals(0).prop_map(Int::Of)];
    let Some(d) = depth.checked_sub(1) else { return leaf.boxed() };
    let one = prop::sample::select(vec!["-", "abs"]);
    let two = prop::sample::select(vec!["+", "-", "*", "%", "min", "max", "+"]);
    let step = prop::sample::select(vec!["+", "-", "*"]);
    let how = prop::sample::select(vec!["floor", "ceil", "round"]);
    // Short ones are unrolled, long ones are loops.
    let turns = prop::sample::select(vec![0_i64, 1, 3, 90]);
    prop_oneof![
        1 => leaf,
        1 => reals(d).prop_map(Int::Of),
        1 => (how, reals(d)).prop_map(|(how, x)| Int::Round(how, x)),
        2 => (one, ints(d)).prop_map(|(op, x)| Int::Unary(op, x.into())),
        6 => (two, ints(d), ints(d)).prop_map(|(op, x, y)| Int::Binary(op, x.into(), y.into())),
        2 => prop::collection::vec(ints(d), 1..5).prop_map(Int::Sum),
        2 => (step, ints(d), ints(d), turns).prop_map(|(op, x, y, n)| Int::Fold(op, x.into(), y.into(), n)),
        1 => (bools(d), ints(d), ints(d)).prop_map(|(c, x, y)| Int::If(c.into(), x.into(), y.into())),
    ]
    .boxed()
}

fn bools(depth: u32) -> BoxedStrategy<Bool> {
    let op = || prop::sample::select(vec!["==", "!=", "<", "<=", ">", ">="]);
    let d = depth.saturating_sub(1);
    let leaf = prop_oneof![
        2 => (op(), reals(d), reals(d)).prop_map(|(op, x, y)| Bool::Reals(op, x, y)),
        // Of one value, of which NaN alone is unequal to itself.
        2 => (op(), reals(d)).prop_map(|(op, x)| Bool::Reals(op, x.clone(), x)),
        1 => (op(), ints(d), ints(d)).prop_map(|(op, x, y)| Bool::Ints(op, x, y)),
    ];
    if depth == 0 {
        return leaf.boxed();
    }
    let both = prop::sample::select(vec!["and", "or"]);
    prop_oneof![
        4 => leaf,
        1 => bools(d).prop_map(|x| Bool::Not(x.into())),
        1 => (both, bools(d), bools(d)).prop_map(|(op, x, y)| Bool::Both(op, x.into(), y.into())),
    ]
    .boxed()
}

/// Checks an expression for values of a and b.
fn check(expression: &Int, values: &[(f64, f64)]) {
    let text = expression.text();
    // Comparisons of one value and selections between equals are decided without it.
    let cancels = [" - ", " * ", " % ", "==", "!=", "<", ">", "fold", "if"].iter().any(|op| text.contains(op));
    for (way, found, k) in ways(&text, values) {
        let (a, b) = values[k];
        let expected = expression.value(a, b);
        match (&found, expected) {
            (Ok(found), Some(expected)) => {
                assert_eq!(*found, expected as f64, "{way}: {text} for a = {a:e}, b = {b:e}");
            }
            (Err(Failed { .. }), None) => {}
            (Ok(_), None) if cancels => {}
            (Err(Failed { known: true, .. }), _) if Part::Int(expression).has_error(Some((a, b))) => {}
            (Err(Failed { .. }), _) if Part::Int(expression).has_error(None) => {}
            _ => panic!("{way}: {text} for a = {a:e}, b = {b:e} is {found:?}, not {expected:?}"),
        }
    }
}

#[test]
fn evaluators_agree_on_whole_numbers_and_nan() {
    let mut seed = [3; 32];
    seed[..8].copy_from_slice(&crate::setting("GMLC_RANDOM_SEED").unwrap_or(1).to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    // Some hundred a second.
    let cases = crate::setting("GMLC_RANDOM_SECONDS").map_or(EXPRESSIONS, |s| s as u32 * 50);
    let config = Config { failure_persistence: None, cases, max_shrink_time: 60_000, ..Config::default() };
    let values =
        [(f64::NAN, -1.0), (f64::INFINITY, f64::NAN), (2f64.powi(62), -3.5), (-(2f64.powi(63)), 2.0), (3.0, 4.0)];
    let result = TestRunner::new_with_rng(config, rng).run(&ints(3), |expression| {
        check(&expression, &values);
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
}
