//! Every operation at special values: what the code computes is what `ir::scalar` computes.

use super::*;
use crate::ir::{Binary, Compare, Unary, arithmetic, scalar};

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
    0.499_999_999_999_999_94,
    3.0,
    -3.0,
    1e-310,
    1e300,
    -1e300,
    9.3e18,
    std::f64::consts::PI,
    4_503_599_627_370_497.5,
    f64::MAX,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];
const INTS: [i64; 9] = [0, 1, -1, 2, -3, 7, i64::MAX, i64::MIN, i64::MIN + 1];
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
const REAL_BINARY: [Binary; 11] = [
    Binary::Add,
    Binary::Sub,
    Binary::Mul,
    Binary::Div,
    Binary::Rem,
    Binary::Pow,
    Binary::Atan2,
    Binary::Min,
    Binary::Max,
    Binary::MulOrZero,
    Binary::DivOrZero,
];
const INT_BINARY: [Binary; 7] =
    [Binary::Add, Binary::Sub, Binary::Mul, Binary::Div, Binary::Rem, Binary::Min, Binary::Max];
const COMPARES: [Compare; 6] = [Compare::Eq, Compare::Ne, Compare::Lt, Compare::Le, Compare::Gt, Compare::Ge];

/// Compares a function of one operation each with what `expected` gives.
fn agree(params: &[Type], ops: &[(Op, Type)], args: &[Vec<Scalar>], expected: impl Fn(&Op, &[Scalar]) -> Scalar) {
    let mut raw = Raw::new(params);
    let results: Vec<Value> = ops.iter().map(|(op, ty)| raw.node(op.clone(), *ty)).collect();
    let mut module = Module::default();
    let id = module.add(raw.returns(&results));
    let native = Native::new(&module, id);
    for args in args {
        let got = native.call(args, Limits::default()).expect("nothing fails");
        for ((op, _), got) in ops.iter().zip(got) {
            let expected = expected(op, args);
            assert!(same(got, expected), "{op:?} of {args:?} is {expected:?}, not {got:?}");
        }
    }
}

fn pairs<T: Copy>(values: &[T], make: impl Fn(T) -> Scalar) -> Vec<Vec<Scalar>> {
    values.iter().flat_map(|a| values.iter().map(|b| vec![make(*a), make(*b)]).collect::<Vec<_>>()).collect()
}

#[test]
fn unary_operations_of_reals() {
    let ops: Vec<_> = UNARY.map(|op| (Op::Unary(op, Value(0)), Type::Real)).to_vec();
    let args: Vec<_> = REALS.map(|x| vec![Scalar::Real(x)]).to_vec();
    agree(&[Type::Real], &ops, &args, |op, args| {
        let Op::Unary(op, _) = op else { unreachable!() };
        scalar::unary(*op, args[0]).unwrap()
    });
}

#[test]
fn conversions_and_not() {
    let args: Vec<_> = REALS.map(|x| vec![Scalar::Real(x)]).to_vec();
    agree(&[Type::Real], &[(Op::Unary(Unary::ToInt, Value(0)), Type::Int)], &args, |_, args| {
        scalar::unary(Unary::ToInt, args[0]).unwrap()
    });
    let args: Vec<_> = INTS.map(|x| vec![Scalar::Int(x)]).to_vec();
    agree(&[Type::Int], &[(Op::Unary(Unary::ToReal, Value(0)), Type::Real)], &args, |_, args| {
        scalar::unary(Unary::ToReal, args[0]).unwrap()
    });
    let args: Vec<_> = [false, true].map(|x| vec![Scalar::Bool(x)]).to_vec();
    agree(&[Type::Bool], &[(Op::Unary(Unary::Not, Value(0)), Type::Bool)], &args, |_, args| {
        scalar::unary(Unary::Not, args[0]).unwrap()
    });
}

#[test]
fn binary_operations() {
    let expected = |op: &Op, args: &[Scalar]| match op {
        Op::Binary(op, ..) => scalar::binary(*op, args[0], args[1]).unwrap(),
        Op::Compare(op, ..) => Scalar::Bool(scalar::compare(*op, args[0], args[1]).unwrap()),
        _ => unreachable!(),
    };
    let binary = |op| Op::Binary(op, Value(0), Value(1));
    let compares = COMPARES.map(|op| (Op::Compare(op, Value(0), Value(1)), Type::Bool));

    let mut ops = REAL_BINARY.map(|op| (binary(op), Type::Real)).to_vec();
    ops.extend(compares.clone());
    agree(&[Type::Real; 2], &ops, &pairs(&REALS, Scalar::Real), expected);

    let mut ops = INT_BINARY.map(|op| (binary(op), Type::Int)).to_vec();
    ops.extend(compares);
    agree(&[Type::Int; 2], &ops, &pairs(&INTS, Scalar::Int), expected);

    let ops = [Binary::And, Binary::Or].map(|op| (binary(op), Type::Bool));
    agree(&[Type::Bool; 2], &ops, &pairs(&[false, true], Scalar::Bool), expected);
}

#[test]
fn integer_powers() {
    let ops: Vec<_> = [0, 1, 2, 3, 5, 7, 16, 1000, -1, -2, -7, i32::MAX, i32::MIN]
        .map(|n| (Op::PowInt(Value(0), n), Type::Real))
        .to_vec();
    let args: Vec<_> = REALS.map(|x| vec![Scalar::Real(x)]).to_vec();
    agree(&[Type::Real], &ops, &args, |op, args| {
        let Op::PowInt(_, n) = op else { unreachable!() };
        Scalar::Real(arithmetic::pow_int(args[0].real().unwrap(), *n))
    });
}

#[test]
fn select_takes_one_side_whatever_the_other_is() {
    let op = Op::Select(Value(0), Value(1), Value(2));
    let args: Vec<_> = [false, true]
        .iter()
        .flat_map(|c| pairs(&REALS, Scalar::Real).into_iter().map(|p| vec![Scalar::Bool(*c), p[0], p[1]]))
        .collect();
    agree(&[Type::Bool, Type::Real, Type::Real], &[(op, Type::Real)], &args, |_, args| {
        if args[0] == Scalar::Bool(true) { args[1] } else { args[2] }
    });
}
