//! From functions of one IR module to a [`Code`].

use super::code::Code;
use super::context::MAX_FRAME;
use super::grid::{self, GridShape};
use super::memory::{CodeMemory, Effort};
use super::plan::Plan;
use super::vector::can_be_wide;
use super::{kernel, lower};
use crate::ir::hash::HashMap;
use crate::ir::{Function, FunctionId, Module, Op, Type, Value};
use cranelift_codegen::Context;
use cranelift_codegen::ir::{AbiParam, Signature, types};
use cranelift_frontend::FunctionBuilderContext;
use cranelift_module::{FuncId, Module as _, ModuleError};
use thiserror::Error;

/// Why there is no machine code.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum JitError {
    /// Cranelift does not know this machine.
    #[error("machine code cannot be made on this machine: {0}")]
    Host(String),
    /// `diff` has not replaced an `Op::Tangent`.
    #[error("'{0}' has a derivative that was not expanded")]
    Tangent(String),
    /// A kernel's function does not take and give what its shape says.
    #[error("'{0}' does not have the shape of its kernel")]
    Shape(String),
    /// More than can be compiled in reasonable time.
    #[error("'{0}' is too large: {1}")]
    TooLarge(String, &'static str),
    /// A fault of Cranelift or of the lowering.
    #[error("'{0}' could not be compiled: {1}")]
    Backend(String, String),
}

/// How to compile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Let Cranelift verify its input. Tests do.
    pub verify: bool,
    /// Keep the text of what was compiled, for [`Compiler::listings`].
    pub listings: bool,
    /// Compile everything in linear time to code that is slower to run. Else this is done with routines, which run once
    /// for every x, and with what would take too long.
    pub quick: bool,
    /// Do not compute two points at once. Results are the same; tests compare.
    pub narrow: bool,
}

/// The text of a compiled function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listing {
    /// The function's name.
    pub name: String,
    /// Cranelift's IR before optimisation.
    pub clif: String,
    /// The machine code, disassembled.
    pub assembly: String,
}

/// A plain function of a [`Code`]: takes and gives 64-bit words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Routine(pub(super) u32);

/// A function of a [`Code`] that runs over a batch of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel(pub(super) u32);

/// A function of a [`Code`] that runs over a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridKernel(pub(super) u32);

/// What a kernel makes of its function's results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// Every point's results are written, point after point.
    Store,
    /// The results are added over all points, in their order, to one set of results.
    Accumulate,
}

/// A kernel: a function of uniforms, u, v and, if it takes them, three weights a point; all Real.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KernelShape {
    /// The function.
    pub function: FunctionId,
    /// How many of its first parameters are the same for all points.
    pub uniforms: usize,
    /// How many weights of each point follow after u and v.
    pub weights: usize,
    /// What becomes of the results.
    pub output: Output,
}

/// What a kernel computes, but for names and places in the source.
#[derive(PartialEq, Eq, Hash)]
struct Computation {
    nodes: Vec<(Op, Type)>,
    results: Vec<Value>,
    uniforms: usize,
    weights: usize,
    accumulates: bool,
}

impl Computation {
    fn new(function: &Function, shape: KernelShape) -> Computation {
        Computation {
            nodes: function.nodes.iter().map(|n| (n.op.clone(), n.ty)).collect(),
            results: function.results.clone(),
            uniforms: shape.uniforms,
            weights: shape.weights,
            accumulates: shape.output == Output::Accumulate,
        }
    }
}

/// Something that `Code` can call.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) function: FuncId,
    /// Words that it reads: arguments of a routine, uniforms of a kernel.
    pub(super) inputs: usize,
    /// Words that it writes: in all, for every point, or accumulated.
    pub(super) results: usize,
    /// What it is.
    pub(super) kind: EntryKind,
}

/// What `Code` can call, by signature.
#[derive(Clone, Copy, Debug)]
pub(super) enum EntryKind {
    Routine,
    Kernel(KernelShape),
    /// Whether it computes two points at once.
    Grid(GridShape, bool),
}

/// Compiles functions of one module. What it has compiled is freed with it, or belongs to the [`Code`].
pub struct Compiler<'m> {
    pub(super) module: &'m Module,
    pub(super) plan: Plan,
    pub(super) memory: CodeMemory,
    /// Functions with code of their own.
    natives: HashMap<FunctionId, FuncId>,
    /// Those of them that are still to be compiled.
    pending: Vec<FunctionId>,
    pub(super) entries: Vec<Entry>,
    /// Kernels by what they compute: parts that differ in their uniforms alone share them.
    kernels: HashMap<Computation, Kernel>,
    nodes: usize,
    listings: Option<Vec<Listing>>,
    quick: bool,
    narrow: bool,
    /// Reused from function to function.
    context: Option<(Context, FunctionBuilderContext)>,
}

