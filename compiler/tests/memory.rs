//! Dropped programs give their memory back. This test has a process of its own: allocations of other tests would count.
//!
//! `GMLC_PROGRAMS=10000 cargo test --release --test memory -- --nocapture` compiles, runs and drops 10,000
//! programs instead of a thousand.

#[path = "suite/common/mod.rs"]
mod common;

use gml_compiler::Workers;
use gml_compiler::internals::ir::{Binary, FunctionBuilder, Module, Parameter, Unary};
use gml_compiler::internals::jit::{Code, Options};
use gml_compiler::program::{Limits, Order, Sites};

/// Pages of the process in memory; `None` if the system does not report them.
fn resident() -> Option<usize> {
    std::fs::read_to_string("/proc/self/statm").ok()?.split_whitespace().nth(1)?.parse().ok()
}

/// Number of programs that are compiled and dropped.
fn programs() -> usize {
    std::env::var("GMLC_PROGRAMS").ok().map_or(1000, |n| n.parse().expect("GMLC_PROGRAMS is a number"))
}

/// Growth in pages over a number of cycles, after some that warm up.
fn growth(cycles: usize, cycle: impl Fn()) -> usize {
    (0..(cycles / 2).min(200)).for_each(|_| cycle());
    let Some(before) = resident() else { return 0 };
    (0..cycles).for_each(|_| cycle());
    resident().unwrap_or(usize::MAX).saturating_sub(before)
}

/// This is one test: two at once would count each other's memory.
#[test]
fn dropped_programs_leave_nothing() {
    code_is_freed();
    programs_are_freed();
}

fn programs_are_freed() {
    let text = "model m {\n param a: length in 1mm..9mm = 3mm\n
        part p = |u, v| (a * cos(u * 1turn), a * u ^ 3, v * a)\n part q = |u, v| (a * u, a * v, a * sqrt(1 + u * v)) }";
    let cycles = programs();
    let grown = growth(cycles, || {
        let program = common::program("m.gml", text);
        let instance = program.instantiate(&[2.0]).expect("it exists");
        let (u, v) = ([0.25, 0.75], [0.5, 1.0]);
        let mut out = [0.0; 18];
        instance.evaluate(1, Sites::Grid(&u[..1], &v), Order::Partials, &mut out).expect("it is finite");
        instance.evaluate(0, Sites::Scattered(&u, &v), Order::Jacobian, &mut out[..6]).expect("it is finite");
        instance
            .evaluate(0, Sites::Grid(&u, &v), Order::Pullback(&[[1.0; 3]; 4]), &mut out[..1])
            .expect("it is finite");
    });
    println!("{grown} pages more after {cycles} programs");
    // Every program has several pages of code: even the smallest leak is a page for each program.
    assert!(grown < 100 + cycles / 50, "{grown} pages more after {cycles} programs");
}

fn code_is_freed() {
    let mut builder = FunctionBuilder::new("f", vec![Parameter::real("x")]);
    let sine = builder.unary(Unary::Sin, builder.param(0));
    let result = builder.binary(Binary::Mul, sine, builder.param(0));
    let mut module = Module::default();
    let id = module.add(builder.finish([("y".to_owned(), result)]));
    let cycle = || {
        let compiled = Code::compile(&module, &[], &[id], Options::default(), Workers::ONE);
        let (code, _) = compiled.expect("it compiles");
        assert_eq!(code.call_reals(0, &[0.5], Limits::default()), Ok(vec![0.5 * 0.5f64.sin()]));
    };
    let grown = growth(1000, cycle);
    // Every program has at least one page of code: a leak is 1,000 pages.
    assert!(grown < 50, "{grown} pages more after 1,000 programs");
}
