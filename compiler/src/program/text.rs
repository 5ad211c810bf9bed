//! A program as text, for people.

use super::Program;
use super::compile::BuildError;
use super::grids::{self, Grids, OnGrid};
use super::kernels::Kernels;
use super::on_demand::Derivative;
use crate::check;
use crate::diff;
use crate::ir::call_graph::CallGraph;
use crate::ir::print::gml;
use crate::ir::{FunctionId, Module};
use crate::jit::Listing;
use std::fmt::Write as _;

/// What a script has become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitStage {
    /// The typed tree.
    Typed,
    /// The scalar functions that are compiled.
    Ir,
    /// Cranelift's IR.
    Clif,
    /// The machine code, disassembled.
    Asm,
}

impl Program {
    /// The program at a stage.
    #[must_use]
    pub fn emit(&self, stage: EmitStage) -> String {
        match stage {
            EmitStage::Typed => check::print(&self.typed),
            EmitStage::Ir => self.functions_text(),
            EmitStage::Clif => self.listing(|l| &l.clif),
            EmitStage::Asm => self.listing(|l| &l.assembly),
        }
    }

    /// The surface of every part with its derivative with respect to a parameter, or to every one that it depends on, as
    /// text that reads like the language. Empty where no part depends on the parameter.
    #[must_use]
    pub fn derivative_text(&self, wrt: Option<&str>) -> String {
        let mut text = String::new();
        let mut module = self.functions.module.clone();
        for (part, functions) in self.parts.iter().zip(&self.functions.parts) {
            let chosen =
                |i: u32| part.active.contains(&i) && wrt.is_none_or(|name| self.parameters[i as usize].name == name);
            let surface = &functions.surface;
            let params = (0..).zip(&surface.uniform).filter(|(_, i)| chosen(**i)).map(|(position, _)| position);
            let params: Vec<u32> = params.collect();
            if params.is_empty() {
                continue;
            }
            match diff::jacobian(&mut module, surface.function, &params) {
                Ok((id, _)) => {
                    // `hole[2]` and `leg.shaft` are no names of functions.
                    module.functions[id.0 as usize].name = part.name.replace(['[', '.'], "_").replace(']', "");
                    let _ = writeln!(text, "// part {}\n{}", part.name, gml(&module, id));
                }
                Err(e) => {
                    let _ = writeln!(text, "// part {}: {e}\n", part.name);
                }
            }
        }
        text
    }

    /// The functions that are compiled, with those that they use.
    fn functions_text(&self) -> String {
        let functions = &self.functions;
        let mut roots = vec![("bounds".to_owned(), functions.bounds)];
        roots.extend(functions.requires.iter().map(|r| (format!("require {}", r.message), r.function)));
        roots.push(("captures".to_owned(), functions.prelude));
        roots.push(("derivatives of captures".to_owned(), functions.slopes));
        let mut text = String::new();
        for (title, root) in roots {
            write_function(&mut text, &title, &functions.module, root);
        }
        for (part, f) in self.parts.iter().zip(&functions.parts) {
            let title = |what| format!("{}: {what}", part.name);
            write_function(&mut text, &title("points"), &functions.module, functions.bodies[f.body].points);
            write_function(&mut text, &title("jacobian"), &functions.module, f.jacobian.function);
            for derivative in Derivative::ALL {
                let title = title(match derivative {
                    Derivative::Partials => "partials",
                    Derivative::SecondPartials => "second partials",
                    Derivative::Pullback => "pullback",
                });
                match self.derived.get(functions, derivative) {
                    Ok(derived) => write_function(&mut text, &title, &derived.module, derived.functions[f.body]),
                    Err(e) => _ = writeln!(text, "; {title}: {e}"),
                }
            }
        }
        for (what, title) in OnGrid::ALL {
            let write = |stage: &str, module: &Module, f: FunctionId| {
                write_function(&mut text, &format!("{title} on grids, {stage}"), module, f);
            };
            if let Err(e) = grids::show(functions, &self.derived, what, write) {
                _ = writeln!(text, "; {title} on grids: {e}");
            }
        }
        text
    }

    fn listing(&self, which: impl Fn(&Listing) -> &str) -> String {
        let mut text = String::new();
        let mut write = |suffix: &str, listings: Result<Vec<Listing>, BuildError>| match listings {
            Ok(listings) => listings.iter().for_each(|l| _ = writeln!(text, "; {}{suffix}\n{}", l.name, which(l))),
            Err(e) => _ = writeln!(text, "; {e}"),
        };
        write("", Kernels::listings(&self.functions).map_err(BuildError::from));
        Derivative::ALL.into_iter().for_each(|d| write("", self.derived.listings(&self.functions, d)));
        for (what, title) in OnGrid::ALL {
            write(&format!(" ({title} on grids)"), Grids::listings(&self.functions, &self.derived, what));
        }
        text
    }
}

/// A function with those that it uses.
fn write_function(text: &mut String, title: &str, module: &Module, root: FunctionId) {
    let _ = writeln!(text, "; {title}");
    for id in CallGraph::new(module, &[root]).order {
        let _ = writeln!(text, "{id} = {}", module.function(id));
    }
}
