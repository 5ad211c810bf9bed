//! Machine code of many functions, made on several threads.

use super::code::Code;
use super::compiler::{Compiler, JitError, Kernel, KernelShape, Listing, Options, Routine};
use crate::ir::{FunctionId, Module};
use std::thread;

/// Kernels and routines of one module, by their places among those that were asked for.
pub struct CodeSet {
    /// One of each thread that compiled.
    codes: Vec<Code>,
    /// Which of `codes` has each kernel.
    kernels: Vec<(u32, Kernel)>,
    /// All in the first of `codes`.
    routines: Vec<Routine>,
}

/// Nodes below which another thread takes longer to start than it saves.
const WORTH_A_THREAD: usize = 200;

/// Threads at most: the stages before take longer than code does on this many.
const MOST_THREADS: usize = 8;

/// A routine is made in about this part of the time that a kernel of its size takes.
const ROUTINE_COST: usize = 4;

impl CodeSet {
    /// Compiles functions of a valid module, with what they call. What a thread compiles does not depend on what the others do: the
    /// result is that of one thread. Gives the texts too, where the options ask for them.
    ///
    /// # Errors
    /// [`JitError`]; of several the first one.
    pub fn compile(
        module: &Module,
        kernels: &[KernelShape],
        routines: &[FunctionId],
        options: Options,
    ) -> Result<(CodeSet, Vec<Listing>), JitError> {
        // One thread's texts are in the order of what was asked for.
        let threads = if options.listings { 1 } else { threads() };
        CodeSet::compile_on(threads, module, kernels, routines, options)
    }

    /// As [`CodeSet::compile`], on so many threads at most.
    pub(super) fn compile_on(
        threads: usize,
        module: &Module,
        kernels: &[KernelShape],
        routines: &[FunctionId],
        options: Options,
    ) -> Result<(CodeSet, Vec<Listing>), JitError> {
        let shares = shares(module, kernels, routines, threads);
        let share = |routines: &[FunctionId], share: &[usize]| compile(module, kernels, share, routines, options);
        let share = &share;
        let made: Vec<_> = thread::scope(|scope| {
            let start = |own| thread::Builder::new().spawn_scoped(scope, move || share(&[], own));
            let others: Vec<_> = shares[1..].iter().map(|own| start(own)).collect();
            let mut made = vec![share(routines, &shares[0])];
            for (own, other) in shares[1..].iter().zip(others) {
                made.push(match other {
                    Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
                    // Where the system gives no more threads, this one does their work.
                    Err(_) => share(&[], own),
                });
            }
            made
        });
        let mut set = CodeSet { codes: Vec::new(), kernels: vec![(0, Kernel(0)); kernels.len()], routines: Vec::new() };
        let mut listings = Vec::new();
        if let Some(first) = made.iter().filter_map(|m| m.as_ref().err()).min_by_key(|(place, _)| *place) {
            return Err(first.1.clone());
        }
        for (index, (share, own)) in made.into_iter().flatten().zip(&shares).enumerate() {
            for (place, kernel) in own.iter().zip(share.kernels) {
                set.kernels[*place] = (index as u32, kernel);
            }
            set.codes.push(share.code);
            set.routines.extend(share.routines);
            listings.extend(share.listings);
        }
        Ok((set, listings))
    }

    /// A kernel, with the code that has it.
    ///
    /// # Panics
    /// If there are not as many.
    #[must_use]
    pub fn kernel(&self, place: usize) -> (&Code, Kernel) {
        let (code, kernel) = self.kernels[place];
        (&self.codes[code as usize], kernel)
    }

    /// A routine, with the code that has it.
    ///
    /// # Panics
    /// If there are not as many.
    #[must_use]
    pub fn routine(&self, place: usize) -> (&Code, Routine) {
        (&self.codes[0], self.routines[place])
    }
}

/// What one thread makes.
struct Share {
    code: Code,
    kernels: Vec<Kernel>,
    routines: Vec<Routine>,
    listings: Vec<Listing>,
}

fn threads() -> usize {
    thread::available_parallelism().map_or(1, |n| n.get().min(MOST_THREADS))
}

/// The places of the kernels that each thread compiles, in ascending order: the largest first, each to the thread that has least to do.
fn shares(module: &Module, kernels: &[KernelShape], routines: &[FunctionId], threads: usize) -> Vec<Vec<usize>> {
    let size = |f: FunctionId| module.function(f).nodes.len();
    let all: usize = kernels.iter().map(|k| size(k.function)).sum();
    let threads = threads.min(all / WORTH_A_THREAD).clamp(1, kernels.len().max(1));
    let mut loads = vec![0; threads];
    loads[0] = routines.iter().map(|r| size(*r)).sum::<usize>() / ROUTINE_COST;
    let mut largest: Vec<usize> = (0..kernels.len()).collect();
    largest.sort_by_key(|place| std::cmp::Reverse(size(kernels[*place].function)));
    let mut shares = vec![Vec::new(); threads];
    for place in largest {
        let least = (0..threads).min_by_key(|t| loads[*t]).unwrap_or(0);
        loads[least] += size(kernels[place].function);
        shares[least].push(place);
    }
    shares.iter_mut().for_each(|share| share.sort_unstable());
    shares
}

/// Compiles some of the kernels; an error has its place among all that was asked for, routines after kernels.
fn compile(
    module: &Module,
    kernels: &[KernelShape],
    share: &[usize],
    routines: &[FunctionId],
    options: Options,
) -> Result<Share, (usize, JitError)> {
    let mut compiler = Compiler::new(module, options).map_err(|e| (0, e))?;
    // Kernels first: functions that they share with routines are compiled to run fast.
    let mut kernel = |place: &usize| compiler.kernel(kernels[*place]).map_err(|e| (*place, e));
    let made = share.iter().map(&mut kernel).collect::<Result<_, _>>()?;
    let mut routine = |(place, f): (usize, &FunctionId)| compiler.routine(*f).map_err(|e| (kernels.len() + place, e));
    let routines = routines.iter().enumerate().map(&mut routine).collect::<Result<_, _>>()?;
    let listings = compiler.listings().to_vec();
    let code = compiler.finish().map_err(|e| (usize::MAX, e))?;
    Ok(Share { code, kernels: made, routines, listings })
}
