//! Signatures of decisions of small functions, and of random ones.

use super::decisions_of;
use crate::ir::hoist::axes::{Axes, U, V};
use crate::ir::interpret::{self, Limits, RunError};
use crate::ir::scalar::Scalar;
use crate::ir::tests::random::random_function;
use crate::ir::tests::{function_of, run};
use crate::ir::*;
use crate::jit;
use crate::workers::Workers;
use proptest::prelude::*;

/// Signatures of a function of u and v.
struct Signatures(Module, FunctionId);

impl Signatures {
    fn new(make: impl FnOnce(&mut FunctionBuilder, Value, Value) -> Value) -> Signatures {
        let (mut module, f) = function_of(&["c", "u", "v"], |b, p| make(b, p[1], p[2]));
        let id = super::decisions(&mut module, f, 1).unwrap();
        validate(&module).unwrap();
        Signatures(module, id)
    }

    fn at(&self, u: f64, v: f64) -> [f64; 3] {
        run(&self.0, self.1, &[2.0, u, v]).try_into().unwrap()
    }

    /// Which of the signatures differ between two points.
    fn differ(&self, a: (f64, f64), b: (f64, f64)) -> [bool; 3] {
        let (a, b) = (self.at(a.0, a.1), self.at(b.0, b.1));
        [0, 1, 2].map(|k| a[k].to_bits() != b[k].to_bits())
    }
}

#[test]
fn decisions_are_told_apart_by_their_coordinates() {
    let s = Signatures::new(|b, u, v| {
        let c = b.param(0);
        let (floor, half) = (b.unary(Unary::Floor, c), b.real(0.5));
        let of_c = b.unary(Unary::Abs, floor);
        let (du, dv, duv) = (b.sub(u, half), b.sub(half, v), b.sub(u, v));
        let of_u = b.unary(Unary::Abs, du);
        let of_v = b.binary(Binary::Max, dv, of_c);
        let of_both = b.unary(Unary::Abs, duv);
        let sum = b.add(of_u, of_v);
        b.add(sum, of_both)
    });
    assert_eq!(s.differ((0.4, 0.9), (0.45, 0.8)), [false; 3]);
    assert_eq!(s.differ((0.4, 0.9), (0.6, 0.9)), [true, false, false]);
    assert_eq!(s.differ((0.4, 0.9), (0.4, -3.0)), [false, true, true]);
    assert_eq!(s.differ((0.4, 0.3), (0.4, 0.6)), [false, false, true]);
    assert!(s.at(f64::NAN, 0.3).iter().all(|x| x.is_finite()));
}

#[test]
fn conditions_are_taken_apart_and_products_into_factors() {
    let s = Signatures::new(|b, u, v| {
        let (third, half) = (b.real(0.3), b.real(0.5));
        let (left, low) = (b.compare(Compare::Lt, u, third), b.compare(Compare::Lt, v, third));
        let both = b.binary(Binary::And, left, low);
        let (du, dv) = (b.sub(u, half), b.sub(v, half));
        let product = b.mul(du, dv);
        let ridges = b.unary(Unary::Abs, product);
        b.select(both, ridges, u)
    });
    for u in [0.1, 0.4, 0.9] {
        assert_eq!(s.differ((u, 0.2), (u, 0.4)), [false, true, false]);
        assert_eq!(s.differ((u, 0.4), (u, 0.6)), [false, true, false]);
    }
    assert_eq!(s.differ((0.2, 0.9), (0.6, 0.9)), [true, false, false]);
    assert_eq!(s.at(0.4, 0.4)[2], 0.0);
}

#[test]
fn whole_numbers_and_remainders_have_a_signature_each() {
    let s = Signatures::new(|b, u, v| {
        let (ten, third) = (b.real(10.0), b.real(0.25));
        let many = b.mul(u, ten);
        let (floor, rest) = (b.unary(Unary::Floor, many), b.binary(Binary::Rem, v, third));
        b.add(floor, rest)
    });
    let different = |values: Vec<u64>| values.iter().collect::<std::collections::BTreeSet<_>>().len();
    let of_u = (0..40).map(|k| s.at((f64::from(k) + 0.5) / 40.0, 0.1)[0].to_bits()).collect();
    let of_v = (0..40).map(|k| s.at(0.1, (f64::from(k) + 0.5) / 40.0)[1].to_bits()).collect();
    assert_eq!((different(of_u), different(of_v)), (10, 4));
    assert_eq!(s.at(1e300, 1e300).map(f64::is_finite), [true; 3]);
}

