//! Finished machine code, and the only place that calls it.

use super::compiler::{Entry, Kernel, Output, Routine};
use super::context::{Context, Limits, Stop};
use super::memory::CodeMemory;

/// Machine code of a program. Freed when dropped.
pub struct Code {
    entries: Vec<Callable>,
    /// Keeps the code of `entries`.
    _memory: CodeMemory,
}

struct Callable {
    entry: Entry,
    address: *const u8,
}

// SAFETY: the addresses are of code, which nothing changes until `_memory` is dropped, and which changes nothing but
// its arguments; the memory itself is `Send` and `Sync`.
unsafe impl Send for Code {}
// SAFETY: as above.
unsafe impl Sync for Code {}

/// Places at which a kernel is evaluated; all of one length.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// First surface parameter.
    pub u: &'a [f64],
    /// Second surface parameter.
    pub v: &'a [f64],
    /// Weights, for kernels that take them; else empty.
    pub w: &'a [[f64; 3]],
}

/// A kernel stopped early. What it wrote for the points before is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped {
    /// Why.
    pub stop: Stop,
    /// At which point.
    pub point: usize,
}

/// `(context, arguments, results) -> status`.
type PlainFunction = unsafe extern "C" fn(*mut Context, *const u64, *mut u64) -> u32;

/// `(context, uniforms, u, v, w, n, out) -> status`.
type KernelFunction =
    unsafe extern "C" fn(*mut Context, *const f64, *const f64, *const f64, *const [f64; 3], i64, *mut f64) -> u32;

impl Code {
    /// The entries must be finalized functions of the memory, with the signatures that their kind has.
    pub(super) fn new(memory: CodeMemory, entries: &[Entry]) -> Code {
        let address = |e: &Entry| memory.module().get_finalized_function(e.function);
        let entries = entries.iter().map(|e| Callable { entry: e.clone(), address: address(e) }).collect();
        Code { entries, _memory: memory }
    }

    /// Runs a routine on words: the bits of reals, integers, 0 or 1 for truth values.
    ///
    /// # Errors
    /// Why it stopped early; the results are then not written.
    ///
    /// # Panics
    /// If `arguments` or `results` do not have the routine's lengths, or it is not of this code.
    pub fn call(&self, routine: Routine, arguments: &[u64], results: &mut [u64], limits: Limits) -> Result<(), Stop> {
        let Callable { entry, address } = &self.entries[routine.0 as usize];
        assert!(entry.shape.is_none(), "a routine of another program");
        assert_eq!((arguments.len(), results.len()), (entry.inputs, entry.results), "lengths of a routine's slices");
        let mut context = Context::new(limits);
        // SAFETY: an entry without a shape was compiled with this signature (`Compiler::routine`), and its code lives as
        // long as `self`. It reads `inputs` words and writes `results` words, which the slices have (asserted), and
        // reads and writes the context, which is alive and not shared.
        let status = unsafe {
            let function = std::mem::transmute::<*const u8, PlainFunction>(*address);
            function(&raw mut context, arguments.as_ptr(), results.as_mut_ptr())
        };
        if status == 0 { Ok(()) } else { Err(Stop::from_status(status)) }
    }

    /// Runs a routine of reals.
    ///
    /// # Errors
    /// As [`Code::call`].
    ///
    /// # Panics
    /// As [`Code::call`].
    pub fn call_reals(&self, routine: Routine, arguments: &[f64], limits: Limits) -> Result<Vec<f64>, Stop> {
        let arguments: Vec<u64> = arguments.iter().map(|x| x.to_bits()).collect();
        let mut results = vec![0; self.entries[routine.0 as usize].entry.results];
        self.call(routine, &arguments, &mut results, limits)?;
        Ok(results.into_iter().map(f64::from_bits).collect())
    }

    /// Runs a kernel over points. `out` has the kernel's results for every point, one point after the other; or, where
    /// it accumulates, one set of results to which is added. `limits` are for each point.
    ///
    /// # Errors
    /// Why and where it stopped early.
    ///
    /// # Panics
    /// If a slice does not have the length that the kernel's shape asks for, or it is not of this code.
    pub fn run(
        &self,
        kernel: Kernel,
        uniforms: &[f64],
        points: Points<'_>,
        out: &mut [f64],
        limits: Limits,
    ) -> Result<(), Stopped> {
        let Callable { entry, address } = &self.entries[kernel.0 as usize];
        let shape = entry.shape.expect("a kernel of another program");
        let n = points.u.len();
        let outputs =
            if shape.output == Output::Accumulate { Some(entry.results) } else { entry.results.checked_mul(n) };
        assert_eq!(uniforms.len(), entry.inputs, "length of a kernel's uniforms");
        assert_eq!(points.v.len(), n, "length of v");
        assert_eq!(points.w.len(), if shape.weights { n } else { 0 }, "length of w");
        assert_eq!(Some(out.len()), outputs, "length of a kernel's output");
        let mut context = Context::new(limits);
        // SAFETY: an entry with a shape was compiled with this signature (`Compiler::kernel`), and its code lives as long
        // as `self`. It reads `inputs` uniforms, n entries of u, v and, with weights, of w, and writes the results of
        // every point, or of one where it accumulates: the slices have these lengths (asserted). It reads and writes the
        // context, which is alive and not shared. n is a slice's length, so that it fits in i64.
        let status = unsafe {
            let function = std::mem::transmute::<*const u8, KernelFunction>(*address);
            let (u, v, w) = (points.u.as_ptr(), points.v.as_ptr(), points.w.as_ptr());
            function(&raw mut context, uniforms.as_ptr(), u, v, w, n as i64, out.as_mut_ptr())
        };
        if status == 0 {
            return Ok(());
        }
        Err(Stopped { stop: Stop::from_status(status), point: context.point as usize })
    }
}
