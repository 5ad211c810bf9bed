//! One suite for everything that runs functions: interpreter and native code agree to the bit.
//!
//! [`Evaluator`] has two implementations. Every case runs on both: each operation at special values (`operations`), the
//! language tests and the examples (`scripts`). Results that the language defines are stated here, independently of
//! both.

mod operations;
mod scripts;

use gml_compiler::Workers;
use gml_compiler::internals::ir::interpret::{self, RunError};
use gml_compiler::internals::ir::scalar::Scalar;
use gml_compiler::internals::ir::{FunctionId, Module, Type};
use gml_compiler::internals::jit::{Code, Options};
use gml_compiler::program::{Limits, Trap};

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    /// A guard failed; the index of its failure.
    Failure(u32),
    Steps,
    Depth,
}

type Outcome = Result<Vec<Scalar>, Fault>;

/// Runs functions of a module.
trait Evaluator<'m> {
    /// Prepares these functions.
    fn new(module: &'m Module, functions: &[FunctionId]) -> Self;

    /// Runs one of them.
    fn call(&self, function: FunctionId, arguments: &[Scalar]) -> Outcome;
}

/// The interpreter, node by node.
struct Interpreter<'m>(&'m Module);

impl<'m> Evaluator<'m> for Interpreter<'m> {
    fn new(module: &'m Module, _: &[FunctionId]) -> Interpreter<'m> {
        Interpreter(module)
    }

    fn call(&self, function: FunctionId, arguments: &[Scalar]) -> Outcome {
        interpret::run(self.0, function, arguments, interpret::Limits::default()).map_err(|e| match e {
            RunError::Failed(failure) => Fault::Failure(failure.0),
            RunError::Steps(_) | RunError::Memory(_) => Fault::Steps,
            RunError::Depth(_) => Fault::Depth,
            RunError::Interrupted(_) | RunError::Malformed(_) => panic!("{e} in {}", self.0.function(function).name),
        })
    }
}

/// Machine code.
struct Native<'m> {
    module: &'m Module,
    code: Code,
    /// The functions, in the order of the code's routines.
    functions: Vec<FunctionId>,
}

impl<'m> Evaluator<'m> for Native<'m> {
    fn new(module: &'m Module, functions: &[FunctionId]) -> Native<'m> {
        let options = Options { verify: true, ..Options::default() };
        let (code, _) = Code::compile(module, &[], functions, options, Workers::ONE).expect("it compiles");
        Native { module, code, functions: functions.to_vec() }
    }

    fn call(&self, function: FunctionId, arguments: &[Scalar]) -> Outcome {
        let routine = self.functions.iter().position(|f| *f == function).expect("one that was compiled");
        let words: Vec<u64> = arguments.iter().map(|x| word(*x)).collect();
        let types = self.module.function(function).result_types();
        let mut results = vec![0; types.len()];
        self.code.call(routine, &words, &mut results, Limits::default()).map_err(|trap| match trap {
            Trap::Failure(failure) => Fault::Failure(failure.0),
            Trap::Steps => Fault::Steps,
            Trap::Depth => Fault::Depth,
        })?;
        Ok(results.into_iter().zip(types).map(|(word, ty)| scalar(word, ty)).collect())
    }
}

fn word(x: Scalar) -> u64 {
    match x {
        Scalar::Real(x) => x.to_bits(),
        Scalar::Int(i) => i.cast_unsigned(),
        Scalar::Bool(b) => u64::from(b),
    }
}

fn scalar(word: u64, ty: Type) -> Scalar {
    match ty {
        Type::Real => Scalar::Real(f64::from_bits(word)),
        Type::Int => Scalar::Int(word.cast_signed()),
        Type::Bool => Scalar::Bool(word != 0),
        Type::Multi => panic!("no result is Multi"),
    }
}

/// Equality to the bit; the payload of a NaN does not matter.
fn same(a: Scalar, b: Scalar) -> bool {
    match (a, b) {
        (Scalar::Real(a), Scalar::Real(b)) => a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
        (a, b) => a == b,
    }
}

fn same_outcome(a: &Outcome, b: &Outcome) -> bool {
    match (a, b) {
        (Ok(a), Ok(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b)),
        (a, b) => a == b,
    }
}

/// Functions of a module, and their arguments.
struct Case {
    name: String,
    module: Module,
    runs: Vec<(FunctionId, Vec<Scalar>)>,
}

/// The results of the runs of a case.
fn outcomes<'m, E: Evaluator<'m>>(case: &'m Case) -> Vec<Outcome> {
    let mut functions: Vec<FunctionId> = case.runs.iter().map(|(f, _)| *f).collect();
    functions.sort_unstable();
    functions.dedup();
    let evaluator = E::new(&case.module, &functions);
    case.runs.iter().map(|(f, arguments)| evaluator.call(*f, arguments)).collect()
}

/// Runs a case on both evaluators; returns the number of runs that gave results.
fn conforms(case: &Case) -> usize {
    let (interpreted, native) = (outcomes::<Interpreter<'_>>(case), outcomes::<Native<'_>>(case));
    for (k, (a, b)) in interpreted.iter().zip(&native).enumerate() {
        let (f, arguments) = &case.runs[k];
        let name = &case.module.function(*f).name;
        assert!(same_outcome(a, b), "{}: {name}{arguments:?}: {a:?} interpreted, {b:?} native", case.name);
    }
    interpreted.iter().filter(|o| o.is_ok()).count()
}
