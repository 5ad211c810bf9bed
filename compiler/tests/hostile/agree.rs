//! The interpreter of the functions as they were lowered, and machine code, on damaged scripts.

use gml_compiler::internals::diff::expand;
use gml_compiler::internals::ir::interpret::{Limits, RunError, run_real};
use gml_compiler::internals::ir::{FunctionId, LoweredPart, Module};
use gml_compiler::program::{Order, Program, Sites};

/// Relative difference of points that agree: sums are formed in another order.
const CLOSE: f64 = 1e-6;

/// Numbers beyond this may overflow in one order of operations and not in another one.
const LARGE: f64 = 1e100;

/// Compares the points of the first parts at the defaults; an error names what differs.
pub(crate) fn hold(mut module: Module, parts: &[LoweredPart], program: &Program) -> Result<(), String> {
    let x = program.defaults();
    let Ok(instance) = program.instantiate(&x) else { return Ok(()) };
    let surfaces: Vec<FunctionId> = parts.iter().map(|p| p.surface.function).collect();
    if expand(&mut module, &surfaces).is_err() {
        return Ok(());
    }
    let limits = Limits { steps: 100_000, depth: 200, ..Limits::default() };
    for (k, part) in parts.iter().enumerate().take(3) {
        for uv in [[0.31, 0.62], [0.77, 0.12]] {
            let surface = &part.surface;
            let read = run_real(&module, surface.function, &surface.arguments(&x, &uv), limits);
            let mut point = [0.0; 3];
            let ran = instance.evaluate(k, Sites::Scattered(&uv[..1], &uv[1..]), Order::Points, &mut point);
            match (read, ran) {
                (Ok(read), Ok(())) if !agree(&read, &point) => {
                    return Err(format!("part {k} at {uv:?}: the interpreter has {read:?}, machine code {point:?}"));
                }
                // The two count their steps differently.
                (Err(RunError::Steps(_) | RunError::Depth(_) | RunError::Memory(_)), _) => {}
                (Err(read), Ok(())) => {
                    return Err(format!(
                        "part {k} at {uv:?}: the interpreter fails ({read}), machine code has {point:?}"
                    ));
                }
                // Machine code refuses points that are not finite.
                (Ok(read), Err(_)) if !read.iter().all(|c| c.is_finite()) => {}
                (Ok(_), Err(ran)) if ran.sentence.contains("limit") => {}
                (Ok(read), Err(ran)) => {
                    return Err(format!(
                        "part {k} at {uv:?}: the interpreter has {read:?}, machine code fails: {ran:?}"
                    ));
                }
                _ => {}
            }
        }
    }
    Ok(())
}

fn agree(a: &[f64], b: &[f64]) -> bool {
    let size = a.iter().chain(b).fold(0.0, |size: f64, c| size.max(c.abs()));
    let tame = a.iter().chain(b).all(|c| c.is_finite() && c.abs() < LARGE);
    !tame || a.iter().zip(b).all(|(a, b)| (a - b).abs() <= CLOSE * (1.0 + size))
}