/// Nodes that one [`Compiler`] lowers, bodies counted wherever they are lowered in place: seconds of work.
const MAX_NODES: usize = 1_000_000;

/// Instructions, and calls times instructions, of one function of Cranelift up to which it is compiled thoroughly: the
/// register allocator then looks at every value that lives over a call for every call. At this many it takes about a tenth of a second.
const MOST_INSTRUCTIONS: usize = 50_000;
const MOST_CALLS_BY_INSTRUCTIONS: usize = 5_000_000;

impl<'m> Compiler<'m> {
    /// A compiler for functions of a valid module.
    ///
    /// # Errors
    /// Where Cranelift does not know this machine.
    pub fn new(module: &'m Module, options: Options) -> Result<Compiler<'m>, JitError> {
        Ok(Compiler {
            module,
            plan: Plan::new(module),
            memory: CodeMemory::new(options)?,
            natives: HashMap::default(),
            pending: Vec::new(),
            entries: Vec::new(),
            kernels: HashMap::default(),
            nodes: 0,
            listings: options.listings.then(Vec::new),
            quick: options.quick,
            narrow: options.narrow,
            context: None,
        })
    }

    /// Compiles a function, with what it calls. It is meant to run once for every x, so that its code is made quickly.
    ///
    /// # Errors
    /// [`JitError`].
    pub fn routine(&mut self, id: FunctionId) -> Result<Routine, JitError> {
        let function = match self.natives.get(&id) {
            Some(known) => *known,
            None => {
                let function = self.declare(&self.plain_signature(), &self.module.function(id).name)?;
                self.natives.insert(id, function);
                self.compile_plain(id, Effort::Quick)?;
                function
            }
        };
        self.compile_pending()?;
        let f = self.module.function(id);
        let entry = Entry { function, inputs: f.params.len(), results: f.results.len(), kind: EntryKind::Routine };
        Ok(Routine(self.add(entry)))
    }

    /// Compiles a function into a loop over points, with what it calls.
    ///
    /// # Errors
    /// [`JitError`].
    pub fn kernel(&mut self, shape: KernelShape) -> Result<Kernel, JitError> {
        let f = self.module.function(shape.function);
        let params = shape.uniforms + 2 + shape.weights;
        let reals = f.params.iter().map(|p| p.ty).chain(f.result_types()).all(|ty| ty == Type::Real);
        if params != f.params.len() || !reals {
            return Err(JitError::Shape(f.name.clone()));
        }
        let computation = Computation::new(f, shape);
        if let Some(known) = self.kernels.get(&computation) {
            return Ok(*known);
        }
        let mut signature = self.memory.module().make_signature();
        signature.params.extend([AbiParam::new(types::I64); 7]);
        signature.returns.push(AbiParam::new(types::I32));
        let function = self.declare(&signature, &f.name)?;
        self.define(function, &f.name, signature, Effort::Thorough, |compiler, context, frontend| {
            kernel::build(compiler, shape, context, frontend)
        })?;
        self.compile_pending()?;
        let entry =
            Entry { function, inputs: shape.uniforms, results: f.results.len(), kind: EntryKind::Kernel(shape) };
        let kernel = Kernel(self.add(entry));
        self.kernels.insert(computation, kernel);
        Ok(kernel)
    }

    /// A function of the module.
    #[must_use]
    pub fn function(&self, id: FunctionId) -> &'m Function {
        self.module.function(id)
    }

    /// Compiles a function into loops over a grid, with what it calls.
    ///
    /// # Errors
    /// [`JitError`].
    pub fn grid(&mut self, shape: GridShape) -> Result<GridKernel, JitError> {
        let f = self.module.function(shape.function);
        let reals = f.params.iter().map(|p| p.ty).chain(f.result_types()).all(|ty| ty == Type::Real);
        if shape.params() != f.params.len() || shape.row_sums.is_some_and(|n| n > f.results.len()) || !reals {
            return Err(JitError::Shape(f.name.clone()));
        }
        let wide = !self.narrow && can_be_wide(f, &kernel::varying(f, shape.uniforms));
        let mut signature = self.memory.module().make_signature();
        signature.params.extend([AbiParam::new(types::I64); 2]);
        signature.returns.push(AbiParam::new(types::I32));
        let function = self.declare(&signature, &f.name)?;
        self.define(function, &f.name, signature, Effort::Thorough, |compiler, context, frontend| {
            grid::build(compiler, shape, wide, context, frontend)
        })?;
        self.compile_pending()?;
        let kind = EntryKind::Grid(shape, wide);
        Ok(GridKernel(self.add(Entry { function, inputs: shape.uniforms, results: f.results.len(), kind })))
    }

    /// The text of everything compiled so far; empty unless asked for in the options.
    #[must_use]
    pub fn listings(&self) -> &[Listing] {
        self.listings.as_deref().unwrap_or(&[])
    }

