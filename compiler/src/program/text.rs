//! A program as text, for people.

use super::Program;
use super::kernels::Kernels;
use crate::check;
use crate::diff;
use crate::ir::graph::References;
use crate::ir::print::gml;
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
            let chosen = |i: &&u32| wrt.is_none_or(|name| self.parameters[**i as usize].name == name);
            let params: Vec<u32> = part.active.iter().filter(chosen).copied().collect();
            if params.is_empty() {
                continue;
            }
            match diff::jacobian(&mut module, functions.surface, &params) {
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
        for (part, f) in self.parts.iter().zip(&functions.parts) {
            roots.push((format!("{}: points", part.name), f.points));
            roots.push((format!("{}: partials", part.name), f.partials));
            roots.push((format!("{}: second partials", part.name), f.second_partials));
            roots.push((format!("{}: jacobian", part.name), f.jacobian));
            roots.push((format!("{}: pullback", part.name), f.pullback));
        }
        let mut text = String::new();
        for (title, root) in roots {
            let _ = writeln!(text, "; {title}");
            for id in References::new(&functions.module, &[root]).order {
                let _ = writeln!(text, "{id} = {}", functions.module.function(id));
            }
        }
        text
    }

    fn listing(&self, which: impl Fn(&Listing) -> &str) -> String {
        match Kernels::listings(&self.functions) {
            Ok(listings) => listings.iter().map(|l| format!("; {}\n{}\n", l.name, which(l))).collect(),
            Err(e) => format!("; {e}\n"),
        }
    }
}
