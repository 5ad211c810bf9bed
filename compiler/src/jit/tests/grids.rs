//! Grids: two columns at once and one after the other give the same bits, and those of single calls.

use super::*;
use crate::diff;
use crate::ir::hoist::grid::{GridSplit, split_grid};
use crate::ir::{Binary, Compare, Failure, Unary, arithmetic, interpret};
use crate::jit::{GridShape, GridTables};

/// (a, b, u, v) -> results with everything that there are instructions for.
fn plain() -> (Module, FunctionId) {
    let mut module = Module::default();
    let failure = module.fail(Failure { span: Span::default(), message: "u is too large".to_owned() });
    let mut raw = Raw::new(&[Type::Real; 4]);
    let [a, b, u, v] = [0, 1, 2, 3].map(Value);
    let sin = raw.real(Op::Unary(Unary::Sin, u));
    let exp = raw.real(Op::Unary(Unary::Exp, v));
    let product = raw.real(Op::Binary(Binary::Mul, sin, exp));
    let quotient = raw.real(Op::Binary(Binary::Div, product, a));
    let sum = raw.real(Op::Binary(Binary::Add, quotient, b));
    let difference = raw.real(Op::Binary(Binary::Sub, u, v));
    let sign = raw.real(Op::Unary(Unary::Sign, difference));
    let abs = raw.real(Op::Unary(Unary::Abs, difference));
    let root = raw.real(Op::Unary(Unary::Sqrt, abs));
    let cube = raw.real(Op::PowInt(sum, -3));
    let less = raw.node(Op::Compare(Compare::Lt, u, v), Type::Bool);
    let not = raw.node(Op::Unary(Unary::Not, less), Type::Bool);
    let of_row = raw.node(Op::Compare(Compare::Gt, v, a), Type::Bool);
    let either = raw.node(Op::Binary(Binary::Or, not, of_row), Type::Bool);
    let selected = raw.real(Op::Select(either, root, cube));
    let least = raw.real(Op::Binary(Binary::Min, selected, sum));
    let zero = raw.real(Op::Unary(Unary::Floor, sign));
    let masked = raw.real(Op::Binary(Binary::MulOrZero, zero, cube));
    let divided = raw.real(Op::Binary(Binary::DivOrZero, sign, root));
    let limit = raw.constant(1e6);
    let holds = raw.node(Op::Compare(Compare::Lt, abs, limit), Type::Bool);
    let guarded = raw.real(Op::Guard { value: least, condition: holds, failure });
    let negative = raw.real(Op::Unary(Unary::Neg, guarded));
    let id = module.add(raw.returns(&[negative, masked, divided]));
    (module, id)
}

const U: [f64; 6] = [0.1, 0.5, 0.5, 0.9, 1.3, -2.0];
const V: [f64; 3] = [0.5, 1.1, -0.4];
const UNIFORMS: [f64; 2] = [0.7, 0.3];

/// Runs the stages of a function over the grid above; `row_sums` as in the shape.
fn run(
    module: &Module,
    stages: GridSplit,
    function: FunctionId,
    row_sums: Option<usize>,
    options: Options,
) -> (bool, Vec<f64>, Vec<f64>) {
    let mut compiler = Compiler::new(module, options).unwrap();
    let stored = |function| KernelShape { function, uniforms: 2, weights: 0, output: Output::Store };
    let rows = compiler.kernel(stored(stages.rows)).unwrap();
    let columns = compiler.kernel(stored(stages.columns)).unwrap();
    let (row_values, column_values) = (stages.row_values, stages.column_values);
    let inner = compiler.grid(GridShape { function, uniforms: 2, row_values, column_values, row_sums }).unwrap();
    let code = compiler.finish().unwrap();
    let table = |kernel, n: usize, at: &[f64]| {
        let mut out = vec![0.0; n * at.len()];
        code.run(kernel, &UNIFORMS, Points { u: at, v: at, w: &[] }, &mut out, Limits::default()).unwrap();
        out
    };
    let (rows, mut columns) = (table(rows, row_values, &V), table(columns, column_values, &U));
    let wide = code.is_wide(inner);
    if wide {
        let both = |two: &[f64]| (0..column_values).flat_map(|k| [two[k], two[column_values + k]]).collect::<Vec<_>>();
        columns = columns.chunks_exact(2 * column_values).flat_map(both).collect();
    }
    let w: Vec<[f64; 3]> = (0..18).map(|i| [0.3, -1.7, 0.9].map(|k| (k * f64::from(i)).sin())).collect();
    let results = module.function(function).results.len();
    let (out, sums) = row_sums.map_or((18 * results, 0), |n| (3 * n, 6 * (results - n)));
    let (mut out, mut sums) = (vec![0.0; out], vec![0.0; sums]);
    let w = if row_sums.is_some() { &w[..] } else { &[] };
    let tables = GridTables { row_count: 3, rows: &rows, column_count: 6, columns: &columns, w };
    code.run_grid(inner, &UNIFORMS, tables, &mut out, &mut sums, Limits::default()).unwrap();
    if wide && !sums.is_empty() {
        let n = results - row_sums.unwrap();
        let lanes = |pair: &[f64]| [0, 1].map(|lane| (0..n).map(|k| pair[2 * k + lane]).collect::<Vec<_>>()).concat();
        sums = sums.chunks_exact(2 * n).flat_map(lanes).collect();
    }
    (wide, out, sums)
}

