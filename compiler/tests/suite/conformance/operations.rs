//! Every operation at special values.

use super::{Case, Evaluator, Fault, Interpreter, Native, Outcome, conforms, same};
use gml_compiler::internals::ir::scalar::Scalar::{self, Bool, Int, Real};
use gml_compiler::internals::ir::{
    Binary, Compare, Failure, FailureId, Function, FunctionId, Module, Node, Op, Parameter, Type, Unary, Value,
};
use gml_compiler::source::Span;

const REALS: [f64; 22] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    1.5,
    2.5,
    -2.5,
    3.0,
    -7.25,
    1e-308,
    5e-324,
    1e308,
    -1e308,
    4_503_599_627_370_497.5,
    9.3e18,
    -9.3e18,
    std::f64::consts::FRAC_PI_2,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];

const INTS: [i64; 10] = [0, 1, -1, 2, 3, -3, 7, i64::MAX, i64::MIN, 1 << 53];

const UNARY: [Unary; 19] = [
    Unary::Neg,
    Unary::Abs,
    Unary::Sign,
    Unary::Sqrt,
    Unary::Exp,
    Unary::Ln,
    Unary::Sin,
    Unary::Cos,
    Unary::Tan,
    Unary::Asin,
    Unary::Acos,
    Unary::Atan,
    Unary::Sinh,
    Unary::Cosh,
    Unary::Tanh,
    Unary::Floor,
    Unary::Ceil,
    Unary::Round,
    Unary::Stop,
];

const COMPARES: [Compare; 6] = [Compare::Eq, Compare::Ne, Compare::Lt, Compare::Le, Compare::Gt, Compare::Ge];

/// A function that applies one operation to its parameters, without the simplifications of the builder.
fn function(params: &[Type], op: Op, ty: Type) -> Function {
    let span = Span::default();
    let mut nodes: Vec<Node> =
        params.iter().enumerate().map(|(i, ty)| Node { op: Op::Param(i as u32), ty: *ty, span }).collect();
    let name = format!("{op:?}");
    nodes.push(Node { op, ty, span });
    Function {
        name,
        params: params.iter().enumerate().map(|(i, ty)| Parameter::new(format!("p{i}"), *ty)).collect(),
        results: vec![Value(nodes.len() as u32 - 1)],
        result_names: vec!["r".to_owned()],
        nodes,
    }
}

/// One operation: the types of its operands, and of its result.
fn operations() -> Vec<(Vec<Type>, Op, Type)> {
    use Type::{Bool, Int, Real};
    let (a, b, c) = (Value(0), Value(1), Value(2));
    let mut all = Vec::new();
    all.extend(UNARY.map(|op| (vec![Real], Op::Unary(op, a), Real)));
    all.push((vec![Bool], Op::Unary(Unary::Not, a), Bool));
    all.push((vec![Int], Op::Unary(Unary::ToReal, a), Real));
    all.push((vec![Real], Op::Unary(Unary::ToInt, a), Int));
    {
        use Binary::{Add, Atan2, Div, DivOrZero, Max, Min, Mul, MulOrZero, Pow, Rem, Sub};
        let reals = [Add, Sub, Mul, Div, Rem, Pow, Atan2, Min, Max, MulOrZero, DivOrZero];
        all.extend(reals.map(|op| (vec![Real, Real], Op::Binary(op, a, b), Real)));
        let ints = [Add, Sub, Mul, Div, Rem, Min, Max];
        all.extend(ints.map(|op| (vec![Int, Int], Op::Binary(op, a, b), Int)));
    }
    all.extend([Binary::And, Binary::Or].map(|op| (vec![Bool, Bool], Op::Binary(op, a, b), Bool)));
    for n in [0, 1, -1, 2, 3, -3, 7, 64, 65, i32::MAX, i32::MIN] {
        all.push((vec![Real], Op::PowInt(a, n), Real));
    }
    for op in COMPARES {
        all.push((vec![Real, Real], Op::Compare(op, a, b), Bool));
        all.push((vec![Int, Int], Op::Compare(op, a, b), Bool));
    }
    all.push((vec![Bool, Real, Real], Op::Select(a, b, c), Real));
    all.push((vec![Bool, Int, Int], Op::Select(a, b, c), Int));
    all.push((vec![Real, Bool], Op::Guard { value: a, condition: b, failure: FailureId(0) }, Real));
    all
}

fn values(ty: Type) -> Vec<Scalar> {
    match ty {
        Type::Real => REALS.map(Real).to_vec(),
        Type::Int => INTS.map(Int).to_vec(),
        _ => vec![Bool(false), Bool(true)],
    }
}

/// Every combination of special values of these types.
fn combinations(types: &[Type]) -> Vec<Vec<Scalar>> {
    let Some((first, rest)) = types.split_first() else { return vec![Vec::new()] };
    let rest = combinations(rest);
    let with = |x: Scalar| rest.iter().map(move |r| [&[x], &r[..]].concat());
    values(*first).into_iter().flat_map(with).collect()
}

#[test]
fn every_operation_at_special_values() {
    let mut case = Case { name: "operations".to_owned(), module: Module::default(), runs: Vec::new() };
    case.module.fail(Failure { span: Span::default(), message: "it fails".to_owned() });
    for (types, op, ty) in operations() {
        let id = case.module.add(function(&types, op, ty));
        case.runs.extend(combinations(&types).into_iter().map(|arguments| (id, arguments)));
    }
    gml_compiler::internals::ir::validate(&case.module).expect("they are valid");
    assert!(conforms(&case) > 5000);
}

