//! A program as text, for people.

use super::evaluators::OPTIONS;
use super::{Order, Program};
use crate::check;
use crate::diff;
use crate::ir::call_graph::CallGraph;
use crate::ir::print::gml;
use crate::ir::{FunctionId, Module};
use crate::jit::{Code, Listing, Options};
use crate::workers::Workers;
use std::fmt::Write as _;

/// A stage of the compiler whose result can be shown.
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

    /// The surface of every part with its derivative with respect to a parameter, or to every one that it depends on,
    /// as text that reads like the language. Empty where no part depends on the parameter.
    #[must_use]
    pub fn derivative_text(&self, wrt: Option<&str>) -> String {
        let mut text = String::new();
        let mut module = Module::clone(&self.functions.module);
        for (part, functions) in self.patches.iter().zip(&self.functions.parts) {
            let chosen =
                |i: u32| part.active.contains(&i) && wrt.is_none_or(|name| self.parameters[i as usize].name == name);
            let surface = &functions.surface;
            let params = (0..).zip(&surface.params).filter(|(_, i)| chosen(**i)).map(|(position, _)| position);
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
        roots.extend(functions.requires.iter().map(|r| (format!("require {}", r.message), r.condition.function)));
        roots.push(("captures".to_owned(), functions.prelude));
        roots.push(("derivatives of captures".to_owned(), functions.prelude_jacobian));
        let mut text = String::new();
        for (title, root) in roots {
            write_function(&mut text, &title, &functions.module, root);
        }
        for order in Order::ALL {
            let evaluator = match self.evaluators.get(functions, false, order) {
                Ok(evaluator) => evaluator,
                Err(e) => {
                    let _ = writeln!(text, "; {}: {e}", order.name());
                    continue;
                }
            };
            for (part, function) in self.patches.iter().zip(&evaluator.of_part) {
                let title = format!("{}: {}", part.name, order.name());
                write_function(&mut text, &title, &evaluator.module, evaluator.functions[*function]);
            }
        }
        for order in ON_GRIDS {
            match self.evaluators.get(functions, true, order) {
                Ok(evaluator) => {
                    for split in &evaluator.splits {
                        let stages = [
                            ("once a column", split.columns),
                            ("once a row", split.rows),
                            ("at every point", split.inner),
                        ];
                        for (stage, function) in stages {
                            let title = format!("{} on grids, {stage}", order.name());
                            write_function(&mut text, &title, &evaluator.module, function);
                        }
                    }
                }
                Err(e) => _ = writeln!(text, "; {} on grids: {e}", order.name()),
            }
        }
        text
    }

    fn listing(&self, which: impl Fn(&Listing) -> &str) -> String {
        let mut text = String::new();
        let mut write = |suffix: &str, listings: Result<Vec<Listing>, String>| match listings {
            Ok(listings) => listings.iter().for_each(|l| _ = writeln!(text, "; {}{suffix}\n{}", l.name, which(l))),
            Err(e) => _ = writeln!(text, "; {e}"),
        };
        let (functions, options) = (&self.functions, Options { listings: true, ..OPTIONS });
        let routines = Code::compile(&functions.module, &[], &functions.routines(), options, Workers::ONE);
        write("", routines.map(|(_, listings)| listings).map_err(|e| e.to_string()));
        let all = Order::ALL.map(|order| (false, order)).into_iter().chain(ON_GRIDS.map(|order| (true, order)));
        for (on_grid, order) in all {
            let suffix = if on_grid { format!(" ({} on grids)", order.name()) } else { String::new() };
            let evaluator = self.evaluators.get(functions, on_grid, order).map_err(ToString::to_string);
            write(&suffix, evaluator.and_then(|e| e.listings().map_err(|e| e.to_string())));
        }
        text
    }
}

/// Orders whose evaluation on grids is shown; the others are seldom asked for.
const ON_GRIDS: [Order<'static>; 2] = [Order::Points, Order::Partials];

/// A function with those that it uses.
fn write_function(text: &mut String, title: &str, module: &Module, root: FunctionId) {
    let _ = writeln!(text, "; {title}");
    for id in CallGraph::new(module, &[root]).order {
        let _ = writeln!(text, "{id} = {}", module.function(id));
    }
}
