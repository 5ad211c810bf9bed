//! The standard library of the .gml language: the text of its modules, which the compiler embeds.

/// Name and text of every module.
pub const MODULES: &[(&str, &str)] = &[
    ("std.math", include_str!("math.gml")),
    ("std.list", include_str!("list.gml")),
    ("std.vector", include_str!("vector.gml")),
    ("std.frame", include_str!("frame.gml")),
    ("std.curve", include_str!("curve.gml")),
    ("std.polyline", include_str!("polyline.gml")),
    ("std.path", include_str!("path.gml")),
    ("std.spline", include_str!("spline.gml")),
    ("std.measure", include_str!("measure.gml")),
    ("std.offset", include_str!("offset.gml")),
    ("std.surface", include_str!("surface.gml")),
    ("std.sweep", include_str!("sweep.gml")),
    ("std.patch", include_str!("patch.gml")),
    ("std.outline", include_str!("outline.gml")),
    ("std.solid", include_str!("solid.gml")),
    ("std.edge", include_str!("edge.gml")),
    ("std.fillet", include_str!("fillet.gml")),
    ("std.thread", include_str!("thread.gml")),
    ("std.gear", include_str!("gear.gml")),
    ("std.repeat", include_str!("repeat.gml")),
];
