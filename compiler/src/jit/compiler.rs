//! From functions of one IR module to machine code.

use super::code::{Address, Kernel, Routine};
use super::context::MAX_FRAME;
use super::memory::{CodeMemory, OptLevel};
use super::pieces::{self, Pieces};
use super::plan::Plan;
use super::vector::has_vector_form;
use super::{kernel, lower};
use crate::ir::hash::HashMap;
use crate::ir::{FunctionId, Module, Type};
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

/// Options of a compilation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Let Cranelift verify its input. Tests do.
    pub verify: bool,
    /// Keep the text of what was compiled.
    pub listings: bool,
    /// Compute one point at a time. Results are the same; tests compare.
    pub one_lane: bool,
    /// Nodes of a routine, with those of bodies that are lowered in place, above which it is compiled in pieces of this
    /// size.
    pub piece: usize,
}

impl Options {
    /// Small enough that some fifteen values of every node fit into a frame.
    pub const PIECE: usize = 2048;
}

impl Default for Options {
    fn default() -> Options {
        Options { verify: false, listings: false, one_lane: false, piece: Options::PIECE }
    }
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

/// Use that a kernel makes of its function's results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// Every point's results are written, point after point.
    Store,
    /// The results are added over all points to one set of results.
    Accumulate,
}

/// A kernel: a function `(captures.., values of a point..) -> results..`, all Real, as a loop over points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KernelShape {
    /// The function.
    pub function: FunctionId,
    /// Number of its first parameters, which are the same for all points.
    pub captures: usize,
    /// Whether results are stored or summed.
    pub output: Output,
}

/// Callable code: kernels and routines in the order of their compilation, and the memory that they lie in.
pub(super) struct Finished {
    pub(super) memory: CodeMemory,
    pub(super) kernels: Vec<Kernel>,
    pub(super) routines: Vec<Routine>,
    pub(super) listings: Vec<Listing>,
}

/// Compiles functions of one module. The code is freed with it, or belongs to the `CodeMemory` that `finish` returns.
pub(super) struct Compiler<'m> {
    pub(super) module: &'m Module,
    pub(super) plan: Plan,
    pub(super) memory: CodeMemory,
    /// Functions with code of their own.
    natives: HashMap<FunctionId, FuncId>,
    /// Functions of these that are still to be compiled.
    pending: Vec<FunctionId>,
    /// Kernels and routines in the order of their compilation; `finish` fills in their addresses.
    kernels: Vec<(FuncId, Kernel)>,
    routines: Vec<(FuncId, Routine)>,
    nodes: usize,
    listings: Option<Vec<Listing>>,
    one_lane: bool,
    piece: usize,
    /// Reused from function to function.
    context: Option<(Context, FunctionBuilderContext)>,
}

/// Nodes that one [`Compiler`] lowers, bodies counted wherever they are lowered in place: seconds of work.
const MAX_NODES: usize = 1_000_000;

/// Instructions, and calls times instructions, of one function of Cranelift up to which it is optimised. The time that
/// the register allocator takes grows with the square of both where many values live at once, as in the derivatives of
/// the least of a hundred lengths: at 8,000 instructions it is some 0.2 s, and a model may have hundreds of such
/// functions. (The largest kernel of an example has as many as this.) Code that is not optimised takes up to twice as
/// long to run. For every call the allocator looks at every value that lives over it.
const MOST_INSTRUCTIONS: usize = 2_000;
const MOST_CALLS_BY_INSTRUCTIONS: usize = 5_000_000;