#[test]
fn two_at_once_are_the_same_as_one() {
    let (mut module, id) = plain();
    let stages = split_grid(&mut module, id, 2);
    let (wide, pairs, _) = run(&module, stages, stages.inner, None, OPTIONS);
    let (narrow, single, _) = run(&module, stages, stages.inner, None, Options { narrow: true, ..OPTIONS });
    assert!(wide && !narrow);
    let native = Native::new(&module, id);
    for (i, point) in pairs.chunks_exact(3).enumerate() {
        let arguments = [UNIFORMS[0], UNIFORMS[1], U[i % 6], V[i / 6]];
        let expected = native.code.call_reals(native.routine, &arguments, Limits::default()).unwrap();
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(point), bits(&expected), "at {arguments:?}");
        assert_eq!(bits(&single[3 * i..3 * i + 3]), bits(&expected), "at {arguments:?}");
    }
}

#[test]
fn sums_do_not_depend_on_the_width() {
    let (mut module, id) = plain();
    let stages = split_grid(&mut module, id, 2);
    let wrt: Vec<u32> = (0..(2 + stages.row_values + stages.column_values) as u32).collect();
    let pullback = diff::pullback(&mut module, stages.inner, &wrt, false).unwrap();
    let row_sums = Some(2 + stages.row_values);
    let (wide, rows, columns) = run(&module, stages, pullback, row_sums, OPTIONS);
    let (narrow, rows_1, columns_1) = run(&module, stages, pullback, row_sums, Options { narrow: true, ..OPTIONS });
    assert!(wide && !narrow);
    assert!(rows.iter().chain(&columns).any(|x| *x != 0.0));
    // Where u is v the derivative of the root is not finite, in either case.
    let text = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>();
    assert_eq!([text(&rows), text(&columns)], [text(&rows_1), text(&columns_1)]);
}

/// Integers have no instructions for pairs: one point after the other.
#[test]
fn integers_are_narrow() {
    let mut module = Module::default();
    let mut raw = Raw::new(&[Type::Real; 4]);
    let product = raw.real(Op::Binary(Binary::Mul, Value(2), Value(3)));
    let whole = raw.node(Op::Unary(Unary::ToInt, product), Type::Int);
    let back = raw.real(Op::Unary(Unary::ToReal, whole));
    let sin = raw.real(Op::Unary(Unary::Sin, product));
    let sum = raw.real(Op::Binary(Binary::Add, back, sin));
    let id = module.add(raw.returns(&[sum]));
    let stages = split_grid(&mut module, id, 2);
    let (wide, out, _) = run(&module, stages, stages.inner, None, OPTIONS);
    assert!(!wide);
    let value = |x: f64| x.trunc() + arithmetic::unary(Unary::Sin, x).unwrap();
    assert_eq!(out, V.iter().flat_map(|v| U.map(|u| value(u * v))).collect::<Vec<f64>>());
}

/// Elementary functions of both u and v, with arguments that are in their range in one lane alone, or in none.
#[test]
fn elementary_functions_of_pairs() {
    use Binary::{Atan2, Mul, Pow, Rem};
    use Unary::{Acos, Asin, Atan, Cos, Cosh, Exp, Ln, Round, Sin, Sinh, Tan, Tanh};
    for scale in [1.0, 3.7, -900.0, 1e4, 1e300] {
        let mut module = Module::default();
        let mut raw = Raw::new(&[Type::Real; 4]);
        let [a, u, v] = [0, 2, 3].map(Value);
        let product = raw.real(Op::Binary(Mul, u, v));
        let scale = raw.constant(scale);
        let x = raw.real(Op::Binary(Mul, product, scale));
        let unary = [Sin, Cos, Exp, Ln, Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Round];
        let mut results: Vec<Value> = unary.iter().map(|op| raw.real(Op::Unary(*op, x))).collect();
        // A sine and a cosine that are alone, and powers of everything.
        results.push(raw.real(Op::Unary(Sin, product)));
        let sum = raw.real(Op::Binary(Binary::Add, x, a));
        results.push(raw.real(Op::Unary(Cos, sum)));
        results.extend([Atan2, Pow, Rem].map(|op| raw.real(Op::Binary(op, x, u))));
        results.push(raw.real(Op::Binary(Pow, u, x)));
        let count = results.len();
        let id = module.add(raw.returns(&results));
        let stages = split_grid(&mut module, id, 2);
        let (wide, pairs, _) = run(&module, stages, stages.inner, None, OPTIONS);
        let (_, single, _) = run(&module, stages, stages.inner, None, Options { narrow: true, ..OPTIONS });
        assert!(wide);
        // NaN is NaN, whatever its bits.
        let shown = |values: &[f64]| values.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>();
        assert_eq!(shown(&pairs), shown(&single));
        for (i, point) in pairs.chunks_exact(count).enumerate() {
            let arguments = [UNIFORMS[0], UNIFORMS[1], U[i % 6], V[i / 6]];
            let interpreted = interpret::run_real(&module, id, &arguments, interpret::Limits::default()).unwrap();
            assert_eq!(shown(point), shown(&interpreted), "at {arguments:?}");
        }
    }
}
