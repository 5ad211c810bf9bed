//! `gmlc diff`.

use crate::cli::DiffArgs;
use crate::error::CommandError;
use crate::{script, values};
use serde_json::json;

pub(crate) fn run(args: &DiffArgs) -> Result<(), CommandError> {
    let program = script::compile(&args.script.model, &args.script.compile)?;
    if let Some(name) = &args.wrt {
        values::parameter("--wrt", name, &program)?;
    }
    let text = program.derivative_text(args.wrt.as_deref());
    args.json.print_text(&text, || json!({ "wrt": args.wrt, "text": text }));
    Ok(())
}
