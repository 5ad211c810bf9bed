//! An expression at the stages of the compiler.

use super::{Session, evaluate};
use crate::check;
use crate::diagnostic::{Code, Diagnostic};
use crate::diff;
use crate::ir::call_graph::CallGraph;
use crate::ir::print::gml;
use crate::ir::{self, FunctionId, Module};
use crate::jit;
use crate::program::{EmitStage, Failed};
use crate::source::{Loader, Span};
use crate::workers::Workers;
use std::fmt::Write as _;

/// An expression as machine code.
pub struct Native {
    code: jit::Code,
    arguments: Vec<u64>,
    results: usize,
    limits: jit::Limits,
}

impl Native {
    /// Runs it once.
    ///
    /// # Errors
    /// If it does not end within its limits, or fails.
    pub fn run(&self) -> Result<(), jit::Trap> {
        let mut results = vec![0; self.results];
        self.code.call(0, &self.arguments, &mut results, self.limits)
    }
}

impl Session {
    /// An expression, as a function of the parameters, at a stage of the compiler.
    ///
    /// # Errors
    /// Its errors.
    pub fn emit(&mut self, text: &str, stage: EmitStage, loader: &dyn Loader) -> Result<String, Failed> {
        self.with_expression(text, loader, |_, checked, asked| {
            if stage == EmitStage::Typed {
                return Ok(check::print(&checked.model));
            }
            let (module, function) = inlined(checked)?;
            if stage == EmitStage::Ir {
                return Ok(listing(&module, function));
            }
            let (_, listings) = compile(&module, function, asked.span, true)?;
            let which = |l: &jit::Listing| if stage == EmitStage::Clif { l.clif.clone() } else { l.assembly.clone() };
            Ok(listings.iter().map(|l| format!("; {}\n{}\n", l.name, which(l))).collect())
        })
    }

    /// An expression with its derivatives by all parameters that it depends on, as text that reads like the language.
    ///
    /// # Errors
    /// Its errors.
    pub fn derivative_text(&mut self, text: &str, loader: &dyn Loader) -> Result<String, Failed> {
        self.with_expression(text, loader, |s, checked, _| {
            let (mut module, function) = inlined(checked)?;
            let wrt: Vec<u32> = (0..s.model.as_ref().map_or(0, |m| m.parameters().len()) as u32).collect();
            let (jacobian, _) = diff::jacobian(&mut module, function, &wrt).map_err(|e| vec![e.diagnostic()])?;
            Ok(gml(&module, jacobian))
        })
    }

    /// An expression as machine code, to be run at the current values of the parameters.
    ///
    /// # Errors
    /// Its errors.
    pub fn native(&mut self, text: &str, limits: jit::Limits, loader: &dyn Loader) -> Result<Native, Failed> {
        self.with_expression(text, loader, |s, checked, asked| {
            let (module, function) = inlined(checked)?;
            let (code, _) = compile(&module, function, asked.span, false)?;
            let x = s.model.as_ref().map_or(&[][..], |m| m.values());
            let arguments = x.iter().map(|x| x.to_bits()).collect();
            Ok(Native { code, arguments, results: module.function(function).results.len(), limits })
        })
    }
}

/// The function of an expression, ready to be compiled.
fn inlined(checked: &check::entered::Checked) -> Result<(Module, FunctionId), Vec<Diagnostic>> {
    let evaluate::Lowered { mut module, functions } = evaluate::lower_asked(checked)?;
    let function = functions[functions.len() - 1];
    ir::inline(&mut module, &[function]).map_err(|e| vec![e.diagnostic()])?;
    ir::simplify(&mut module, &[function]);
    for name in module.functions[function.0 as usize].result_names.iter_mut().filter(|n| n.is_empty()) {
        name.push_str("value");
    }
    Ok((module, function))
}

fn listing(module: &Module, function: FunctionId) -> String {
    let mut text = String::new();
    for id in CallGraph::new(module, &[function]).order {
        let _ = writeln!(text, "{id} = {}", module.function(id));
    }
    text
}

/// A function as the one routine of its code.
fn compile(
    module: &Module,
    function: FunctionId,
    span: Span,
    listings: bool,
) -> Result<(jit::Code, Vec<jit::Listing>), Vec<Diagnostic>> {
    let options = jit::Options { listings, ..jit::Options::default() };
    jit::Code::compile(module, &[], &[function], options, Workers::ONE)
        .map_err(|e| vec![Diagnostic::new(Code::MachineCode, span, e.to_string())])
}