/// One operation on one set of values.
fn run<'m, E: Evaluator<'m>>(module: &'m Module, arguments: &[Scalar]) -> Outcome {
    E::new(module, &[FunctionId(0)]).call(FunctionId(0), arguments)
}

/// Results that the language defines, for both evaluators.
#[test]
fn stated_results() {
    let (a, b) = (Value(0), Value(1));
    let unary = |op, x: f64, r: f64| (vec![Type::Real], Op::Unary(op, a), Type::Real, vec![Real(x)], Real(r));
    let binary = |op, x: f64, y: f64, r: f64| {
        (vec![Type::Real; 2], Op::Binary(op, a, b), Type::Real, vec![Real(x), Real(y)], Real(r))
    };
    let ints = |op, x: i64, y: i64, r: i64| {
        (vec![Type::Int; 2], Op::Binary(op, a, b), Type::Int, vec![Int(x), Int(y)], Int(r))
    };
    let power = |n, x: f64, r: f64| (vec![Type::Real], Op::PowInt(a, n), Type::Real, vec![Real(x)], Real(r));
    let to_int = |x: f64, r: i64| (vec![Type::Real], Op::Unary(Unary::ToInt, a), Type::Int, vec![Real(x)], Int(r));
    let (inf, nan) = (f64::INFINITY, f64::NAN);
    let pi = std::f64::consts::PI;
    let table = [
        unary(Unary::Sqrt, -0.0, -0.0),
        unary(Unary::Sqrt, -1.0, nan),
        unary(Unary::Round, 2.5, 3.0),
        unary(Unary::Round, -2.5, -3.0),
        unary(Unary::Floor, -0.5, -1.0),
        unary(Unary::Floor, -0.0, -0.0),
        unary(Unary::Sign, -0.0, 0.0),
        unary(Unary::Sign, nan, nan),
        unary(Unary::Ln, 0.0, -inf),
        unary(Unary::Exp, -inf, 0.0),
        unary(Unary::Abs, -0.0, 0.0),
        binary(Binary::Rem, -1.0, 3.0, 2.0),
        binary(Binary::Rem, 1.0, -3.0, -2.0),
        binary(Binary::Rem, 5.5, 2.0, 1.5),
        binary(Binary::Rem, 1.0, 0.0, nan),
        binary(Binary::Pow, 0.0, 0.0, 1.0),
        binary(Binary::Pow, -8.0, 1.0 / 3.0, nan),
        binary(Binary::Pow, 2.0, -1.0, 0.5),
        binary(Binary::Atan2, 0.0, -1.0, pi),
        binary(Binary::Atan2, -0.0, -1.0, -pi),
        binary(Binary::Min, 0.0, -0.0, -0.0),
        binary(Binary::Max, -0.0, 0.0, 0.0),
        binary(Binary::Min, nan, 1.0, nan),
        binary(Binary::Max, 1.0, nan, nan),
        binary(Binary::MulOrZero, 0.0, inf, 0.0),
        binary(Binary::MulOrZero, -0.0, nan, 0.0),
        binary(Binary::DivOrZero, 0.0, 0.0, 0.0),
        binary(Binary::Div, 1.0, -0.0, -inf),
        ints(Binary::Rem, -1, 3, 2),
        ints(Binary::Rem, 7, -3, -2),
        ints(Binary::Rem, i64::MIN, -1, 0),
        ints(Binary::Rem, 5, 0, 0),
        ints(Binary::Div, 5, 0, 0),
        ints(Binary::Div, i64::MIN, -1, i64::MIN),
        ints(Binary::Add, i64::MAX, 1, i64::MIN),
        power(0, 0.0, 1.0),
        power(0, nan, 1.0),
        power(-1, 0.0, inf),
        power(3, -2.0, -8.0),
        power(2, -0.0, 0.0),
        power(i32::MIN, 1.0, 1.0),
        to_int(nan, 0),
        to_int(1e300, i64::MAX),
        to_int(-1e300, i64::MIN),
        to_int(-2.7, -2),
    ];
    for (types, op, ty, arguments, expected) in table {
        let name = format!("{op:?} of {arguments:?}");
        let mut module = Module::default();
        module.add(function(&types, op, ty));
        for outcome in [run::<Interpreter<'_>>(&module, &arguments), run::<Native<'_>>(&module, &arguments)] {
            let good = outcome.as_ref().is_ok_and(|r| r.len() == 1 && same(r[0], expected));
            assert!(good, "{name}: {outcome:?} instead of {expected:?}");
        }
    }
}

/// A guard that does not hold is a failure in both evaluators.
#[test]
fn guards_fail() {
    let mut module = Module::default();
    let failure = module.fail(Failure { span: Span::default(), message: "it fails".to_owned() });
    let guard = Op::Guard { value: Value(0), condition: Value(1), failure };
    module.add(function(&[Type::Real, Type::Bool], guard, Type::Real));
    for condition in [true, false] {
        let arguments = [Real(2.0), Bool(condition)];
        for outcome in [run::<Interpreter<'_>>(&module, &arguments), run::<Native<'_>>(&module, &arguments)] {
            assert_eq!(outcome, if condition { Ok(vec![Real(2.0)]) } else { Err(Fault::Failure(0)) });
        }
    }
}
