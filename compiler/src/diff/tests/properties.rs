//! Random functions: derivatives against differences, and against one another.

use super::super::*;
use crate::ir::ParameterFunction;
use crate::ir::hoist::prelude::split_all;
use crate::ir::tests::random::random_function;
use crate::ir::tests::run_with;
use crate::ir::{Op, inline, simplify};
use proptest::prelude::*;
use proptest::strategy::ValueTree;

const PARAMS: usize = 3;
const RESULTS: usize = 2;

/// The parameters after the integer one.
const WRT: [u32; PARAMS] = [1, 2, 3];

fn case() -> impl Strategy<Value = (Vec<u8>, i64, [f64; PARAMS], [f64; PARAMS], [f64; RESULTS])> {
    let direction = || -1.0..1.0;
    (
        prop::collection::vec(any::<u8>(), 0..160),
        -1i64..6,
        [-1.5..1.5, -1.5..1.5, -1.5..1.5],
        [direction(), direction(), direction()],
        [direction(), direction()],
    )
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    a == b || (a - b).abs() <= tolerance * (1.0 + a.abs() + b.abs())
}

/// The derivative of `f` along a line by central differences of fourth order (error h^4 / 30 f^(5), rounding 1e-16 /
/// h), if two step sizes agree: they do not where a kink or a jump is near.
fn difference(f: impl Fn(f64) -> Vec<f64>) -> Vec<Option<f64>> {
    let stencil = |h: f64| -> Vec<f64> {
        let at = [f(-2.0 * h), f(-h), f(h), f(2.0 * h)];
        (0..at[0].len()).map(|k| (at[0][k] - 8.0 * at[1][k] + 8.0 * at[2][k] - at[3][k]) / (12.0 * h)).collect()
    };
    let (coarse, fine) = (stencil(2e-4), stencil(1e-4));
    coarse.into_iter().zip(fine).map(|(a, b)| close(a, b, 1e-7).then_some(b)).collect()
}

/// Compares derivatives with differences wherever these can be had.
fn check(exact: &[f64], approximate: &[Option<f64>]) -> Result<(), TestCaseError> {
    for (k, (exact, approximate)) in exact.iter().zip(approximate).enumerate() {
        if let Some(approximate) = approximate {
            prop_assert!(close(*exact, *approximate, 1e-5), "result {k}: {exact}, but differences give {approximate}");
        }
    }
    Ok(())
}

fn along(x: &[f64], v: &[f64], t: f64) -> Vec<f64> {
    x.iter().zip(v).map(|(x, v)| x + t * v).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The properties below would hold of anything if no differences could be had: in most cases they can.
#[test]
fn differences_can_mostly_be_had() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut had, mut all) = (0, 0);
    for _ in 0..100 {
        let Ok(tree) = case().new_tree(&mut runner) else { continue };
        let (bytes, n, x, v, _) = tree.current();
        let (module, f) = random_function(&bytes, PARAMS, RESULTS);
        let slopes = difference(|t| run_with(&module, f, n, &along(&x, &v, t)));
        // Of those that are not simply zero.
        all += slopes.iter().filter(|s| **s != Some(0.0)).count();
        had += slopes.iter().filter(|s| s.is_some_and(|s| s != 0.0)).count();
    }
    assert!(had > 80 && had * 10 > all * 9, "{had} of {all}");
}

