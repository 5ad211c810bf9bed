//! The standard library: .gml files that are part of the compiler.

use super::modules::is_private;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Name and text of every module. Its names are in scope everywhere, but for those that begin with `_`; what a script
/// defines or uses goes before.
pub const MODULES: &[(&str, &str)] = &[
    ("std.math", include_str!("../../../stdlib/math.gml")),
    ("std.list", include_str!("../../../stdlib/list.gml")),
    ("std.vector", include_str!("../../../stdlib/vector.gml")),
    ("std.frame", include_str!("../../../stdlib/frame.gml")),
    ("std.curve", include_str!("../../../stdlib/curve.gml")),
    ("std.polyline", include_str!("../../../stdlib/polyline.gml")),
    ("std.spline", include_str!("../../../stdlib/spline.gml")),
    ("std.measure", include_str!("../../../stdlib/measure.gml")),
    ("std.offset", include_str!("../../../stdlib/offset.gml")),
    ("std.surface", include_str!("../../../stdlib/surface.gml")),
    ("std.sweep", include_str!("../../../stdlib/sweep.gml")),
    ("std.patch", include_str!("../../../stdlib/patch.gml")),
    ("std.solid", include_str!("../../../stdlib/solid.gml")),
    ("std.repeat", include_str!("../../../stdlib/repeat.gml")),
];

/// The names that a module of the library defines for others. Its files begin every definition at the start of a line.
pub(super) fn names(text: &'static str) -> impl Iterator<Item = &'static str> {
    text.lines().filter_map(|line| {
        let rest = ["fn ", "let ", "model "].iter().find_map(|word| line.strip_prefix(word))?;
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        Some(&rest[..end]).filter(|name| !is_private(name))
    })
}

/// The module that defines a name for others.
pub(super) fn module_of(name: &str) -> Option<usize> {
    static INDEX: OnceLock<HashMap<&str, usize>> = OnceLock::new();
    let index = INDEX.get_or_init(|| {
        let modules = MODULES.iter().enumerate();
        modules.flat_map(|(module, (_, text))| names(text).map(move |name| (name, module))).collect()
    });
    index.get(name).copied()
}
