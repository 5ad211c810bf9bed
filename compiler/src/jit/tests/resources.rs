//! Threads, failed compilations, and texts. (That code is freed is seen in a process of its own:
//! compiler/tests/memory.rs.)

use super::*;
use crate::ir::{Binary, Unary, interpret};

/// sin(x)^2 + cos(x)^2 in a module of its own.
fn module() -> (Module, FunctionId) {
    let mut raw = Raw::new(&[Type::Real]);
    let sin = raw.real(Op::Unary(Unary::Sin, Value(0)));
    let cos = raw.real(Op::Unary(Unary::Cos, Value(0)));
    let a = raw.real(Op::PowInt(sin, 2));
    let b = raw.real(Op::PowInt(cos, 2));
    let one = raw.real(Op::Binary(Binary::Add, a, b));
    let mut module = Module::default();
    let id = module.add(raw.returns(&[one]));
    (module, id)
}

#[test]
fn failed_compilations_are_freed() {
    let (mut module, id) = module();
    let mut raw = Raw::new(&[Type::Real]);
    let tangent = raw.node(Op::Tangent { function: id, args: vec![Value(0)], seeds: vec![] }, Type::Multi);
    let result = raw.real(Op::Project(tangent, 0));
    let bad = module.add(raw.returns(&[result]));
    assert_eq!(compiled(&module, &[], &[id, bad], OPTIONS).err(), Some(JitError::Tangent("test".to_owned())));
}

#[test]
fn threads_compile_and_run_at_once() {
    let (module, id) = module();
    let shared = Native::new(&module, id);
    std::thread::scope(|scope| {
        for t in 0..4 {
            let (module, shared) = (&module, &shared);
            scope.spawn(move || {
                for i in 0..50 {
                    let x = [Scalar::Real(f64::from(t * 100 + i))];
                    let own = Native::new(module, id).call(&x, Limits::default());
                    assert_eq!(own, shared.call(&x, Limits::default()));
                }
            });
        }
    });
}

#[test]
fn listings_show_both_texts() {
    let (module, id) = module();
    let options = Options { listings: true, ..OPTIONS };
    let (_, listings) = Code::compile(&module, &[], &[id], options, Workers::ONE).unwrap();
    let [listing] = &listings[..] else { panic!("one function") };
    assert!(listing.clif.contains("fmul"), "{}", listing.clif);
    assert!(listing.assembly.contains("ret"), "{}", listing.assembly);
}

#[test]
fn a_routine_of_more_values_than_a_frame_holds() {
    let count = 60_000;
    let mut raw = Raw::new(&[Type::Real]);
    let mut values = vec![Value(0)];
    for i in 0..count {
        let c = raw.constant(f64::from(i));
        values.push(raw.real(Op::Binary(Binary::Sub, c, values[i as usize])));
    }
    // All of them live until they are added up, the last first.
    let sum = values.iter().rev().copied().reduce(|a, b| raw.real(Op::Binary(Binary::Add, a, b)));
    let mut module = Module::default();
    let id = module.add(raw.returns(&[sum.unwrap(), values[7]]));
    let whole = compiled(&module, &[], &[id], Options { piece: usize::MAX, ..OPTIONS });
    assert!(matches!(whole.err(), Some(JitError::TooLarge(..))));

    let got = Native::new(&module, id).call(&[Scalar::Real(0.5)], Limits::default());
    let expected = interpret::run(&module, id, &[Scalar::Real(0.5)], interpret::Limits::default()).unwrap();
    assert_eq!(got, Ok(expected));
}
