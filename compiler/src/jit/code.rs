//! Finished machine code, and the only place that calls it.

use super::compiler::{Compiler, Finished, JitError, KernelShape, Listing, Options, Output};
use super::context::{Context, Limits, Trap};
use super::memory::CodeMemory;
use crate::ir::{FunctionId, Module};
use crate::workers::Workers;
use std::borrow::Cow;

/// Machine code of functions of one IR module: routines, which run once, and kernels, which run over many points. Freed
/// when dropped; may be run by several threads at once.
pub struct Code {
    kernels: Vec<Kernel>,
    routines: Vec<Routine>,
    /// The memory that the addresses above point to.
    _memories: Vec<CodeMemory>,
}

/// The address of a compiled function.
#[derive(Clone, Copy)]
pub(super) struct Address(pub(super) *const u8);

// SAFETY: it is of code, which nothing changes while the memory is there, and which changes nothing but its arguments.
unsafe impl Send for Address {}
// SAFETY: as above.
unsafe impl Sync for Address {}

/// A compiled function that takes and gives 64-bit words.
pub(super) struct Routine {
    pub(super) address: Address,
    pub(super) arguments: usize,
    pub(super) results: usize,
    /// Words that it writes: the results, and behind them what lies between its pieces.
    pub(super) words: usize,
}

/// A compiled loop over points.
pub(super) struct Kernel {
    pub(super) address: Address,
    pub(super) shape: KernelShape,
    /// Values that each point has of its own.
    pub(super) values: usize,
    pub(super) results: usize,
    /// Points that are computed at once: 1 or 2.
    pub(super) lanes: usize,
}

/// The points at which a kernel is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Number of points.
    pub count: usize,
    /// The arguments after the captures: the first one of every point, then the second of every point, and so on.
    pub values: &'a [f64],
}

/// A kernel stopped early. It may have written results of other points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped {
    /// Why.
    pub trap: Trap,
    /// At which point.
    pub point: usize,
}

/// `(context, arguments, results) -> status`.
type RoutineFunction = unsafe extern "C" fn(*mut Context, *const u64, *mut u64) -> u32;

/// `(context, captures, values, stride, n, out) -> status`.
type KernelFunction = unsafe extern "C" fn(*mut Context, *const f64, *const f64, i64, i64, *mut f64) -> u32;

/// Nodes below which compiling in a partition of its own takes longer than it saves.
const WORTH_A_PARTITION: usize = 60;

/// A routine is compiled in about this part of the time that a kernel of its size takes.
const ROUTINE_COST: usize = 4;

impl Code {
    /// Compiles functions of a valid module, with what they call. Gives the texts too, where the options ask for them.
    ///
    /// # Errors
    /// [`JitError`]; of several the first one, in the order of kernels and then routines.
    pub fn compile(
        module: &Module,
        kernels: &[KernelShape],
        routines: &[FunctionId],
        options: Options,
        workers: Workers,
    ) -> Result<(Code, Vec<Listing>), JitError> {
        // Texts are in the order of what was asked for.
        let workers = if options.listings { Workers::ONE } else { workers };
        let partitions = partitions(module, kernels, routines, workers.count);
        let compiled = workers.map(&partitions, |partition| partition.compile(module, kernels, options));
        if let Some((_, error)) = compiled.iter().filter_map(|c| c.as_ref().err()).min_by_key(|(place, _)| *place) {
            return Err(error.clone());
        }
        let mut code = Code { kernels: Vec::new(), routines: Vec::new(), _memories: Vec::new() };
        let (mut placed, mut listings) = (Vec::new(), Vec::new());
        for (partition, finished) in partitions.iter().zip(compiled.into_iter().flatten()) {
            placed.extend(partition.kernels.iter().zip(finished.kernels));
            code.routines.extend(finished.routines);
            code._memories.push(finished.memory);
            listings.extend(finished.listings);
        }
        placed.sort_by_key(|(place, _)| *place);
        code.kernels = placed.into_iter().map(|(_, kernel)| kernel).collect();
        Ok((code, listings))
    }

