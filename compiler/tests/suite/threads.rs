//! Programs are compiled on several threads at once, and one program is evaluated on several: the results are those of
//! one thread.

use crate::common::{Random, example};
use gml_compiler::program::{Instance, Order, Program, Sites};
use std::sync::Barrier;

const THREADS: usize = 4;
const SCRIPTS: [&str; 4] = ["cup/cup", "can/can", "elbow/elbow", "bowl/bowl"];

/// All evaluations of a program's first parts, as bits.
fn everything(program: &Program, instance: &Instance<'_>) -> Vec<u64> {
    let mut random = Random(31);
    let (u, v): (Vec<f64>, Vec<f64>) = (0..6).map(|_| (random.next(), random.between(0.05, 0.95))).unzip();
    let w: Vec<[f64; 3]> = (0..36).map(|_| [0; 3].map(|_| random.between(-1.0, 1.0))).collect();
    let mut all = Vec::new();
    for (patch, part) in program.parts().iter().enumerate().take(3) {
        let active = part.active.len();
        let lengths = [18 * 6, 9 * 36, 3 * active * 36, program.parameters().len(), 3 * active * 6];
        let [mut second, mut partials, mut jacobian, mut gradient, mut dense] = lengths.map(|n| vec![0.0; n]);
        instance.evaluate(patch, Sites::Scattered(&u, &v), Order::SecondPartials, &mut second).unwrap();
        instance.evaluate(patch, Sites::Grid(&u, &v), Order::Partials, &mut partials).unwrap();
        instance.evaluate(patch, Sites::Grid(&u, &v), Order::Jacobian, &mut jacobian).unwrap();
        instance.evaluate(patch, Sites::Grid(&u, &v), Order::Pullback(&w), &mut gradient).unwrap();
        instance.evaluate(patch, Sites::Scattered(&u, &v), Order::Jacobian, &mut dense).unwrap();
        all.extend([second, partials, jacobian, gradient, dense].concat().into_iter().map(f64::to_bits));
    }
    all
}

/// The same for one script, compiled by this call.
fn compiled(name: &str) -> Vec<u64> {
    let program = example(name);
    let instance = program.instantiate(&program.defaults()).unwrap();
    everything(&program, &instance)
}

#[test]
fn programs_are_compiled_on_several_threads_at_once() {
    let expected = SCRIPTS.map(compiled);
    let barrier = Barrier::new(THREADS);
    std::thread::scope(|scope| {
        for thread in 0..THREADS {
            let (expected, barrier) = (&expected, &barrier);
            scope.spawn(move || {
                for round in 0..SCRIPTS.len() {
                    let script = (thread + round) % SCRIPTS.len();
                    barrier.wait();
                    assert_eq!(compiled(SCRIPTS[script]), expected[script], "{}", SCRIPTS[script]);
                }
            });
        }
    });
}

/// Its derivatives are made by whichever thread is the first to ask for them.
#[test]
fn a_program_is_evaluated_on_several_threads_at_once() {
    let expected = compiled(SCRIPTS[0]);
    let program = example(SCRIPTS[0]);
    let instance = program.instantiate(&program.defaults()).unwrap();
    let barrier = Barrier::new(THREADS);
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                barrier.wait();
                for _ in 0..10 {
                    assert_eq!(everything(&program, &instance), expected);
                }
            });
        }
    });
}