/// A loop that counts how often a number that it carries passes 0.5, in any of its iterations.
#[test]
fn a_loops_signature_remembers_all_iterations() {
    let mut module = Module::default();
    let mut b = FunctionBuilder::new("turn", vec![Parameter::new("i", Type::Int), Parameter::real("x")]);
    let (x, half) = (b.param(1), b.real(0.5));
    let d = b.sub(x, half);
    let folded = b.unary(Unary::Abs, d);
    let two = b.real(1.9);
    let next = b.mul(folded, two);
    let body = module.add(b.finish([("x".to_owned(), next)]));
    let mut b = FunctionBuilder::new("f", super::super::tests::reals(&["u", "v"]));
    let count = b.int(200);
    let result = b.loop_(count, body, vec![b.param(0)], vec![])[0];
    let f = module.add(b.finish([("f".to_owned(), result)]));
    let id = super::decisions(&mut module, f, 0).unwrap();
    validate(&module).unwrap();
    let signs = |u: f64| {
        (0..200).scan(u, |x, _| {
            let d = *x - 0.5;
            *x = 1.9 * d.abs();
            Some(d < 0.0)
        })
    };
    let mut known = std::collections::BTreeMap::new();
    for k in 0..500 {
        let u = f64::from(k) / 500.0;
        let [of_u, of_v, of_both] = run(&module, id, &[u, 0.0]).try_into().unwrap();
        assert!((0.0..1.0).contains(&of_u) && of_v == 0.0 && of_both == 0.0);
        let signs: Vec<bool> = signs(u).collect();
        assert_eq!(*known.entry(signs).or_insert(of_u), of_u);
    }
    let mut signatures: Vec<f64> = known.values().copied().collect();
    signatures.sort_by(f64::total_cmp);
    signatures.dedup();
    assert_eq!(signatures.len(), known.len(), "different decisions have different signatures");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    /// Valid, in 0..1, without a signature where nothing depends on the coordinate, the same in machine code.
    #[test]
    fn signatures_of_random_functions(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        n in -1i64..6,
        x in prop::array::uniform3(-3.0..3.0f64),
    ) {
        let (mut module, f) = random_function(&bytes, 3, 2);
        let params: [Axes; 4] = [0, 0, U, V];
        let id = decisions_of(&mut module, f, &params).unwrap();
        validate(&module).unwrap();
        let mut args = vec![Scalar::Int(n)];
        args.extend(x.map(Scalar::Real));
        let expected = match interpret::run(&module, id, &args, Limits::default()) {
            Ok(results) => results,
            Err(e) => {
                prop_assert!(matches!(e, RunError::Failed(_)), "{e:?}");
                return Ok(());
            }
        };
        let expected: Vec<f64> = expected.into_iter().filter_map(Scalar::real).collect();
        prop_assert!(expected.iter().all(|h| (0.0..=1.0).contains(h)), "{expected:?}\n{module}");
        // Decisions of captures count nowhere.
        let none = decisions_of(&mut module, f, &[0; 4]).unwrap();
        prop_assert!(module.function(none).results.iter().all(|r| *module.function(none).op(*r) == Op::Real(0)));
        // As a kernel, which takes Reals.
        let mut b = FunctionBuilder::new("kernel", super::super::tests::reals(&["n", "a", "u", "v"]));
        let count = b.unary(Unary::ToInt, b.param(0));
        let [a, u, v] = [1, 2, 3].map(|k| b.param(k));
        let results = b.call(id, vec![count, a, u, v], &[Type::Real; 3]);
        let kernel = module.add(b.finish(results.into_iter().enumerate().map(|(k, r)| (format!("r{k}"), r))));
        let shape = jit::KernelShape { function: kernel, captures: 2, output: jit::Output::Store };
        let options = jit::Options { verify: true, ..jit::Options::default() };
        let (code, _) = jit::Code::compile(&module, &[shape], &[], options, Workers::ONE).unwrap();
        let mut out = [0.0; 9];
        let points = jit::Points { count: 3, values: &[x[1], x[1], x[1], x[2], x[2], x[2]] };
        code.run(0, &[n as f64, x[0]], points, &mut out, jit::Limits::default()).unwrap();
        for (k, got) in out.iter().enumerate() {
            prop_assert_eq!(got.to_bits(), expected[k % 3].to_bits());
        }
    }
}