    /// Makes what was compiled callable.
    ///
    /// # Errors
    /// Where the operating system gives no executable memory.
    pub fn finish(mut self) -> Result<Code, JitError> {
        self.memory
            .module_mut()
            .finalize_definitions()
            .map_err(|e| JitError::Backend("program".to_owned(), e.to_string()))?;
        Ok(Code::new(self.memory, &self.entries))
    }

    /// The code of a function, which is compiled later if it is not yet.
    pub(super) fn native(&mut self, id: FunctionId) -> Result<FuncId, JitError> {
        if let Some(native) = self.natives.get(&id) {
            return Ok(*native);
        }
        let signature = self.plain_signature();
        let native = self.declare(&signature, &self.module.function(id).name)?;
        self.natives.insert(id, native);
        self.pending.push(id);
        Ok(native)
    }

    /// Counts the nodes of a function that is being lowered.
    pub(super) fn spend(&mut self, name: &str, nodes: usize) -> Result<(), JitError> {
        self.nodes = self.nodes.saturating_add(nodes);
        if self.nodes > MAX_NODES {
            return Err(JitError::TooLarge(name.to_owned(), "more than a million operations"));
        }
        Ok(())
    }

    /// `(context, arguments, results) -> status`.
    fn plain_signature(&self) -> Signature {
        let mut signature = self.memory.module().make_signature();
        signature.params.extend([AbiParam::new(types::I64); 3]);
        signature.returns.push(AbiParam::new(types::I32));
        signature
    }

    fn compile_pending(&mut self) -> Result<(), JitError> {
        while let Some(id) = self.pending.pop() {
            self.compile_plain(id, Effort::Thorough)?;
        }
        Ok(())
    }

    fn compile_plain(&mut self, id: FunctionId, effort: Effort) -> Result<(), JitError> {
        let name = &self.module.function(id).name;
        let signature = self.plain_signature();
        self.define(self.natives[&id], name, signature, effort, |compiler, context, frontend| {
            lower::build_plain(compiler, id, context, frontend)
        })
    }

    fn declare(&mut self, signature: &Signature, name: &str) -> Result<FuncId, JitError> {
        // Anonymous: names of scripts need not be unique, nor differ from symbols.
        self.memory.module_mut().declare_anonymous_function(signature).map_err(|e| backend(name, &e))
    }

    /// Builds and compiles one function of Cranelift.
    fn define(
        &mut self,
        function: FuncId,
        name: &str,
        signature: Signature,
        effort: Effort,
        build: impl FnOnce(&mut Self, &mut Context, &mut FunctionBuilderContext) -> Result<(), JitError>,
    ) -> Result<(), JitError> {
        let new = || (self.memory.module().make_context(), FunctionBuilderContext::new());
        let (mut context, mut frontend) = self.context.take().unwrap_or_else(new);
        context.func.signature = signature;
        build(self, &mut context, &mut frontend)?;
        let effort = if self.quick || takes_long(&context.func) { Effort::Quick } else { effort };
        let clif = self.listings.is_some().then(|| context.func.display().to_string());
        context.set_disasm(self.listings.is_some());
        self.memory.define(function, &mut context, effort).map_err(|e| backend(name, &e))?;
        let compiled = context.compiled_code();
        let frame = compiled.and_then(|c| c.buffer.frame_layout()).map_or(0, |l| l.frame_to_fp_offset);
        if frame > MAX_FRAME {
            return Err(JitError::TooLarge(name.to_owned(), "it needs too much stack"));
        }
        if let (Some(listings), Some(clif)) = (&mut self.listings, clif) {
            let assembly = compiled.and_then(|c| c.vcode.clone()).unwrap_or_default();
            listings.push(Listing { name: name.to_owned(), clif, assembly });
        }
        self.memory.module().clear_context(&mut context);
        self.context = Some((context, frontend));
        Ok(())
    }

    fn add(&mut self, entry: Entry) -> u32 {
        self.entries.push(entry);
        (self.entries.len() - 1) as u32
    }
}

/// Whether a function would take too long to compile thoroughly.
fn takes_long(function: &cranelift_codegen::ir::Function) -> bool {
    let insts = function.layout.blocks().flat_map(|b| function.layout.block_insts(b));
    let calls = insts.filter(|i| function.dfg.insts[*i].opcode().is_call()).count();
    let all = function.dfg.num_insts();
    all > MOST_INSTRUCTIONS || calls.saturating_mul(all) > MOST_CALLS_BY_INSTRUCTIONS
}

fn backend(name: &str, error: &ModuleError) -> JitError {
    use cranelift_codegen::CodegenError::{CodeTooLarge, ImplLimitExceeded};
    match error {
        ModuleError::Compilation(CodeTooLarge | ImplLimitExceeded) => {
            JitError::TooLarge(name.to_owned(), "the code generator's limits are exceeded")
        }
        e => JitError::Backend(name.to_owned(), e.to_string()),
    }
}