proptest! {
    #[test]
    fn simplifying_keeps_values((bytes, n, x, ..) in case()) {
        let (mut module, f) = random_function(&bytes, PARAMS, RESULTS);
        let before = run_with(&module, f, n, &x);
        inline(&mut module, &[f]).unwrap();
        let inlined = run_with(&module, f, n, &x);
        simplify(&mut module, &[f]);
        let simplified = run_with(&module, f, n, &x);
        simplify(&mut module, &[f]);
        let again = run_with(&module, f, n, &x);
        let mut roots = [f];
        module.drop_unreached(&mut roots);
        ir::validate(&module).unwrap();
        let compact = run_with(&module, roots[0], n, &x);
        for k in 0..RESULTS {
            prop_assert!(close(before[k], inlined[k], 1e-9));
            prop_assert!(close(before[k], simplified[k], 1e-9), "{} became {}", before[k], simplified[k]);
            prop_assert!(close(before[k], again[k], 1e-9));
            prop_assert_eq!(again[k], compact[k]);
        }
    }

    #[test]
    fn splitting_keeps_values((bytes, n, x, ..) in case()) {
        let (mut module, f) = random_function(&bytes, PARAMS, RESULTS);
        let expected = run_with(&module, f, n, &x);
        inline(&mut module, &[f]).unwrap();
        simplify(&mut module, &[f]);
        let whole = ParameterFunction { function: f, params: vec![0, 1] };
        let params = module.function(f).params[..2].to_vec();
        let split = split_all(&mut module, params, &[whole.clone(), whole]);
        let captures = run_with(&module, split.prelude, n, &x[..1]);
        prop_assert_eq!(&split.bodies[0].captures, &split.bodies[1].captures);
        let body = &split.bodies[1];
        let mut args: Vec<f64> = body.captures.iter().map(|c| captures[*c as usize]).collect();
        args.extend(&x[1..]);
        let results = crate::ir::tests::run(&module, body.function, &args);
        for k in 0..RESULTS {
            prop_assert!(close(expected[k], results[k], 1e-9), "{} became {}", expected[k], results[k]);
        }
    }

    #[test]
    fn tangents_agree_with_differences((bytes, n, x, v, _) in case()) {
        let (mut module, f) = random_function(&bytes, PARAMS, RESULTS);
        let derivative = tangent(&mut module, f, &WRT).unwrap();
        let made = run_with(&module, derivative, n, &[x, v].concat());
        let values = run_with(&module, f, n, &x);
        for k in 0..RESULTS {
            prop_assert!(close(made[k], values[k], 1e-9));
        }
        check(&made[RESULTS..], &difference(|t| run_with(&module, f, n, &along(&x, &v, t))))?;
    }

    #[test]
    fn jacobian_and_pullback_agree_with_the_tangent((bytes, n, x, v, w) in case()) {
        let (mut module, f) = random_function(&bytes, PARAMS, RESULTS);
        let forward = tangent(&mut module, f, &WRT).unwrap();
        let (all, pattern) = jacobian(&mut module, f, &WRT).unwrap();
        let back = pullback(&mut module, f, &WRT, true).unwrap();
        let jv = run_with(&module, forward, n, &[x, v].concat())[RESULTS..].to_vec();
        let entries = run_with(&module, all, n, &x);
        let mut sums = [0.0; RESULTS];
        for (entry, value) in pattern.iter().zip(&entries[RESULTS..]) {
            sums[entry.result as usize] += value * v[entry.param as usize - 1];
        }
        let back = run_with(&module, back, n, &[&x[..], &w].concat());
        for k in 0..RESULTS {
            prop_assert!(close(sums[k], jv[k], 1e-8), "J v: {} and {}", sums[k], jv[k]);
            prop_assert!(close(back[k], entries[k], 1e-9));
        }
        let (there, back) = (dot(&w, &jv), dot(&v, &back[RESULTS..]));
        prop_assert!(close(there, back, 1e-8), "w.Jv = {there}, v.J'w = {back}");
    }

    #[test]
    fn second_derivatives_agree((bytes, n, x, v, w) in case()) {
        let (mut module, f) = random_function(&bytes, PARAMS, RESULTS);
        inline(&mut module, &[f]).unwrap();
        simplify(&mut module, &[f]);
        // Forward over forward, along the same direction.
        let first = tangent(&mut module, f, &WRT).unwrap();
        let second = tangent(&mut module, first, &WRT).unwrap();
        let made = run_with(&module, second, n, &[x, v, v].concat());
        let slope = |t: f64| run_with(&module, first, n, &[&along(&x, &v, t)[..], &v].concat())[RESULTS..].to_vec();
        check(&made[3 * RESULTS..], &difference(slope))?;
        // Forward over reverse.
        let back = pullback(&mut module, f, &WRT, false).unwrap();
        let mixed = tangent(&mut module, back, &WRT).unwrap();
        let made = run_with(&module, mixed, n, &[&x[..], &w, &v].concat());
        let gradient = |t: f64| run_with(&module, back, n, &[&along(&x, &v, t)[..], &w].concat());
        check(&made[PARAMS..], &difference(gradient))?;
        // w . d2f(v, v) either way.
        let twice = run_with(&module, second, n, &[x, v, v].concat());
        let (there, other) = (dot(&w, &twice[3 * RESULTS..]), dot(&v, &made[PARAMS..]));
        prop_assert!(close(there, other, 1e-7), "{there} and {other}");
        // Reverse over forward: the same again.
        let over = pullback(&mut module, first, &WRT, false).unwrap();
        let zeros = [0.0; RESULTS];
        let made = run_with(&module, over, n, &[&x[..], &v, &zeros, &w].concat());
        let third = dot(&v, &made);
        prop_assert!(close(there, third, 1e-7), "{there} and {third}");
    }

    #[test]
    fn tangents_in_the_program_are_expanded((bytes, n, x, v, _) in case()) {
        // g(n, x, v) = the tangent of f; h = the tangent of g along v again.
        let (mut module, f) = random_function(&bytes, PARAMS, 1);
        let of = |module: &mut Module, f: FunctionId, name: &str| {
            let old = module.function(f).clone();
            let mut params = old.params[..=PARAMS].to_vec();
            params.extend((0..PARAMS).map(|i| Parameter::real(format!("v{i}"))));
            let mut b = FunctionBuilder::new(name, params);
            let all = b.params();
            let args = all[..old.params.len()].to_vec();
            let seeds = (0..PARAMS).map(|i| (i as u32 + 1, all[PARAMS + 1 + i])).collect();
            let r = b.tangent(f, args, seeds, 1)[0];
            module.add(b.finish([("r".to_owned(), r)]))
        };
        let g = of(&mut module, f, "g");
        let h = of(&mut module, g, "h");
        ir::validate(&module).unwrap();
        expand(&mut module, &[h, g]).unwrap();
        for id in [g, h] {
            let left = module.function(id).nodes.iter().any(|n| matches!(n.op, Op::Tangent { .. }));
            prop_assert!(!left, "a tangent is left");
        }
        let first = run_with(&module, g, n, &[x, v].concat());
        check(&first, &difference(|t| run_with(&module, f, n, &along(&x, &v, t))))?;
        let second = run_with(&module, h, n, &[x, v].concat());
        check(&second, &difference(|t| run_with(&module, g, n, &[&along(&x, &v, t)[..], &v].concat())))?;
    }
}
