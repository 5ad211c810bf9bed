//! Native code against the interpreter's semantics.

mod batches;
mod control;
mod lanes;
mod operations;
mod partitions;
mod random;
mod resources;

use super::{Code, JitError, KernelShape, Limits, Options, Output, Points, Trap};
use crate::ir::scalar::Scalar;
use crate::ir::{Function, FunctionId, Module, Node, Op, Parameter, Type, Value};
use crate::source::Span;
use crate::workers::Workers;

/// Tests let Cranelift verify what we give it.
const OPTIONS: Options = Options { verify: true, listings: false, one_lane: false, piece: Options::PIECE };

/// A function node by node, without the simplifications of the builder.
struct Raw(Function);

impl Raw {
    fn new(params: &[Type]) -> Raw {
        let mut raw = Raw(Function { name: "test".to_owned(), ..Function::default() });
        for (i, ty) in params.iter().enumerate() {
            raw.0.params.push(Parameter::new(format!("p{i}"), *ty));
            raw.node(Op::Param(i as u32), *ty);
        }
        raw
    }

    fn node(&mut self, op: Op, ty: Type) -> Value {
        self.0.nodes.push(Node { op, ty, span: Span::default() });
        Value(self.0.nodes.len() as u32 - 1)
    }

    fn real(&mut self, op: Op) -> Value {
        self.node(op, Type::Real)
    }

    fn constant(&mut self, x: f64) -> Value {
        self.real(Op::Real(x.to_bits()))
    }

    fn int(&mut self, i: i64) -> Value {
        self.node(Op::Int(i), Type::Int)
    }

    fn returns(mut self, results: &[Value]) -> Function {
        self.0.results = results.to_vec();
        self.0.result_names = (0..results.len()).map(|i| format!("r{i}")).collect();
        self.0
    }
}

/// Code without its texts.
fn compiled(
    module: &Module,
    kernels: &[KernelShape],
    routines: &[FunctionId],
    options: Options,
) -> Result<Code, JitError> {
    Code::compile(module, kernels, routines, options, Workers::ONE).map(|(code, _)| code)
}

/// A function's code with its types.
struct Native {
    code: Code,
    results: Vec<Type>,
}

impl Native {
    fn new(module: &Module, id: FunctionId) -> Native {
        Native::with(module, id, OPTIONS)
    }

    fn with(module: &Module, id: FunctionId, options: Options) -> Native {
        let code = compiled(module, &[], &[id], options).expect("it compiles");
        Native { code, results: module.function(id).result_types() }
    }

    fn call(&self, arguments: &[Scalar], limits: Limits) -> Result<Vec<Scalar>, Trap> {
        let words: Vec<u64> = arguments.iter().map(|x| word(*x)).collect();
        let mut results = vec![0; self.results.len()];
        self.code.call(0, &words, &mut results, limits)?;
        Ok(results.iter().zip(&self.results).map(|(w, ty)| unword(*w, *ty)).collect())
    }
}

fn word(x: Scalar) -> u64 {
    match x {
        Scalar::Real(x) => x.to_bits(),
        Scalar::Int(i) => i as u64,
        Scalar::Bool(b) => u64::from(b),
    }
}

fn unword(word: u64, ty: Type) -> Scalar {
    match ty {
        Type::Real => Scalar::Real(f64::from_bits(word)),
        Type::Int => Scalar::Int(word as i64),
        Type::Bool => Scalar::Bool(word != 0),
        Type::Multi => panic!("no result is Multi"),
    }
}

/// Equal to the bit; all NaN are one.
fn same(a: Scalar, b: Scalar) -> bool {
    match (a, b) {
        (Scalar::Real(a), Scalar::Real(b)) => a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
        (a, b) => a == b,
    }
}
