//! Code that several workers make against that of one.

use super::*;
use crate::ir::{Binary, Unary};

/// `(u, v) -> k sin(k sin(... u)) + v`, of a size that grows with k.
fn tower(module: &mut Module, k: usize) -> FunctionId {
    let mut raw = Raw::new(&[Type::Real; 2]);
    let [mut x, v] = [0, 1].map(Value);
    let factor = raw.constant(k as f64);
    for _ in 0..20 * k {
        let sine = raw.real(Op::Unary(Unary::Sin, x));
        x = raw.real(Op::Binary(Binary::Mul, factor, sine));
    }
    let sum = raw.real(Op::Binary(Binary::Add, x, v));
    module.add(raw.returns(&[sum]))
}

fn stored(function: FunctionId) -> KernelShape {
    KernelShape { function, captures: 0, output: Output::Store }
}

#[test]
fn any_number_of_workers_gives_the_same() {
    let mut module = Module::default();
    let functions: Vec<FunctionId> = (1..=9).map(|k| tower(&mut module, k)).collect();
    let shapes: Vec<KernelShape> = functions.iter().map(|f| stored(*f)).collect();
    let values = |count: usize| -> Vec<f64> {
        let (code, _) = Code::compile(&module, &shapes, &functions, OPTIONS, Workers::many(count)).unwrap();
        let mut values = Vec::new();
        for place in 0..functions.len() {
            let mut out = [0.0];
            let points = Points { count: 1, values: &[0.3, 10.0 * place as f64] };
            code.run(place, &[], points, &mut out, Limits::default()).unwrap();
            let plain = code.call_reals(place, &[0.3, 10.0 * place as f64], Limits::default()).unwrap();
            assert_eq!(plain, out);
            values.extend(out);
        }
        values
    };
    let one = values(1);
    // Each function is there once, and in its place.
    assert!((1..one.len()).all(|i| !one[..i].contains(&one[i])), "{one:?}");
    assert_eq!(values(2), one);
    assert_eq!(values(5), one);
    assert_eq!(values(100), one);
}

#[test]
fn the_first_error_is_given_whichever_worker_meets_it() {
    let mut module = Module::default();
    let mut shapes: Vec<KernelShape> = (1..=9).map(|k| stored(tower(&mut module, k))).collect();
    for place in [3, 7] {
        module.functions[shapes[place].function.0 as usize].name = format!("wrong{place}");
        shapes[place].captures = 5;
    }
    for count in 1..6 {
        let error = Code::compile(&module, &shapes, &[], OPTIONS, Workers::many(count)).err();
        assert_eq!(error, Some(JitError::Shape("wrong3".to_owned())));
    }
}
