//! What tests of solids ask of the built command.

use super::gmlc;
use serde_json::Value;
use std::collections::HashMap;
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// The JSON that `gmlc check` gives of a script at some values of its parameters.
pub(crate) fn checked(script: &str, values: &[String]) -> Value {
    let folder = tempdir().expect("a folder");
    checked_in(folder.path(), script, values)
}

/// The same in a folder that may have other files.
pub(crate) fn checked_in(folder: &Path, script: &str, values: &[String]) -> Value {
    fs::write(folder.join("model.gml"), script).expect("written");
    let given = values.iter().flat_map(|value| ["-p", value]);
    let args: Vec<&str> = ["check", "model.gml", "--json"].into_iter().chain(given).collect();
    serde_json::from_str(&gmlc(folder, &args)).expect("JSON")
}

/// The value of a measure.
pub(crate) fn measure(check: &Value, k: usize) -> f64 {
    check["measures"][k]["value"].as_f64().expect("a value")
}

/// The corners of the triangles of a binary STL file.
pub(crate) fn triangles(bytes: &[u8]) -> Vec<[[u32; 3]; 3]> {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    (0..word(80) as usize)
        .map(|k| [0, 1, 2].map(|corner| [0, 1, 2].map(|c| word(84 + 50 * k + 12 + 12 * corner + 4 * c))))
        .collect()
}

/// Panics where a mesh in a binary STL file has an edge that two triangles do not share in opposite senses, or hardly
/// any triangles.
pub(crate) fn must_be_closed(stl: &Path) {
    let count = closed_triangles(stl);
    assert!(count > 100, "{count} triangles");
}

/// The number of triangles of such a mesh; panics where an edge is not shared so.
pub(crate) fn closed_triangles(stl: &Path) -> usize {
    let triangles = triangles(&fs::read(stl).expect("it is there"));
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for corners in &triangles {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|n| *n == 0), "open edges of {} triangles", triangles.len());
    triangles.len()
}