    /// Runs a routine on words: the bits of reals, integers, 0 or 1 for truth values.
    ///
    /// # Errors
    /// The trap that stopped it; the results are then not written.
    ///
    /// # Panics
    /// If there is no such routine, or `arguments` or `results` do not have its lengths.
    pub fn call(&self, routine: usize, arguments: &[u64], results: &mut [u64], limits: Limits) -> Result<(), Trap> {
        let routine = &self.routines[routine];
        assert_eq!(arguments.len(), routine.arguments, "length of a routine's arguments");
        assert_eq!(results.len(), routine.results, "length of a routine's results");
        let mut context = Context::new(limits);
        let mut words = vec![0; routine.words];
        // SAFETY: a routine was compiled with this signature (`Compiler::routine`), and its code lives as long as
        // `self`. It reads the arguments, whose length is asserted, and writes its words, which are as many as it was
        // compiled for, and reads and writes the context, which is alive and not shared.
        let status = unsafe {
            let function = std::mem::transmute::<*const u8, RoutineFunction>(routine.address.0);
            function(&raw mut context, arguments.as_ptr(), words.as_mut_ptr())
        };
        Trap::check(status)?;
        results.copy_from_slice(&words[..routine.results]);
        Ok(())
    }

    /// Runs a routine of reals.
    ///
    /// # Errors
    /// As [`Code::call`].
    ///
    /// # Panics
    /// As [`Code::call`].
    pub fn call_reals(&self, routine: usize, arguments: &[f64], limits: Limits) -> Result<Vec<f64>, Trap> {
        let arguments: Vec<u64> = arguments.iter().map(|x| x.to_bits()).collect();
        let mut results = vec![0; self.routines[routine].results];
        self.call(routine, &arguments, &mut results, limits)?;
        Ok(results.into_iter().map(f64::from_bits).collect())
    }

    /// Runs a kernel over points. `out` has the kernel's results for every point, one point after the other; or, where
    /// it accumulates, one set of results to which sums are added (those of the even points and of the odd points, so
    /// that they do not depend on the lanes). `limits` are for each point.
    ///
    /// # Errors
    /// The trap and the point that stopped it.
    ///
    /// # Panics
    /// If there is no such kernel, or a slice does not have the length that its shape asks for.
    pub fn run(
        &self,
        kernel: usize,
        captures: &[f64],
        points: Points<'_>,
        out: &mut [f64],
        limits: Limits,
    ) -> Result<(), Stopped> {
        let kernel = &self.kernels[kernel];
        assert_eq!(captures.len(), kernel.shape.captures, "length of a kernel's captures");
        let captures = &kernel.in_lanes(captures)[..];
        let Points { count, values } = points;
        let whole = count - count % kernel.lanes;
        let located = |Stopped { trap, point }: Stopped| {
            // Each of the two points is run alone to find the one that stopped.
            let both = if kernel.lanes == 2 { point..point + 2 } else { 0..0 };
            let alone = |point| Some(Stopped { trap: kernel.run_alone(captures, points, point, limits).err()?, point });
            both.into_iter().find_map(alone).unwrap_or(Stopped { trap, point })
        };
        let run_last = || {
            let last = kernel.run_alone(captures, points, count - 1, limits);
            last.map_err(|trap| Stopped { trap, point: count - 1 })
        };
        if kernel.shape.output == Output::Store {
            assert_eq!(Some(out.len()), kernel.results.checked_mul(count), "length of a kernel's output");
            let (paired, rest) = out.split_at_mut(whole * kernel.results);
            kernel.run(captures, values, [count, whole], paired, limits).map_err(located)?;
            if whole < count {
                rest.copy_from_slice(&run_last()?[..kernel.results]);
            }
            return Ok(());
        }
        assert_eq!(out.len(), kernel.results, "length of a kernel's output");
        let mut sums = vec![0.0; 2 * kernel.results];
        kernel.run(captures, values, [count, whole], &mut sums, limits).map_err(located)?;
        if whole < count {
            let last = run_last()?;
            (0..sums.len()).step_by(2).for_each(|k| sums[k] += last[k]);
        }
        out.iter_mut().zip(sums.chunks_exact(2)).for_each(|(out, halves)| *out += halves[0] + halves[1]);
        Ok(())
    }
}

