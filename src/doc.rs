//! `gmlc doc`.

use crate::cli::DocArgs;
use crate::error::CommandError;
use crate::{files, outputs};
use gml_compiler::program::Failed;
use gml_compiler::reference::{self, Document};
use gml_compiler::source::Sources;
use gml_runtime::export::atomic;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &DocArgs) -> Result<(), CommandError> {
    let pages = if args.script == Path::new("std") { reference::library() } else { vec![page(&args.script)?] };
    let Some(folder) = &args.output else {
        let texts: Vec<&str> = pages.iter().map(|p| p.text.as_str()).collect();
        let page = |page: &Document| json!({ "name": page.name, "text": page.text });
        args.json.print_text(&texts.join("\n"), || json!({ "pages": pages.iter().map(page).collect::<Vec<_>>() }));
        return Ok(());
    };
    outputs::make_folder(folder)?;
    for page in &pages {
        let path = folder.join(&page.name);
        outputs::require_apart(&path, [args.script.as_path()])?;
        atomic::write(&path, page.text.as_bytes()).map_err(CommandError::failed)?;
    }
    if let Some(first) = pages.first() {
        let names: Vec<&str> = pages.iter().map(|page| page.name.as_str()).collect();
        args.json.print_text("", || json!({ "output": folder, "files": names }));
        outputs::wrote_files(folder, &first.name, pages.len());
    }
    Ok(())
}

/// The page of a script.
fn page(path: &Path) -> Result<Document, CommandError> {
    let text = files::read_script(path)?;
    let mut sources = Sources::default();
    let id = sources.add(path.display().to_string(), text.as_str());
    let title = path.file_name().unwrap_or_default().to_string_lossy();
    match reference::script(&title, id, &text) {
        Ok(text) => Ok(Document { name: Path::new(&*title).with_extension("md").display().to_string(), text }),
        Err(diagnostics) => Err(CommandError::from(Failed { diagnostics, sources })),
    }
}
