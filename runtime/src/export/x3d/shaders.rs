//! The shaders, from their files, with their common parts inserted.

use crate::export::colormap::diverging;
use std::fmt::Write;

const COMMON: &str = include_str!("glsl/common.glsl");
const COLOUR: &str = include_str!("glsl/colour.glsl");

/// Samples of the colour scale between which shaders interpolate.
const SCALE_SAMPLES: usize = 17;

/// A stage's name in X3D and its source.
type Stage = (&'static str, &'static str);

/// Displacement in the geometry stage, for desktop viewers (\[VA\] sect. 7).
pub(super) const GEOMETRY: &[Stage] = &[
    ("VERTEX", include_str!("glsl/geometry.vert")),
    ("GEOMETRY", include_str!("glsl/geometry.geom")),
    ("FRAGMENT", include_str!("glsl/geometry.frag")),
];
/// Displacement in the vertex stage, for desktop viewers that have no geometry stage.
pub(super) const VERTEX: &[Stage] =
    &[("VERTEX", include_str!("glsl/vertex.vert")), ("FRAGMENT", include_str!("glsl/vertex.frag"))];
/// Displacement in the vertex stage, for WebGL.
pub(super) const WEB: &[Stage] =
    &[("VERTEX", include_str!("glsl/web.vert")), ("FRAGMENT", include_str!("glsl/web.frag"))];

/// The complete source of a stage.
pub(in crate::export) fn complete(source: &str) -> String {
    source.replace("//!common\n", COMMON).replace("//!colour\n", &COLOUR.replace("//!scale\n", &scale()))
}

/// Statements that return the colour for `t` in [0, 1].
fn scale() -> String {
    let segments = SCALE_SAMPLES - 1;
    let vector = |i: usize| {
        let [r, g, b] = diverging(2.0 * i as f64 / segments as f64 - 1.0).map(|c| f64::from(c) / 255.0);
        format!("vec3({r:.4}, {g:.4}, {b:.4})")
    };
    let mut out = format!("  vec3 c = {};\n  t *= {segments}.0;\n", vector(0));
    for i in 1..=segments {
        let _ = writeln!(out, "  c = mix(c, {}, clamp(t - {}.0, 0.0, 1.0));", vector(i), i - 1);
    }
    out.push_str("  return c;\n");
    out
}
