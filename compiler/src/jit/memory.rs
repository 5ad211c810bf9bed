//! Ownership of code memory. Cranelift's module leaks its code when it is dropped; this frees it.

use super::compiler::{JitError, Options};
use super::host;
use cranelift_codegen::Context;
use cranelift_codegen::isa::{OwnedTargetIsa, TargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_jit::{ArenaMemoryProvider, JITBuilder, JITModule};
use cranelift_module::{FuncId, Module as _, ModuleError, ModuleReloc};
use std::sync::OnceLock;

/// Addresses that are reserved for the code of a module, in bytes; memory is taken as code comes. A fit of the tree has
/// 1.1 MB of code in all its modules, one of the other examples 0.3 MB at most; the limit of operations allows 800,000
/// a function.
const RESERVED: usize = 256 << 20;

/// A Cranelift module whose code lives as long as this.
pub(super) struct CodeMemory {
    /// Taken only by `drop`.
    module: Option<JITModule>,
    unoptimised: OwnedTargetIsa,
    optimised: OwnedTargetIsa,
}

/// Cranelift's level of optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OptLevel {
    /// Not at all, in linear time: for code that runs once for every x.
    None,
    /// For code that is to run fast.
    Speed,
}

impl CodeMemory {
    /// An empty module for the machine that this runs on.
    pub(super) fn new(options: Options) -> Result<CodeMemory, JitError> {
        let optimised = target(options, OptLevel::Speed)?;
        let unoptimised = target(options, OptLevel::None)?;
        let mut builder = JITBuilder::with_isa(optimised.clone(), cranelift_module::default_libcall_names());
        // Functions call each other by distances of 32 bits. In regions of its own each may lie farther from the
        // others, and Cranelift panics, where memory is in pieces.
        let memory = ArenaMemoryProvider::new_with_size(RESERVED).map_err(|e| JitError::Host(e.to_string()))?;
        builder.memory_provider(Box::new(memory));
        builder.symbols(host::all().into_iter().map(|f| (f.name, f.address)));
        Ok(CodeMemory { module: Some(JITModule::new(builder)), unoptimised, optimised })
    }

    /// Compiles a function that was built in `context` and takes its code. (What `JITModule::define_function` does,
    /// with a choice of targets.)
    pub(super) fn define(&mut self, id: FuncId, context: &mut Context, level: OptLevel) -> Result<(), ModuleError> {
        let target: &dyn TargetIsa = match level {
            OptLevel::None => &*self.unoptimised,
            OptLevel::Speed => &*self.optimised,
        };
        context.compile(target, &mut Default::default())?;
        let Some(code) = context.compiled_code() else { return Ok(()) };
        let relocs = code.buffer.relocs().iter().map(|r| ModuleReloc::from_mach_reloc(r, &context.func, id));
        let relocs: Vec<ModuleReloc> = relocs.collect();
        let module = self.module.as_mut().expect("only drop takes it");
        module.define_function_bytes(id, u64::from(code.buffer.alignment), code.code_buffer(), &relocs)
    }

    pub(super) fn module(&self) -> &JITModule {
        self.module.as_ref().expect("only drop takes it")
    }

    pub(super) fn module_mut(&mut self) -> &mut JITModule {
        self.module.as_mut().expect("only drop takes it")
    }
}

impl Drop for CodeMemory {
    fn drop(&mut self) {
        if let Some(module) = self.module.take() {
            // SAFETY: addresses of the code are kept by `Code` alone, beside this, and called only while it is
            // borrowed. It is being dropped (or was never made), so nothing runs the code now or later.
            unsafe { module.free_memory() };
        }
    }
}

// SAFETY: the module is changed only through `&mut CodeMemory`; a shared `CodeMemory` gives out nothing but
// `&JITModule`, which `Code` does not touch once the code is finished. (What makes the module not `Sync` is a cache of
// symbols that is used while linking.)
unsafe impl Sync for CodeMemory {}

/// The machine that this runs on, with its settings, made once for each combination of them.
fn target(options: Options, level: OptLevel) -> Result<OwnedTargetIsa, JitError> {
    static TARGETS: [OnceLock<Result<OwnedTargetIsa, JitError>>; 4] = [const { OnceLock::new() }; 4];
    let index = usize::from(options.verify) + 2 * usize::from(level == OptLevel::None);
    TARGETS[index].get_or_init(|| make_target(options, level)).clone()
}

fn make_target(options: Options, level: OptLevel) -> Result<OwnedTargetIsa, JitError> {
    let fast = level == OptLevel::Speed;
    let host = |e: &dyn std::fmt::Display| JitError::Host(e.to_string());
    let mut flags = settings::builder();
    let values = [
        ("opt_level", if fast { "speed" } else { "none" }),
        ("regalloc_algorithm", if fast { "backtracking" } else { "single_pass" }),
        // Calls reach anywhere in the address space.
        ("use_colocated_libcalls", "false"),
        ("is_pic", "false"),
        // Nothing unwinds through generated code.
        ("unwind_info", "false"),
        ("enable_verifier", if options.verify { "true" } else { "false" }),
    ];
    for (name, value) in values {
        flags.set(name, value).map_err(|e| host(&e))?;
    }
    let builder = cranelift_native::builder().map_err(|e| host(&e))?;
    builder.finish(settings::Flags::new(flags)).map_err(|e| host(&e))
}
