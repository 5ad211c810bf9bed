//! Finished machine code, and the only place that calls it.

use super::compiler::{Entry, EntryKind, GridKernel, Kernel, Output, Routine};
use super::context::{Context, Limits, Stop};
use super::grid::Arguments;
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
    /// Weights, one point after the other, for kernels that take them; else empty.
    pub w: &'a [f64],
}

/// A grid: values of its rows and of its columns.
#[derive(Clone, Copy, Debug)]
pub struct GridTables<'a> {
    /// How many rows there are; at least one.
    pub row_count: usize,
    /// Values of each row, one row after the other.
    pub rows: &'a [f64],
    /// How many columns there are; at least one. Two at once: at least two, and even where the kernel sums.
    pub column_count: usize,
    /// Values of each column, one column after the other. Two at once: of each pair of columns both of every value; the last pair of an odd
    /// number is of the last two.
    pub columns: &'a [f64],
    /// Weights of the points, row after row, for kernels that take them; else empty.
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
    unsafe extern "C" fn(*mut Context, *const f64, *const f64, *const f64, *const f64, i64, *mut f64) -> u32;

/// `(context, arguments) -> status`.
type GridFunction = unsafe extern "C" fn(*mut Context, *const Arguments) -> u32;

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
        assert!(matches!(entry.kind, EntryKind::Routine), "a routine of another program");
        assert_eq!((arguments.len(), results.len()), (entry.inputs, entry.results), "lengths of a routine's slices");
        let mut context = Context::new(limits);
        // SAFETY: a routine was compiled with this signature (`Compiler::routine`), and its code lives as
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
        let EntryKind::Kernel(shape) = entry.kind else { panic!("a kernel of another program") };
        let n = points.u.len();
        let outputs =
            if shape.output == Output::Accumulate { Some(entry.results) } else { entry.results.checked_mul(n) };
        assert_eq!(uniforms.len(), entry.inputs, "length of a kernel's uniforms");
        assert_eq!(points.v.len(), n, "length of v");
        assert_eq!(Some(points.w.len()), shape.weights.checked_mul(n), "length of w");
        assert_eq!(Some(out.len()), outputs, "length of a kernel's output");
        let mut context = Context::new(limits);
        // SAFETY: a kernel was compiled with this signature (`Compiler::kernel`), and its code lives as long
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

    /// Whether a kernel takes two columns at once.
    ///
    /// # Panics
    /// If it is not of this code.
    #[must_use]
    pub fn is_wide(&self, kernel: GridKernel) -> bool {
        matches!(self.entries[kernel.0 as usize].entry.kind, EntryKind::Grid(_, true))
    }

    /// Runs a kernel over a grid. It writes the results of every point, row after row; or, where it sums, the sums of every row, and
    /// adds to those of every column (in the order of `columns`).
    ///
    /// # Errors
    /// Why it stopped early.
    ///
    /// # Panics
    /// If a slice does not have the length that the kernel's shape asks for, or it is not of this code.
    pub fn run_grid(
        &self,
        kernel: GridKernel,
        uniforms: &[f64],
        tables: GridTables<'_>,
        out: &mut [f64],
        column_sums: &mut [f64],
        limits: Limits,
    ) -> Result<(), Stop> {
        let Callable { entry, address } = &self.entries[kernel.0 as usize];
        let EntryKind::Grid(shape, wide) = entry.kind else { panic!("a grid kernel of another program") };
        let GridTables { row_count, column_count, .. } = tables;
        let points = row_count.checked_mul(column_count);
        assert!(row_count > 0 && column_count > usize::from(wide), "a grid of points");
        let stored = if wide { column_count.next_multiple_of(2) } else { column_count };
        assert_eq!(uniforms.len(), entry.inputs, "length of a kernel's uniforms");
        assert_eq!(Some(tables.rows.len()), row_count.checked_mul(shape.row_values), "values of rows");
        assert_eq!(Some(tables.columns.len()), stored.checked_mul(shape.column_values), "values of columns");
        let (written, summed, weights) = match shape.row_sums {
            None => (points.and_then(|n| n.checked_mul(entry.results)), Some(0), Some(0)),
            Some(n) => (row_count.checked_mul(n), column_count.checked_mul(entry.results - n), points),
        };
        assert!(shape.row_sums.is_none() || stored == column_count, "an even number of columns");
        assert_eq!(Some(out.len()), written, "length of a kernel's output");
        assert_eq!(Some(column_sums.len()), summed, "length of the columns' sums");
        assert_eq!(Some(tables.w.len()), weights, "length of w");
        let point_bytes = shape.point_bytes(entry.results);
        let mut context = Context::new(limits);
        let arguments = Arguments {
            uniforms: uniforms.as_ptr(),
            rows: tables.rows.as_ptr(),
            columns: tables.columns.as_ptr(),
            weights: tables.w.as_flattened().as_ptr(),
            out: out.as_mut_ptr(),
            column_sums: column_sums.as_mut_ptr(),
            row_count: row_count as i64,
            row_bytes: (column_count * point_bytes) as i64,
            last: ((column_count - if wide { 2 } else { 1 }) * point_bytes) as i64,
        };
        // SAFETY: an entry of this kind was compiled with this signature (`Compiler::grid`), and its code lives as long as
        // `self`. It reads the uniforms, the tables and, if it takes them, the weights, and writes the results of every
        // point, or the sums of rows and columns: the slices have these lengths (asserted; with two columns at once the last pair of
        // an odd number is written where the last two columns are). The context is alive and not shared.
        let status = unsafe {
            let function = std::mem::transmute::<*const u8, GridFunction>(*address);
            function(&raw mut context, &raw const arguments)
        };
        if status == 0 { Ok(()) } else { Err(Stop::from_status(status)) }
    }
}
