//! `gmlc emit`.

use crate::cli::{EmitArgs, Stage};
use crate::error::CommandError;
use crate::{files, script};
use clap::ValueEnum;
use gml_compiler::program::{EmitStage, Failed};
use gml_compiler::source::Sources;
use gml_compiler::syntax;
use serde_json::json;

pub(crate) fn run(args: &EmitArgs) -> Result<(), CommandError> {
    let stage = match args.stage {
        Stage::Ast => return ast(args),
        Stage::Typed => EmitStage::Typed,
        Stage::Ir => EmitStage::Ir,
        Stage::Clif => EmitStage::Clif,
        Stage::Asm => EmitStage::Asm,
    };
    print(args, &script::compile(&args.script.model, &args.script.compile)?.emit(stage));
    Ok(())
}

fn print(args: &EmitArgs, text: &str) {
    let stage = args.stage.to_possible_value().map(|stage| stage.get_name().to_owned());
    args.json.print_text(text, || json!({ "stage": stage, "text": text }));
}

/// Prints the tree even if the script has syntax errors, which go to standard error and set the exit status.
fn ast(args: &EmitArgs) -> Result<(), CommandError> {
    let text = files::read_script(&args.script.model)?;
    let mut sources = Sources::default();
    let id = sources.add(args.script.model.display().to_string(), text.as_str());
    let (file, diagnostics) = syntax::parse(id, &text);
    print(args, &syntax::print(&file));
    if diagnostics.is_empty() {
        return Ok(());
    }
    Err(CommandError::from(Failed { diagnostics, sources }))
}
