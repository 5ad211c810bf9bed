//! The standard library: .gml files that are part of the compiler.

/// Name and text of every module. Its functions are in scope everywhere; what a script defines or uses goes before.
pub const MODULES: &[(&str, &str)] = &[
    ("std.math", include_str!("../../../stdlib/math.gml")),
    ("std.vector", include_str!("../../../stdlib/vector.gml")),
    ("std.frame", include_str!("../../../stdlib/frame.gml")),
    ("std.curve", include_str!("../../../stdlib/curve.gml")),
    ("std.surface", include_str!("../../../stdlib/surface.gml")),
];

/// The names that a module of the library defines. Its files begin every definition at the start of a line.
pub(super) fn names(text: &'static str) -> impl Iterator<Item = &'static str> {
    text.lines().filter_map(|line| {
        let rest = line.strip_prefix("fn ").or_else(|| line.strip_prefix("let "))?;
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        Some(&rest[..end])
    })
}

/// The module that defines a name.
pub(super) fn module_of(name: &str) -> Option<usize> {
    MODULES.iter().position(|(_, text)| names(text).any(|n| n == name))
}