impl Kernel {
    /// Captures as often as there are lanes.
    fn in_lanes<'c>(&self, captures: &'c [f64]) -> Cow<'c, [f64]> {
        if self.lanes == 1 {
            return Cow::Borrowed(captures);
        }
        captures.iter().flat_map(|capture| [*capture; 2]).collect()
    }

    /// Runs over the first `n` of `stride` points, with captures for all lanes; `n` is a multiple of the lanes. Results
    /// of points are stored one after the other; sums of even and odd points side by side.
    fn run(
        &self,
        captures: &[f64],
        values: &[f64],
        [stride, n]: [usize; 2],
        out: &mut [f64],
        limits: Limits,
    ) -> Result<(), Stopped> {
        let outputs =
            if self.shape.output == Output::Store { self.results.checked_mul(n) } else { Some(2 * self.results) };
        assert_eq!(captures.len(), self.lanes * self.shape.captures, "length of a kernel's captures");
        assert_eq!(Some(values.len()), self.values.checked_mul(stride), "length of the points' values");
        assert!(n <= stride && n % self.lanes == 0 && Some(out.len()) == outputs, "whole pairs of points");
        let mut context = Context::new(limits);
        // SAFETY: a kernel was compiled with this signature (`Compiler::kernel`), and its code lives as long as the
        // `Code` that has it. It reads the captures and `n` of each `stride` values, and writes the results of `n`
        // points, or two sums of each: the slices have these lengths (asserted; they are those of slices, so that they
        // fit in i64). It reads and writes the context, which is alive and not shared.
        let status = unsafe {
            let function = std::mem::transmute::<*const u8, KernelFunction>(self.address.0);
            let (captures, values) = (captures.as_ptr(), values.as_ptr());
            function(&raw mut context, captures, values, stride as i64, n as i64, out.as_mut_ptr())
        };
        Trap::check(status).map_err(|trap| Stopped { trap, point: context.point as usize })
    }

    /// Runs one point in both of two lanes, with captures for all lanes.
    fn run_alone(&self, captures: &[f64], points: Points<'_>, index: usize, limits: Limits) -> Result<Vec<f64>, Trap> {
        let value = |k: usize| [points.values[k * points.count + index]; 2];
        let values: Vec<f64> = (0..self.values).flat_map(value).collect();
        let mut out = vec![0.0; 2 * self.results];
        self.run(captures, &values, [2; 2], &mut out, limits).map_err(|stopped| stopped.trap)?;
        Ok(out)
    }
}

/// The functions that one worker compiles.
#[derive(Clone, Default)]
struct Partition<'a> {
    /// Places of kernels, ascending.
    kernels: Vec<usize>,
    routines: &'a [FunctionId],
}

/// Divides the work: the largest kernels first, each to the partition with the least work so far.
fn partitions<'a>(
    module: &Module,
    kernels: &[KernelShape],
    routines: &'a [FunctionId],
    count: usize,
) -> Vec<Partition<'a>> {
    let size = |f: FunctionId| module.function(f).nodes.len();
    let all: usize = kernels.iter().map(|k| size(k.function)).sum();
    let count = count.min(all / WORTH_A_PARTITION).clamp(1, kernels.len().max(1));
    let mut loads = vec![0; count];
    loads[0] = routines.iter().map(|r| size(*r)).sum::<usize>() / ROUTINE_COST;
    let mut largest: Vec<usize> = (0..kernels.len()).collect();
    largest.sort_by_key(|place| std::cmp::Reverse(size(kernels[*place].function)));
    let mut partitions = vec![Partition::default(); count];
    partitions[0].routines = routines;
    for place in largest {
        let least = (0..count).min_by_key(|partition| loads[*partition]).unwrap_or(0);
        loads[least] += size(kernels[place].function);
        partitions[least].kernels.push(place);
    }
    partitions.iter_mut().for_each(|partition| partition.kernels.sort_unstable());
    partitions
}

impl Partition<'_> {
    /// An error has its place among all that was asked for, routines after kernels.
    fn compile(
        &self,
        module: &Module,
        shapes: &[KernelShape],
        options: Options,
    ) -> Result<Finished, (usize, JitError)> {
        let mut compiler = Compiler::new(module, options).map_err(|e| (0, e))?;
        // Kernels first: functions that they share with routines are compiled to run fast.
        for place in &self.kernels {
            compiler.kernel(shapes[*place]).map_err(|e| (*place, e))?;
        }
        for (place, function) in self.routines.iter().enumerate() {
            compiler.routine(*function).map_err(|e| (shapes.len() + place, e))?;
        }
        compiler.finish().map_err(|e| (usize::MAX, e))
    }
}
