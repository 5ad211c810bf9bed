//! Machine code of many functions, made in shares.

use super::code::Code;
use super::compiler::{Compiler, JitError, Kernel, KernelShape, Listing, Options, Routine};
use crate::ir::{FunctionId, Module};
use crate::workers::Workers;

/// Kernels and routines of one module, by their places among those that were asked for.
pub struct CodeSet {
    /// One of each share.
    codes: Vec<Code>,
    /// Which of `codes` has each kernel.
    kernels: Vec<(u32, Kernel)>,
    /// All in the first of `codes`.
    routines: Vec<Routine>,
}

/// Nodes below which a share of its own takes longer than it saves.
const WORTH_A_SHARE: usize = 60;

/// A routine is made in about this part of the time that a kernel of its size takes.
const ROUTINE_COST: usize = 4;

impl CodeSet {
    /// Compiles functions of a valid module, with what they call. Gives the texts too, where the options ask for them.
    ///
    /// # Errors
    /// [`JitError`]; of several the first one.
    pub fn compile(
        module: &Module,
        kernels: &[KernelShape],
        routines: &[FunctionId],
        options: Options,
        workers: Workers,
    ) -> Result<(CodeSet, Vec<Listing>), JitError> {
        // Texts are in the order of what was asked for.
        let workers = if options.listings { Workers::ONE } else { workers };
        let shares = shares(module, kernels, routines, workers.count);
        let made = workers.map(&shares, |share| compile(module, kernels, share, options));
        let mut set = CodeSet { codes: Vec::new(), kernels: vec![(0, Kernel(0)); kernels.len()], routines: Vec::new() };
        let mut listings = Vec::new();
        if let Some(first) = made.iter().filter_map(|m| m.as_ref().err()).min_by_key(|(place, _)| *place) {
            return Err(first.1.clone());
        }
        for (index, (made, share)) in made.into_iter().flatten().zip(&shares).enumerate() {
            for (place, kernel) in share.kernels.iter().zip(made.kernels) {
                set.kernels[*place] = (index as u32, kernel);
            }
            set.codes.push(made.code);
            set.routines.extend(made.routines);
            listings.extend(made.listings);
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

/// What one worker is to make.
#[derive(Clone, Default)]
struct Share<'a> {
    /// Places of kernels, ascending.
    kernels: Vec<usize>,
    routines: &'a [FunctionId],
}

/// What it has made.
struct Made {
    code: Code,
    kernels: Vec<Kernel>,
    routines: Vec<Routine>,
    listings: Vec<Listing>,
}

/// What each worker compiles: the largest kernels first, each by the one that has least to do.
fn shares<'a>(module: &Module, kernels: &[KernelShape], routines: &'a [FunctionId], count: usize) -> Vec<Share<'a>> {
    let size = |f: FunctionId| module.function(f).nodes.len();
    let all: usize = kernels.iter().map(|k| size(k.function)).sum();
    let count = count.min(all / WORTH_A_SHARE).clamp(1, kernels.len().max(1));
    let mut loads = vec![0; count];
    loads[0] = routines.iter().map(|r| size(*r)).sum::<usize>() / ROUTINE_COST;
    let mut largest: Vec<usize> = (0..kernels.len()).collect();
    largest.sort_by_key(|place| std::cmp::Reverse(size(kernels[*place].function)));
    let mut shares = vec![Share::default(); count];
    shares[0].routines = routines;
    for place in largest {
        let least = (0..count).min_by_key(|share| loads[*share]).unwrap_or(0);
        loads[least] += size(kernels[place].function);
        shares[least].kernels.push(place);
    }
    shares.iter_mut().for_each(|share| share.kernels.sort_unstable());
    shares
}

/// Compiles a share; an error has its place among all that was asked for, routines after kernels.
fn compile(
    module: &Module,
    kernels: &[KernelShape],
    share: &Share<'_>,
    options: Options,
) -> Result<Made, (usize, JitError)> {
    let mut compiler = Compiler::new(module, options).map_err(|e| (0, e))?;
    // Kernels first: functions that they share with routines are compiled to run fast.
    let mut kernel = |place: &usize| compiler.kernel(kernels[*place]).map_err(|e| (*place, e));
    let made = share.kernels.iter().map(&mut kernel).collect::<Result<_, _>>()?;
    let mut routine = |(place, f): (usize, &FunctionId)| compiler.routine(*f).map_err(|e| (kernels.len() + place, e));
    let routines = share.routines.iter().enumerate().map(&mut routine).collect::<Result<_, _>>()?;
    let listings = compiler.listings().to_vec();
    let code = compiler.finish().map_err(|e| (usize::MAX, e))?;
    Ok(Made { code, kernels: made, routines, listings })
}
