//! The context that generated code runs in, which has its budget, and the statuses that it returns.

use crate::ir::FailureId;
use std::mem::offset_of;

/// Bounds of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Iterations of loops and calls, for one evaluation or one point of a batch.
    pub steps: u32,
    /// Calls within calls.
    pub depth: u32,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { steps: 1_000_000, depth: 1_000 }
    }
}

/// Why generated code stopped early. (It never faults: this is a status that it returns.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trap {
    /// More steps than the limit.
    Steps,
    /// More calls within calls than the limit, or than the stack has room for.
    Depth,
    /// A guard did not hold.
    Failure(FailureId),
}

/// Statuses below this are of the code itself; a status from here on is a failure's index plus this.
pub(super) const FIRST_FAILURE: i64 = 3;
pub(super) const STEPS: i64 = 1;
pub(super) const DEPTH: i64 = 2;

impl Trap {
    /// The trap of a status.
    pub(super) fn check(status: u32) -> Result<(), Trap> {
        match i64::from(status) {
            0 => Ok(()),
            STEPS => Err(Trap::Steps),
            DEPTH => Err(Trap::Depth),
            s => Err(Trap::Failure(FailureId((s - FIRST_FAILURE) as u32))),
        }
    }
}

/// Bytes of stack that calls within calls may take. A thread that runs generated code needs this, [`MAX_FRAME`] and a
/// little for the host functions: well below the 2 MiB that threads get by default.
pub(super) const STACK: usize = 512 * 1024;

/// The largest stack frame of a generated function, in bytes. A function checks the stack after it has made its frame,
/// so that this much may lie beyond [`STACK`].
pub(super) const MAX_FRAME: u32 = 256 * 1024;

/// Handed to generated code by address; `repr(C)` because generated code reads and writes it by offset.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Context {
    /// Steps left.
    pub(super) steps: i64,
    /// Calls within calls left.
    pub(super) depth: i64,
    /// Below this the stack pointer may not be when a function begins.
    pub(super) stack_limit: u64,
    /// Steps for one point.
    pub(super) steps_per_point: i64,
    /// The point at which a kernel stopped.
    pub(super) point: u64,
}

impl Context {
    pub(super) const STEPS: i32 = offset_of!(Context, steps) as i32;
    pub(super) const DEPTH: i32 = offset_of!(Context, depth) as i32;
    pub(super) const STACK_LIMIT: i32 = offset_of!(Context, stack_limit) as i32;
    pub(super) const STEPS_PER_POINT: i32 = offset_of!(Context, steps_per_point) as i32;
    pub(super) const POINT: i32 = offset_of!(Context, point) as i32;

    /// A context for a call that is made from the current frame.
    pub(super) fn new(limits: Limits) -> Context {
        let here = 0u8;
        let here = std::ptr::from_ref(&here).addr();
        Context {
            steps: i64::from(limits.steps),
            depth: i64::from(limits.depth),
            stack_limit: here.saturating_sub(STACK) as u64,
            steps_per_point: i64::from(limits.steps),
            point: 0,
        }
    }
}
