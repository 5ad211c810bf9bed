//! 3MF, the 3D Manufacturing Format: a ZIP archive with models in XML.
//!
//! The XML is read as a stream: a model of 100 MB would be a tree of a gigabyte.

mod assembly;
mod model;
mod package;

use crate::scan::error::{ScanFault, shown};
use crate::scan::raw::RawMesh;
use assembly::Assembly;
use model::{Model, Objects};
use package::Package;

const FORMAT: &str = "3MF";

/// Reads what a file's build has. Objects of several items become groups.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let mut package = Package::open(bytes)?;
    let root = package.root()?;
    let mut objects = Objects::new();
    let mut beams = 0;
    let mut open = vec![root.clone()];
    let mut known = open.clone();
    let mut main: Option<Model> = None;
    while let Some(part) = open.pop() {
        let model = package.model(&part, &mut objects)?;
        beams += model.beams;
        for path in &model.paths {
            if !known.contains(path) {
                known.push(path.clone());
                open.push(path.clone());
            }
        }
        main.get_or_insert(model);
    }
    let main = main.unwrap_or_default();
    if main.items.is_empty() {
        let message = "its build has no items, so that none of its objects is placed; export it again";
        return Err(malformed(part(&root), message));
    }
    let mut assembly = Assembly::new(&objects, package.unpacked());
    for item in &main.items {
        assembly.place(item)?;
    }
    let mut raw = assembly.finish();
    raw.unit = Some(main.unit);
    if raw.positions.is_empty() {
        return Err(ScanFault::NoVertices);
    }
    if beams > 0 {
        raw.warnings.push(format!("{beams} beam lattices are left out: triangles are read only"));
    }
    Ok(raw)
}

fn malformed(place: impl Into<String>, message: impl Into<String>) -> ScanFault {
    ScanFault::malformed(FORMAT, place, message)
}

/// The name of a part of a package, for messages.
fn part(name: &str) -> String {
    format!("`{}`", shown(name))
}
