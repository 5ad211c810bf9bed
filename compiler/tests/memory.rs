//! Dropped programs give their memory back. Alone in its process: what other tests allocate would be counted.

mod common;

use gml_compiler::ir::{Binary, FunctionBuilder, Module, Parameter, Unary};
use gml_compiler::jit::{Compiler, Limits, Options};

/// Pages of the process in memory; `None` where the system does not tell.
fn resident() -> Option<usize> {
    std::fs::read_to_string("/proc/self/statm").ok()?.split_whitespace().nth(1)?.parse().ok()
}

/// Pages more after so many more cycles than half as many before them.
fn growth(cycles: usize, cycle: impl Fn()) -> usize {
    (0..cycles / 2).for_each(|_| cycle());
    let Some(before) = resident() else { return 0 };
    (0..cycles).for_each(|_| cycle());
    resident().unwrap_or(usize::MAX).saturating_sub(before)
}

/// One test, as two at once would see each other's memory.
#[test]
fn dropped_programs_leave_nothing() {
    code_is_freed();
    programs_are_freed();
}

fn programs_are_freed() {
    let grown = growth(60, || {
        let program = common::example("cup/cup");
        assert!(program.instantiate(&program.defaults()).is_ok());
    });
    // Every kernel has a page of code at least: a leak is 1,200 pages, were it only the code.
    assert!(grown < 300, "{grown} pages more after 60 programs");
}

fn code_is_freed() {
    let mut builder = FunctionBuilder::new("f", vec![Parameter::real("x")]);
    let sine = builder.unary(Unary::Sin, builder.param(0));
    let result = builder.binary(Binary::Mul, sine, builder.param(0));
    let mut module = Module::default();
    let id = module.add(builder.finish([("y".to_owned(), result)]));
    let cycle = || {
        let mut compiler = Compiler::new(&module, Options::default()).expect("this machine is supported");
        let routine = compiler.routine(id).expect("it compiles");
        let code = compiler.finish().expect("it finishes");
        assert_eq!(code.call_reals(routine, &[0.5], Limits::default()), Ok(vec![0.5 * 0.5f64.sin()]));
    };
    let grown = growth(1000, cycle);
    // Every program has a page of code at least: a leak is 1,000 pages.
    assert!(grown < 50, "{grown} pages more after 1,000 programs");
}