impl<'m> Compiler<'m> {
    /// A compiler for functions of a valid module.
    ///
    /// # Errors
    /// Where Cranelift does not know this machine.
    pub(super) fn new(module: &'m Module, options: Options) -> Result<Compiler<'m>, JitError> {
        Ok(Compiler {
            module,
            plan: Plan::new(module),
            memory: CodeMemory::new(options)?,
            natives: HashMap::default(),
            pending: Vec::new(),
            kernels: Vec::new(),
            routines: Vec::new(),
            nodes: 0,
            listings: options.listings.then(Vec::new),
            one_lane: options.one_lane,
            piece: options.piece,
            context: None,
        })
    }

    /// Compiles a function, with what it calls. It is meant to run once for every x, so that its code is made quickly.
    ///
    /// # Errors
    /// [`JitError`].
    pub(super) fn routine(&mut self, id: FunctionId) -> Result<(), JitError> {
        let f = self.module.function(id);
        let mut words = f.results.len();
        let function = match (self.natives.get(&id), Pieces::new(self.module, &self.plan, f, self.piece)) {
            (Some(known), _) => *known,
            (None, Some(pieces)) => {
                words = pieces.words;
                self.sequence(id, &pieces)?
            }
            (None, None) => {
                let function = self.declare(&self.signature(3), &f.name)?;
                self.natives.insert(id, function);
                self.compile_plain(id, OptLevel::None)?;
                function
            }
        };
        self.compile_pending()?;
        let address = Address(std::ptr::null());
        let routine = Routine { address, arguments: f.params.len(), results: f.results.len(), words };
        self.routines.push((function, routine));
        Ok(())
    }

    /// Compiles a function into a loop over points, with what it calls: over two points at once where all that differs
    /// between points has a form for vectors.
    ///
    /// # Errors
    /// [`JitError`].
    pub(super) fn kernel(&mut self, shape: KernelShape) -> Result<(), JitError> {
        let f = self.module.function(shape.function);
        let reals = f.params.iter().map(|p| p.ty).chain(f.result_types()).all(|ty| ty == Type::Real);
        let values = f.params.len().checked_sub(shape.captures).filter(|_| reals);
        let values = values.ok_or_else(|| JitError::Shape(f.name.clone()))?;
        let two_lanes = !self.one_lane && has_vector_form(f, &kernel::varying(f, shape.captures));
        let signature = self.signature(6);
        let function = self.declare(&signature, &f.name)?;
        self.define(function, &f.name, signature, OptLevel::Speed, |compiler, context, frontend| {
            kernel::build(compiler, shape, two_lanes, context, frontend)
        })?;
        self.compile_pending()?;
        let lanes = if two_lanes { 2 } else { 1 };
        let kernel = Kernel { address: Address(std::ptr::null()), shape, values, results: f.results.len(), lanes };
        self.kernels.push((function, kernel));
        Ok(())
    }

    /// Makes what was compiled callable, with its texts if the options ask for them.
    ///
    /// # Errors
    /// Where the operating system gives no executable memory.
    pub(super) fn finish(mut self) -> Result<Finished, JitError> {
        let module = self.memory.module_mut();
        module.finalize_definitions().map_err(|e| JitError::Backend("program".to_owned(), e.to_string()))?;
        let address = |function| Address(module.get_finalized_function(function));
        let kernels = self.kernels.into_iter().map(|(f, kernel)| Kernel { address: address(f), ..kernel }).collect();
        let routines =
            self.routines.into_iter().map(|(f, routine)| Routine { address: address(f), ..routine }).collect();
        Ok(Finished { memory: self.memory, kernels, routines, listings: self.listings.unwrap_or_default() })
    }

    /// The code of a function, which is compiled later if it is not yet.
    pub(super) fn native(&mut self, id: FunctionId) -> Result<FuncId, JitError> {
        if let Some(native) = self.natives.get(&id) {
            return Ok(*native);
        }
        let signature = self.signature(3);
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

    /// A function of `words` addresses or counts to a status; a routine has three: `(context, arguments, results)`.
    fn signature(&self, words: usize) -> Signature {
        let mut signature = self.memory.module().make_signature();
        signature.params.extend(std::iter::repeat_n(AbiParam::new(types::I64), words));
        signature.returns.push(AbiParam::new(types::I32));
        signature
    }

    fn compile_pending(&mut self) -> Result<(), JitError> {
        while let Some(id) = self.pending.pop() {
            self.compile_plain(id, OptLevel::Speed)?;
        }
        Ok(())
    }

    fn compile_plain(&mut self, id: FunctionId, level: OptLevel) -> Result<(), JitError> {
        let name = &self.module.function(id).name;
        let signature = self.signature(3);
        self.define(self.natives[&id], name, signature, level, |compiler, context, frontend| {
            lower::build_plain(compiler, id, context, frontend)
        })
    }

    /// A large routine in pieces. It is not a native that others could call: they have no memory for what lies between.
    fn sequence(&mut self, id: FunctionId, pieces: &Pieces) -> Result<FuncId, JitError> {
        let name = &self.module.function(id).name;
        let mut functions = Vec::new();
        for range in &pieces.ranges {
            let function = self.declare(&self.signature(3), name)?;
            self.define(function, name, self.signature(3), OptLevel::None, |compiler, context, frontend| {
                pieces::build_piece(compiler, id, pieces, range.clone(), context, frontend)
            })?;
            functions.push(function);
        }
        let all = self.declare(&self.signature(3), name)?;
        self.define(all, name, self.signature(3), OptLevel::None, |compiler, context, frontend| {
            pieces::build_sequence(compiler, &functions, context, frontend);
            Ok(())
        })?;
        Ok(all)
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
        level: OptLevel,
        build: impl FnOnce(&mut Self, &mut Context, &mut FunctionBuilderContext) -> Result<(), JitError>,
    ) -> Result<(), JitError> {
        let new = || (self.memory.module().make_context(), FunctionBuilderContext::new());
        let (mut context, mut frontend) = self.context.take().unwrap_or_else(new);
        context.func.signature = signature;
        build(self, &mut context, &mut frontend)?;
        let level = if takes_long(&context.func) { OptLevel::None } else { level };
        let clif = self.listings.is_some().then(|| context.func.display().to_string());
        context.set_disasm(self.listings.is_some());
        self.memory.define(function, &mut context, level).map_err(|e| backend(name, &e))?;
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
}

/// Whether a function would take too long to optimise.
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
        ModuleError::Allocation { .. } => JitError::TooLarge(name.to_owned(), "its code needs too much memory"),
        e => JitError::Backend(name.to_owned(), e.to_string()),
    }
}
