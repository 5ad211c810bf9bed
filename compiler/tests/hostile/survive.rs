//! Runs a text through all stages, with small limits.

use crate::agree;
use gml_compiler::check::CheckOptions;
use gml_compiler::internals::ir::lower::lower;
use gml_compiler::internals::ir::validate::validate;
use gml_compiler::program::{Limits, Options, Order, Program, Sites, check, compile};
use gml_compiler::source::{NoFiles, SourceFile, Sources};
use gml_compiler::syntax;
use std::collections::BTreeMap;

/// The last stage that an input reached.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stage {
    Unreadable,
    Wrong,
    NoModel,
    Lowered,
    Refused,
    Compiled,
    Instantiated,
    Evaluated,
}

pub(crate) const STAGES: usize = 8;

/// Descriptions of the stages for people.
pub(crate) const NAMES: [&str; STAGES] = [
    "could not be parsed",
    "had an error of names, types or dimensions",
    "had no error, and no model",
    "were lowered to valid functions, and went no further by choice",
    "were too large to be differentiated or compiled",
    "became machine code, but no instance (a require does not hold, a limit)",
    "became an instance without a finite point",
    "were evaluated with their derivatives",
];

/// Limits with which every input takes a moment.
fn options() -> CheckOptions {
    CheckOptions { instances: 500, nodes: 100_000, depth: 100, iterations: 512, ..CheckOptions::default() }
}

/// Runs a text through the stages that accept it; an error describes the failure.
pub(crate) fn survive(text: &str, deep: bool) -> Result<Stage, String> {
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text);
    let (_, unreadable) = syntax::parse(main, text);
    let (model, diagnostics) = check(&mut sources, &NoFiles, main, &BTreeMap::new(), &options());
    for d in &diagnostics {
        let spans = d.related.iter().map(|(span, _)| *span).chain([d.span]);
        for span in spans {
            let file = sources.get(span.file).ok_or("a finding lies in no file")?;
            if file.text.get(span.start as usize..span.end as usize).is_none() {
                return Err(format!("{d:?} lies outside"));
            }
        }
    }
    let Some(model) = model else {
        return Ok(match (unreadable.is_empty(), diagnostics.is_empty()) {
            (false, _) => Stage::Unreadable,
            (true, false) => Stage::Wrong,
            (true, true) => Stage::NoModel,
        });
    };
    let Ok(lowered) = lower(&model) else { return Ok(Stage::Refused) };
    validate(&lowered.module).map_err(|e| format!("not valid: {e:?}"))?;
    if !deep {
        return Ok(Stage::Lowered);
    }
    let script = SourceFile { name: "test.gml".to_owned(), text: text.to_owned() };
    let limits = Limits { steps: 100_000, depth: 200 };
    let options = Options { check: options(), limits, ..Options::default() };
    match compile(script, &NoFiles, &options) {
        Ok(compilation) => {
            agree::hold(lowered.module, &lowered.parts, &compilation.program)?;
            Ok(evaluate(&compilation.program))
        }
        Err(_) => Ok(Stage::Refused),
    }
}

/// All evaluations of a program, at its defaults and beside them.
fn evaluate(program: &Program) -> Stage {
    let mut stage = Stage::Compiled;
    let beside = program.parameters().iter().map(|p| p.default * 0.75 + 0.1).collect();
    for x in [program.defaults(), beside] {
        drop(program.bounds(&x));
        let Ok(instance) = program.instantiate(&x) else { continue };
        stage = stage.max(Stage::Instantiated);
        let (u, v) = ([0.0, 0.3, 1.0], [0.0, 0.6, 1.0]);
        let n = u.len();
        for (patch, part) in program.parts().iter().enumerate().take(4) {
            let finite =
                instance.evaluate(patch, Sites::Scattered(&u, &v), Order::Points, &mut vec![0.0; 3 * n]).is_ok();
            drop(instance.evaluate(patch, Sites::Scattered(&u, &v), Order::SecondPartials, &mut vec![0.0; 18 * n]));
            drop(instance.evaluate(
                patch,
                Sites::Scattered(&u, &v),
                Order::Jacobian,
                &mut vec![0.0; 3 * n * part.active.len()],
            ));
            let mut gradient = vec![0.0; x.len()];
            drop(instance.evaluate(
                patch,
                Sites::Scattered(&u, &v),
                Order::Pullback(&vec![[1.0, -0.5, 0.25]; n]),
                &mut gradient,
            ));
            drop(instance.evaluate(patch, Sites::Grid(&u, &v), Order::Points, &mut vec![0.0; 3 * n * n]));
            drop(instance.evaluate(
                patch,
                Sites::Grid(&u, &v),
                Order::Pullback(&vec![[1.0, -0.5, 0.25]; n * n]),
                &mut gradient,
            ));
            if finite {
                stage = stage.max(Stage::Evaluated);
            }
        }
    }
    stage
}

impl Stage {
    fn max(self, other: Stage) -> Stage {
        if other as usize > self as usize { other } else { self }
    }
}
